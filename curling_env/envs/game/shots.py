"""Shots as actions: an agent calls a draw, a guard or a hit, and the throw for it is found.

Each shot of a list has a number. The throw is aimed on the known ice, as by a player of the
package. A mask marks the available shots of a position.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from curling_env.errors import InputError
from curling_env.game import Call, PlayerView
from curling_env.game.opponents import BOARD_WEIGHT, PEEL_WEIGHT, AimingPlayer
from curling_env.game.rules.teams import STONES_PER_TEAM, RestingStone, Stones, Team
from curling_env.typing import Floats

# List of shots: a change to it requires a new version of the environments.
DRAWS = {
    "the button": (0.0, 0.0),
    "the left of the button": (-0.45, 0.2),
    "the right of the button": (0.45, 0.2),
    "the top of the 4-foot": (0.0, -0.6),
    "the back of the 4-foot": (0.0, 0.6),
    "the left of the house": (-1.1, 0.1),
    "the right of the house": (1.1, 0.1),
    "the top of the house": (0.0, -1.3),
}
"""Places in the house to draw to, delivery frame [m]."""
GUARDS = {
    "a long centre guard": (0.0, -3.6),
    "a short centre guard": (0.0, -2.4),
    "a left corner guard": (-1.1, -3.0),
    "a right corner guard": (1.1, -3.0),
}
"""Places before the house, delivery frame [m]."""
WEIGHTS = {"control weight": 1.12, "board weight": BOARD_WEIGHT, "peel weight": PEEL_WEIGHT}
"""Weights of hits, relative to a draw to the button."""
SIDES = {"on the nose": 0.0, "on its left": -0.12, "on its right": 0.12}
"""Offset at which a stone is hit, right of its centre [m]."""
COVER = 1.6
"""Distance of a guard before its stone [m]."""
GAP = 0.02
"""Gap after a freeze [m]."""


class Shot(NamedTuple):
    """One shot of the list.

    Parameters
    ----------
    name : what it is, in words
    kind : "draw", "hit", "freeze", "cover" or "through"
    place : (x, y) of a draw [m]
    handle : -1 or 1 for a draw with that handle; 0 for whichever is free
    stone : index of the stone that it is about, own ones first; -1 for none
    weight, off : of a hit
    """

    name: str
    kind: str
    place: tuple[float, float] = (0.0, 0.0)
    handle: int = 0
    stone: int = -1
    weight: float = 1.0
    off: float = 0.0


def _list_of_shots() -> tuple[Shot, ...]:
    shots = [
        Shot(f"draw to {name}, {turn}", "draw", place=place, handle=handle)
        for name, place in {**DRAWS, **GUARDS}.items()
        for turn, handle in (("clockwise", -1), ("counter-clockwise", 1))
    ]
    stones = [
        f"{whose} stone {k + 1}" for whose in ("own", "their") for k in range(STONES_PER_TEAM)
    ]
    for k, stone in enumerate(stones):
        for weight, speed in WEIGHTS.items():
            for side, off in SIDES.items():
                words = f"hit {stone} {side}, {weight}"
                shots.append(Shot(words, "hit", stone=k, weight=speed, off=off))
        shots.append(Shot(f"freeze to {stone}", "freeze", stone=k))
        shots.append(Shot(f"guard {stone}", "cover", stone=k))
    return (*shots, Shot("through the house", "through"))


SHOTS = _list_of_shots()
"""The shots, by their numbers; the last one goes through the house."""
_STONE = np.array([shot.stone for shot in SHOTS])
_DRAWS = [k for k, shot in enumerate(SHOTS) if shot.kind == "draw"]
_PLACES: Floats = np.array([SHOTS[k].place for k in _DRAWS], dtype=np.float64)
_IS_HIT = np.array([shot.kind == "hit" for shot in SHOTS])
_IS_GUARD = np.array([s.kind == "cover" or s.place in GUARDS.values() for s in SHOTS])


class ShotActions:
    """Converter between numbers of shots and calls, in place of `GameAction`."""

    choices = "rule"
    sweeping = "scripted"
    size = 1
    names = tuple(shot.name for shot in SHOTS)
    """Names of the actions, in order."""

    def __init__(self) -> None:
        self._aiming = _Aiming()

    @property
    def space(self) -> spaces.Space[Any]:
        """The space of the actions."""
        return spaces.Discrete(len(SHOTS))

    def call_of(self, action: Any, view: PlayerView | None = None) -> Call:
        """Return the call for the throw that makes a shot.

        Parameters
        ----------
        action : number of the shot
        view : what the team to throw sees

        Raises
        ------
        InputError : no number of a shot, or no end in play
        """
        number = np.asarray(action)
        if number.shape != () or number.dtype.kind not in "iu" or not 0 <= number < len(SHOTS):
            raise InputError(
                f"an action must be the number of a shot, 0 to {len(SHOTS) - 1}, got {action}"
            )
        if view is None or view.game.end is None:
            raise InputError("a shot needs an end in play")
        return self._aiming.shot(view, SHOTS[int(number)])

    def calls_of(
        self, actions: Sequence[Any], view: Callable[[int], PlayerView] | None = None
    ) -> list[Call]:
        """Return the calls for many shots; `view` returns the view of the team with the k-th
        shot.
        """
        return [
            self.call_of(action, None if view is None else view(k))
            for k, action in enumerate(actions)
        ]

    def decisions_of(self, action: Any) -> None:
        """None: shots decide nothing else."""
        return None

    def action_of(self, call: Call, decisions: Any = None) -> Any:
        """Not possible: few throws are a shot of the list."""
        raise InputError(
            "a throw has no number among shots; make the environment with actions='throws'"
        )

    def mask(self, view: PlayerView) -> NDArray[np.int8]:
        """Return the available shots, (n,): 1 or 0; all if no end is in play."""
        end = view.game.end
        if end is None:
            return np.ones(len(SHOTS), dtype=np.int8)
        lying = _by_index(end.stones, view.team)
        there = np.zeros(2 * STONES_PER_TEAM + 1, dtype=np.bool_)
        near = there.copy()
        there[list(lying)] = True
        near[[k for k, stone in lying.items() if stone.y > -2.0]] = True
        mask = np.where(_IS_HIT, there[_STONE], near[_STONE])
        places = np.array([(stone.x, stone.y) for stone in end.stones]).reshape(-1, 1, 2)
        mask[_DRAWS] = (np.hypot(*(places - _PLACES).transpose(2, 0, 1)) > 0.3).all(axis=0)
        # A guard with the last stone of the end is worthless.
        if end.delivered >= view.game.rules.deliveries - 1:
            mask[_IS_GUARD] = False
        mask[-1] = True
        return mask.astype(np.int8)


def _by_index(stones: Stones, team: Team) -> dict[int, RestingStone]:
    """Return stones by their index, own ones first."""
    return {
        stone.number + (0 if stone.team is team else STONES_PER_TEAM): stone for stone in stones
    }


class _Aiming(AimingPlayer):
    """Converter of shots to throws."""

    name = "shots"

    def call(self, view: PlayerView) -> Call:
        raise AssertionError("it aims shots and does not choose any")

    def shot(self, view: PlayerView, shot: Shot) -> Call:
        """Return the call for a shot; if it is impossible, the stone goes through the house."""
        end = view.game.end
        assert end is not None
        found: Call | None = None
        stone = _by_index(end.stones, view.team).get(shot.stone)
        if shot.kind == "draw":
            throw = self.aim(view).draw(*shot.place, shot.handle * view.delivery.spin)
            found = None if throw is None else Call(throw=throw, shot=shot.name)
        elif stone is not None and shot.kind == "hit":
            found = self.hit(
                view, stone, shot.name, weight=shot.weight, off=shot.off, clear=True
            ) or self.hit(view, stone, shot.name, weight=shot.weight, off=shot.off, clear=False)
        elif stone is not None:
            back = 2 * view.game.lines.stone_radius + GAP if shot.kind == "freeze" else COVER
            found = self._draw(view, stone.x, stone.y - back, shot.name)
        return self.through(view) if found is None else found

    def _draw(self, view: PlayerView, x: float, y: float, name: str) -> Call | None:
        """Return a draw with a free path if there is one, else any."""
        free = self.draw_to(view, x, y, name)
        if free is not None:
            return free
        spin = view.delivery.spin if x >= 0 else -view.delivery.spin
        throw = self.aim(view).draw(x, y, spin)
        return None if throw is None else Call(throw=throw, shot=name)
