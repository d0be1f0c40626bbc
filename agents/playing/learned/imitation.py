"""Which shot of the list a recorded throw was: from a dataset of throws to lessons for a network.

A throw of a player that searches is seldom exactly a shot of the list. It is taken for the one
nearest to it: where it would rest on the empty sheet tells a draw or a freeze, which stone it would
reach first, where and how fast, tells a hit.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from agents.playing.learned.features import PLACES, positions_of
from agents.playing.learned.network import HANDLES, OF_A_STONE, OF_PLACES
from agents.playing.search.positions import SLOTS
from curling_env.envs.game.shots import COVER, GAP, SHOTS, SIDES, WEIGHTS
from curling_env.ice import Ice
from curling_env.physics.one_stone.aim import Aim
from curling_env.physics.session import simulate
from curling_env.sheet import TEE_Y
from curling_env.throw import Throw
from curling_env.typing import Floats, Integers, Progress, Singles, no_progress

HIT_FROM = 1.07
"""Weight over that of a draw to the button from which a throw is meant to hit."""
TOUCH = 0.29
"""Distance of two centres at which stones touch [m]."""
FAR = 0.6
"""A throw that would rest farther from every place of the list is left out [m]."""
CLOSE_UP = 0.45
"""Distance from where a freeze or a guard of a stone would lie at which a throw is one [m]."""
SAMPLES = 8.0
"""Points of a path a second."""
AT_ONCE = 500
"""Throws that are simulated together."""
FIRST_STONE = OF_PLACES
_SIDES = np.array(list(SIDES.values()))
_WEIGHTS = np.array(list(WEIGHTS.values()))
_FREEZE, _GUARD = len(_WEIGHTS) * len(_SIDES), len(_WEIGHTS) * len(_SIDES) + 1


@dataclass(frozen=True, kw_only=True)
class Lessons:
    """Which shot was called in which position.

    Parameters
    ----------
    observations : (n, k) flat observations of `CurlingEnd-v0`
    shots : (n,) numbers of shots
    """

    observations: Singles
    shots: Integers

    def __len__(self) -> int:
        return len(self.shots)


def lessons_of(
    ice: Ice,
    observations: Singles,
    throws: Sequence[Throw],
    *,
    progress: Progress = no_progress,
) -> Lessons:
    """The shots of the list that throws come nearest to; throws near none are left out.

    Parameters
    ----------
    ice : the ice as the thrower knew it
    observations : (n, k) flat observations before the throws, all towards the away end
    throws : the n throws without execution error
    progress : called after every part
    """
    button = Aim(ice).draw_weight() or 2.0
    positions = positions_of(observations)
    shots = np.full(len(throws), -1)
    for begin in range(0, len(throws), AT_ONCE):
        some = throws[begin : begin + AT_ONCE]
        paths = simulate(ice, some, fps=SAMPLES)
        for k, (throw, path) in enumerate(zip(some, paths, strict=True), start=begin):
            xy = path.xy - [0.0, TEE_Y]
            shots[k] = shot_of(xy, throw.speed / button, throw.spin, positions[k])
        progress("throws", begin + len(some), len(throws))
    good = shots >= 0
    return Lessons(observations=observations[good], shots=shots[good])


def shot_of(path: Floats, weight: float, spin: float, stones: Floats) -> int:
    """The shot of the list that a throw comes nearest to, or -1.

    Parameters
    ----------
    path : (m, 2) its way on the empty sheet, delivery frame [m]
    weight : its speed over that of a draw to the button
    spin : its spin [rad/s]
    stones : (16, 2) where stones lie, own ones first, delivery frame [m]
    """
    reached, off = _first_reached(path, stones)
    if weight >= HIT_FROM:
        if reached < 0:
            return len(SHOTS) - 1
        kind = np.abs(_WEIGHTS - weight).argmin() * len(_SIDES) + np.abs(_SIDES - off).argmin()
        return int(FIRST_STONE + OF_A_STONE * reached + kind)
    return _draw_of(path[-1], spin, stones)


def _draw_of(rest: Floats, spin: float, stones: Floats) -> int:
    to_places = np.hypot(*(PLACES - rest).T)
    place = int(to_places.argmin())
    best, found = float(to_places[place]), HANDLES * place + int(spin > 0)
    lying = np.flatnonzero(np.isfinite(stones[:, 0]))
    for kind, back in ((_FREEZE, TOUCH + GAP), (_GUARD, COVER)):
        # A freeze is what it is wherever its stone lies, and so goes before a place near by.
        for k in lying.tolist():
            if stones[k, 1] <= -2.0:
                continue
            off = float(np.hypot(*(stones[k] - [0.0, back] - rest)))
            if off < min(CLOSE_UP, best):
                best, found = off, FIRST_STONE + OF_A_STONE * k + kind
    return found if best <= FAR else -1


def _first_reached(path: Floats, stones: Floats) -> tuple[int, float]:
    """The first stone on a path, -1 for none, and how far right of its centre the path passes."""
    crossing: Any = np.interp(stones[:, 1], path[:, 1], path[:, 0], left=np.nan, right=np.nan)
    off = crossing - stones[:, 0]
    on_path = np.abs(off) < TOUCH
    if not on_path.any():
        return -1, 0.0
    first = int(np.where(on_path, stones[:, 1], np.inf).argmin())
    return first, float(off[first])


def mirrored(lessons: Lessons) -> Lessons:
    """The same lessons with left and right exchanged: stones, handles, sides of hits."""
    observations = lessons.observations.copy()
    observations[:, -3 * SLOTS + 1 :: 3] *= -1
    return Lessons(observations=observations, shots=_MIRROR[lessons.shots])


def _kinship() -> Singles:
    """How much a shot of the list (row) speaks for another (column): rows add up to 1."""
    like = np.zeros((len(SHOTS), len(SHOTS)))
    for a, one in enumerate(SHOTS):
        for b, other in enumerate(SHOTS):
            if (one.kind, one.stone) != (other.kind, other.stone):
                continue
            apart = np.hypot(*np.subtract(one.place, other.place)) / 0.4
            off, weight = (one.off - other.off) / 0.1, (one.weight - other.weight) / 0.2
            like[a, b] = np.exp(-(apart**2) - off**2 - weight**2)
            like[a, b] *= 1.0 if one.handle == other.handle else 0.4
    return (like / like.sum(axis=1, keepdims=True)).astype(np.float32)


KINSHIP = _kinship()
"""What is called for is seldom exactly one shot: draws near by and hits alike share in it."""


def _mirror() -> Integers:
    """For each shot of the list, the number of the one seen in a mirror."""
    by_look = {_look(k, 1.0): k for k in range(len(SHOTS))}
    return np.array([by_look[_look(k, -1.0)] for k in range(len(SHOTS))])


def _look(k: int, side: float) -> tuple[Any, ...]:
    shot = SHOTS[k]
    x, y = shot.place
    return (shot.kind, side * x, y, side * shot.handle, shot.stone, shot.weight, side * shot.off)


_MIRROR = _mirror()
