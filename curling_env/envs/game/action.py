"""Conversion of actions, numbers in [-1, 1], to calls: throws, sweeping, decisions."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from gymnasium import spaces
from numpy.typing import ArrayLike

from curling_env.envs.options import brief, floats_from, one_of
from curling_env.envs.sheet.action import ThrowRange
from curling_env.errors import InputError
from curling_env.game.players import Call, Player, PlayerView
from curling_env.game.rules.delivery import Ruling
from curling_env.game.rules.rulesets import Side
from curling_env.throw import Throw
from curling_env.typing import Floats, Singles

Sweeping = Literal["none", "scripted", "action"]
Choices = Literal["rule", "action"]
LONGEST_SWEEP = 30.0
"""Maximum start and duration of sweeping in an action [s]; a draw takes less."""
CONCEDE_ABOVE = 0.9
"""Minimum decision number of a concession: random actions seldom exceed it."""


@dataclass(frozen=True, kw_only=True)
class TeamDecisions:
    """A team's decisions, which hold until its next delivery.

    Parameters
    ----------
    put_back : after a tick by the opponent, whether the stones are put back rather than left
    power_play : in mixed doubles, the side of a power play if an end begins in which the team
        decides and may have one; None for no power play
    throw_first : in mixed doubles, whether the team gives the hammer away if an end begins in which
        it decides and has no power play
    concede : whether the team concedes instead of delivering, where the rules allow it
    """

    put_back: bool = True
    power_play: Side | None = None
    throw_first: bool = False
    concede: bool = False


class FollowsDecisions(Player):
    """Player that follows given decisions; it is not asked for throws."""

    def __init__(self, decisions: TeamDecisions) -> None:
        self._decisions = decisions

    def call(self, view: PlayerView) -> Call:
        raise AssertionError("a player that follows decisions is not asked for throws")

    def puts_back(self, view: PlayerView, ruling: Ruling) -> bool:
        """Return the given decision."""
        return self._decisions.put_back

    def power_play(self, view: PlayerView) -> Side | None:
        """Return the given decision."""
        return self._decisions.power_play

    def throws_first(self, view: PlayerView) -> bool:
        """Return the given decision."""
        return self._decisions.throw_first


class GameAction:
    """Converter between actions and calls.

    Parameters
    ----------
    throws : the throws to choose from
    sweeping : ``none``, ``scripted`` (sweepers decide) or ``action``: two further numbers of an
        action say when sweeping begins, from release to 30 s after it, and how long it lasts,
        from not at all to 30 s
    choices : ``rule`` or ``action``: the last four numbers of an action are decisions that hold
        until the team's next action: after a tick the stones are put back (0 and above) or left;
        a power play to the left (below -1/3), none, or to the right (above 1/3); the hammer is
        given away (above 0) or kept; the game is conceded (above 0.9) or played on

    Raises
    ------
    InputError : another value of sweeping or choices
    """

    def __init__(self, throws: ThrowRange, sweeping: Sweeping, choices: Choices = "rule") -> None:
        self.throws = throws
        self.choices: Choices = one_of("choices", choices, ("rule", "action"))
        self.sweeping: Sweeping = one_of("sweeping", sweeping, ("none", "scripted", "action"))
        self.size = 3 + 2 * (sweeping == "action") + 4 * (choices == "action")

    @property
    def space(self) -> spaces.Space[Singles]:
        """The space of the actions."""
        box: Any = spaces.Box(-1.0, 1.0, (self.size,), np.float32)
        return box

    def call_of(self, action: ArrayLike, view: PlayerView | None = None) -> Call:
        """Return the call of an action; numbers beyond ±1 are clipped.

        It does not depend on the position in `view`.

        Raises
        ------
        InputError : not the right number of finite numbers
        """
        return self.calls_of([action])[0]

    def calls_of(
        self, actions: Sequence[ArrayLike], view: Callable[[int], PlayerView] | None = None
    ) -> list[Call]:
        """Return the calls of many actions, as by `call_of`."""
        numbers = self._numbers(actions, count=len(actions))
        sweeps: list[Any] = [None] * len(numbers)
        if self.sweeping == "action":
            begin, length = (LONGEST_SWEEP * (np.clip(numbers[:, 3:5], -1, 1) + 1) / 2).T
            sweeps = list(zip(begin.tolist(), (begin + length).tolist(), strict=True))
        return [
            Call(throw=Throw(speed=speed, angle=angle, spin=spin), sweep=sweep)
            for (speed, angle, spin), sweep in zip(
                self.throws.numbers_of(numbers[:, :3]).tolist(), sweeps, strict=True
            )
        ]

    def decisions_of(self, action: ArrayLike) -> TeamDecisions | None:
        """Return the decisions in an action; None if it has none.

        Raises
        ------
        InputError : not the right number of finite numbers
        """
        if self.choices == "rule":
            return None
        put_back, side, first, concede = self._numbers([action], count=1)[0, -4:].tolist()
        power_play: Side | None = None
        if abs(side) > 1 / 3:
            power_play = "left" if side < 0 else "right"
        return TeamDecisions(
            put_back=put_back >= 0,
            power_play=power_play,
            throw_first=first > 0,
            concede=concede > CONCEDE_ABOVE,
        )

    def _numbers(self, actions: Sequence[ArrayLike], *, count: int) -> Floats:
        wanted = f"an action must be {self.size} finite numbers in [-1, 1]"
        given = floats_from(wanted, actions)
        if given.shape != (count, self.size) or not np.isfinite(given).all():
            raise InputError(f"{wanted}, got {brief(actions[0] if count == 1 else actions)}")
        return given

    def action_of(self, call: Call, decisions: TeamDecisions | None = None) -> Singles:
        """Return the action of a call and decisions, clipped to its range."""
        parts = [self.throws.action_of(call.throw)]
        if self.sweeping == "action":
            begin, end = call.sweep or (0.0, 0.0)
            sweep = np.array([begin, end - begin]) / LONGEST_SWEEP * 2 - 1
            parts.append(np.clip(sweep, -1, 1).astype(np.float32))
        if self.choices == "action":
            chosen = decisions or TeamDecisions()
            side = {"left": -1.0, "right": 1.0, None: 0.0}[chosen.power_play]
            flags = (chosen.put_back, chosen.throw_first, chosen.concede)
            put_back, first, concede = (1.0 if yes else -1.0 for yes in flags)
            parts.append(np.array([put_back, side, first, concede], dtype=np.float32))
        return np.concatenate(parts)
