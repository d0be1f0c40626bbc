"""What shots of the list promise if they come off: the value of the position that they would leave.

No physics is asked: a draw lies where it was drawn to, a stone that was hit is gone, and the
thrown stone stays or rolls as the textbook says. The value network of `search` tells what each such
position is worth. How often shots come off is left to the network that learns to call them.
"""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

import numpy as np

from agents.playing.search.positions import SCORES, SLOTS, points_of
from agents.playing.search.value_network import ValueNetwork, load_network
from curling_env.envs.game.shots import COVER, GAP, SHOTS, Shot
from curling_env.game.rules.lines import Lines
from curling_env.game.rules.teams import STONES_PER_TEAM
from curling_env.typing import Flags, Floats, Indices, Singles

WORTH = (SCORES > 0).astype(np.float64)
"""What each score is worth to the team with the hammer: it wants to score."""
ROLLS = {1.12: 1.0, 1.25: 2.0}
"""How far a stone rolls that hits another on a side, by its weight [m]; faster ones leave play."""
ROLL_ASIDE, ROLL_ON = 0.91, 0.41
"""Direction of that roll: sideways, and along play; the stones meet at 24 degrees."""


class _Outcome(NamedTuple):
    """What a shot leaves.

    Parameters
    ----------
    place : (x, y) of the thrown stone, from the stone that the shot is about; NaN where it is gone
    removes : whether that stone is gone
    """

    place: tuple[float, float]
    removes: bool


GONE = (float("nan"), float("nan"))
AROUND: tuple[_Outcome, ...] = tuple(
    dict.fromkeys(
        [_Outcome((0.0, 0.0), True), _Outcome(GONE, True)]
        + [
            _Outcome((side * ROLL_ASIDE * roll, ROLL_ON * roll), True)
            for roll in ROLLS.values()
            for side in (-1, 1)
        ]
        + [_Outcome((0.0, -COVER), False), _Outcome((0.0, -0.29 - GAP), False)]
    )
)
"""What shots about a stone may leave."""


def prospects_of(
    lines: Lines, positions: Floats, delivered: Indices, hammer: Flags, protected: Flags
) -> Singles:
    """Points that each shot of the list promises over a stone thrown through, (n, 201).

    Shots about stones that do not lie promise nothing.

    Parameters
    ----------
    lines : lines of the sheet
    positions : (n, 16, 2) stones, the thrower's first, delivery frame [m]; NaN where there is none
    delivered : (n,) stones delivered before
    hammer : (n,) whether the thrower has the hammer
    protected : (n,) whether guards may not be put out yet
    """
    n = len(positions)
    places, removed, about = _outcomes(positions)
    guards = (positions[:, :, 1] < lines.guard_line) & (
        np.hypot(positions[:, :, 0], positions[:, :, 1]) > lines.reach
    )
    guards[:, :STONES_PER_TEAM] = False
    values = np.zeros((n, len(places[0])), dtype=np.float32)
    for k in np.unique(delivered):
        rows = np.flatnonzero(delivered == k)
        values[rows] = _values(
            lines, positions[rows], places[rows], removed, about, int(k), hammer[rows]
        )
    # A guard that may not be put out is put back, and the thrown stone is gone: nothing is gained.
    unfair = np.zeros((n, len(about)), dtype=np.bool_)
    of_a_stone = about >= 0
    unfair[:, of_a_stone] = (guards & protected[:, None])[:, about[of_a_stone]] & removed[
        of_a_stone
    ]
    values[unfair] = np.broadcast_to(values[:, -1:], values.shape)[unfair]
    values -= values[:, -1:]
    missing = np.zeros_like(unfair)
    missing[:, of_a_stone] = np.isnan(positions[:, about[of_a_stone], 0])
    values[missing] = 0.0
    return values[:, _COLUMN]


def _points(lines: Lines, stones: Floats, left: int) -> Floats:
    """Points that positions promise the team with the hammer, whose stones come first, (n,)."""
    if not left:
        return points_of(lines, stones).astype(np.float64)
    return _network().score_probabilities(lines, stones, left, WORTH, 0.0) @ SCORES


def _outcomes(positions: Floats) -> tuple[Floats, Flags, Indices]:
    """Where the thrown stone would lie (n, m, 2), whether a stone is gone (m,), and which (m,)."""
    n = len(positions)
    drawn = np.broadcast_to(_PLACES, (n, len(_PLACES), 2))
    around = np.array([outcome.place for outcome in AROUND])
    of_stones = (positions[:, :, None] + around).reshape(n, -1, 2)
    through = np.full((n, 1, 2), np.nan)
    removed = np.concatenate(
        [
            np.zeros(len(_PLACES), dtype=np.bool_),
            np.tile([outcome.removes for outcome in AROUND], SLOTS),
            [False],
        ]
    )
    about = np.concatenate(
        [np.full(len(_PLACES), -1), np.repeat(np.arange(SLOTS), len(AROUND)), [-1]]
    )
    return np.concatenate([drawn, of_stones, through], axis=1), removed, about


def _values(
    lines: Lines,
    positions: Floats,
    places: Floats,
    removed: Flags,
    about: Indices,
    delivered: int,
    hammer: Flags,
) -> Singles:
    """Points to the thrower of the positions that shots would leave, (n, m)."""
    n, m = places.shape[:2]
    after = np.repeat(positions[:, None], m, axis=1)
    gone = np.flatnonzero(removed)
    after[:, gone, about[gone]] = np.nan
    here = np.isfinite(places[:, :, 0]) & (np.abs(places[:, :, 0]) < lines.width / 2)
    here &= places[:, :, 1] < lines.reach
    number = min(delivered // 2, STONES_PER_TEAM - 1)
    after[:, :, number] = np.where(here[:, :, None], places, np.nan)
    # Only what there is needs a value: shots about stones that lie.
    some = np.ones((n, m), dtype=np.bool_)
    some[:, about >= 0] = np.isfinite(positions[:, about[about >= 0], 0])
    which = np.nonzero(some)
    theirs = ~hammer[which[0]]
    stones = after[which]
    stones[theirs] = np.roll(stones[theirs], STONES_PER_TEAM, axis=1)
    points = _points(lines, stones, SLOTS - delivered - 1)
    values = np.zeros((n, m), dtype=np.float32)
    values[which] = np.where(theirs, -points, points)
    return values


@cache
def _network() -> ValueNetwork:
    return load_network()


def _outcome_of(shot: Shot) -> _Outcome:
    """What a shot about a stone leaves."""
    if shot.kind == "freeze":
        return _Outcome((0.0, -0.29 - GAP), False)
    if shot.kind == "cover":
        return _Outcome((0.0, -COVER), False)
    if shot.off == 0:
        return _Outcome((0.0, 0.0), True)
    if shot.weight not in ROLLS:
        return _Outcome(GONE, True)
    side, roll = (1 if shot.off > 0 else -1), ROLLS[shot.weight]
    return _Outcome((side * ROLL_ASIDE * roll, ROLL_ON * roll), True)


_PLACES = np.array(list(dict.fromkeys(shot.place for shot in SHOTS if shot.kind == "draw")))


def _columns() -> Indices:
    """For each shot of the list, which of the outcomes it has."""
    drawn = [tuple(place) for place in _PLACES.tolist()]
    looks = [(str(o.place), o.removes) for o in AROUND]
    found: list[int] = []
    for shot in SHOTS:
        if shot.kind == "draw":
            found.append(drawn.index(shot.place))
        elif shot.kind == "through":
            found.append(len(drawn) + SLOTS * len(AROUND))
        else:
            outcome = _outcome_of(shot)
            kind = looks.index((str(outcome.place), outcome.removes))
            found.append(len(drawn) + shot.stone * len(AROUND) + kind)
    return np.array(found)


_COLUMN = _columns()
