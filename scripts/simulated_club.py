"""Simulated club evening with known truth: athletes, stones, ice, and the causes of misses.

Its stones slide by the formulas of `simulated_ice.py` alone, so that results of the coaching
functions can be compared with it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations, pairwise, permutations

import numpy as np
from simulated_ice import (
    STEP,
    TEE,
    Own,
    TrueIce,
    aimed,
    believed_of,
    random_ice,
    seen_rests,
    slide,
)

from curling_env.trajectory import Trajectory
from curling_env.typing import Floats
from friction_estimation.tracks.throw_list import ThrowNote

CAUSES = ("weight", "line", "rotation", "ice")


@dataclass(frozen=True, kw_only=True)
class Athlete:
    """Bias and spread of an athlete at the release.

    Parameters
    ----------
    name : name in the notes
    bias : (3,) of speed [m/s], angle [rad], spin [rad/s]
    spread : (3,) standard deviations about the bias
    spin : usual spin, without sign [rad/s]
    """

    name: str
    bias: tuple[float, float, float] = (0.0, 0.0, 0.0)
    spread: tuple[float, float, float] = (0.03, 0.005, 0.15)
    spin: float = 1.3


@dataclass(frozen=True, kw_only=True, eq=False)
class Evening:
    """Measurements of an evening, and the truth behind them.

    Parameters
    ----------
    tracks, notes : as a club has them
    ice, believed : the true ice, and the ice that the team assumed
    intended, thrown : (n, 4) speed, angle, spin, x
    targets : (n, 2) right, past [m]
    rests : (n, 2) the same
    parts : for each cause (n, 2), which add up to the misses [m]
    own : deviations of each throw
    """

    tracks: list[Trajectory]
    notes: dict[int, ThrowNote]
    ice: TrueIce
    believed: TrueIce
    intended: Floats
    thrown: Floats
    targets: Floats
    rests: Floats
    parts: dict[str, Floats]
    own: Own


def evening(
    rng: np.random.Generator,
    *,
    athletes: Sequence[Athlete] = (Athlete(name="Ada"),),
    throws: int = 12,
    stones: dict[int, tuple[float, float]] | None = None,
    own: float = 0.005,
    hairs: float = 0.1,
    off: float = 0.04,
    ice: TrueIce | None = None,
) -> Evening:
    """Simulate draws and guards of some athletes on one ice.

    Parameters
    ----------
    rng : source of all randomness
    athletes : the throwers, in turn
    throws : number of throws of each athlete
    stones : factors of friction and of curl of each stone, thrown in turn; None for one stone
    own : spread of ln friction from throw to throw; that of the curl is five times as large
    hairs : share of throws that pick something up on their way
    off : see `believed_of`
    ice : the ice; None for one that is drawn
    """
    ice = random_ice(rng) if ice is None else ice
    believed = believed_of(rng, ice, off=off)
    count = throws * len(athletes)
    who = [athletes[k % len(athletes)] for k in range(count)]
    handles = np.where((np.arange(count) // len(athletes)) % 2 == 0, -1.0, 1.0)
    guards = rng.random(count) < 0.25
    targets = np.where(
        guards[:, None],
        rng.normal([0.0, -3.2], [0.4, 0.5], (count, 2)),
        rng.normal([0.0, -0.2], [0.5, 0.6], (count, 2)),
    ).round(2)
    x = 0.05 * rng.standard_normal(count)
    spins = handles * np.array([athlete.spin for athlete in who])
    intended = aimed(believed, targets, spins, x)
    errors = np.array([a.bias for a in who]) + np.array(
        [a.spread for a in who]
    ) * rng.standard_normal((count, 3))
    thrown = intended.copy()
    thrown[:, :2] += errors[:, :2]
    thrown[:, 2] += handles * errors[:, 2]  # more turns, for both handles
    names = sorted(stones) if stones else [0]
    numbers = np.array([names[(k // len(athletes)) % len(names)] for k in range(count)])
    factors = np.array([(stones or {0: (1.0, 1.0)})[k] for k in numbers.tolist()])
    particular = Own(
        friction=factors[:, 0] * np.exp(own * rng.standard_normal(count)),
        curl=factors[:, 1] * np.exp(5 * own * rng.standard_normal(count)),
        later=np.where(rng.random(count) < hairs, rng.uniform(1.03, 1.08, count), 1.0),
        since=rng.uniform(7.0, 14.0, count),
    )
    ends, states = slide(ice, thrown, particular)
    rests = ends - [0.0, TEE]
    notes = {
        k: ThrowNote(
            athlete=who[k].name,
            stone=str(numbers[k]),
            called=f"{'guard' if guards[k] else 'draw'} {targets[k, 0]:g},{targets[k, 1]:g} "
            f"{'in' if handles[k] < 0 else 'out'}",
        )
        for k in range(count)
    }
    tracks = [
        filmed(rng, np.array([state[k] for state in states]), throw=k, stone=int(numbers[k]))
        for k in range(count)
    ]
    return Evening(
        tracks=tracks,
        notes=notes,
        ice=ice,
        believed=believed,
        intended=intended,
        thrown=thrown,
        targets=targets,
        rests=rests,
        parts=true_parts(ice, believed, intended, thrown, targets, rests),
        own=particular,
    )


def true_parts(
    ice: TrueIce,
    believed: TrueIce,
    intended: Floats,
    thrown: Floats,
    targets: Floats,
    rests: Floats,
) -> dict[str, Floats]:
    """Return each cause's part of the miss, averaged over all orders of the causes."""
    known: dict[frozenset[str], Floats] = {}
    hands = [frozenset(some) for n in range(4) for some in combinations(CAUSES[:3], n)]
    mixed = np.concatenate(
        [np.where([c in some for c in CAUSES[:3]] + [False], thrown, intended) for some in hands]
    )
    for there, others in ((believed, frozenset[str]()), (ice, frozenset(["ice"]))):
        found = np.split(seen_rests(there, mixed), len(hands))
        known |= {some | others: rest for some, rest in zip(hands, found, strict=True)}
    parts = {cause: np.zeros_like(targets) for cause in CAUSES}
    orders = list(permutations(CAUSES))
    for order in orders:
        steps = [frozenset(order[:k]) for k in range(len(order) + 1)]
        for cause, (before, after) in zip(order, pairwise(steps), strict=True):
            parts[cause] += (known[after] - known[before]) / len(orders)
    parts["neither"] = rests - known[frozenset(CAUSES)]
    return parts


def filmed(rng: np.random.Generator, states: Floats, *, throw: int, stone: int) -> Trajectory:
    """Return the track of a throw as from film: with white and correlated errors, and a hand before
    the line.

    Parameters
    ----------
    rng : source of the errors
    states : (m, 6) of one throw at every `STEP`
    throw, stone : its numbers
    """
    moving = np.flatnonzero(np.hypot(states[:, 2], states[:, 3]) > 0)
    states = states[: int(moving[-1]) + 2 + int(1.0 / STEP)] if len(moving) else states
    rest = np.repeat(states[-1:], max(0, int(1.0 / STEP)), axis=0)
    first = states[0]
    before = -np.arange(int(1.2 / STEP), 0, -1) * STEP
    held = np.column_stack(
        [first[0] + before * first[2], first[1] + before * first[3], np.zeros(len(before))]
    )
    path = np.concatenate([held, np.concatenate([states, rest])[:, [0, 1, 4]]])
    t = np.arange(len(path)) * STEP
    fade = np.exp(-STEP / 1.5)
    lasting = np.zeros((len(t), 3))
    lasting[0] = rng.standard_normal(3)
    kicks = (1 - fade**2) ** 0.5 * rng.standard_normal((len(t), 3))
    for k in range(1, len(t)):
        lasting[k] = fade * lasting[k - 1] + kicks[k]
    error = lasting * [0.0012, 0.0018, 0.02] + rng.standard_normal((len(t), 3)) * [
        0.0015,
        0.0015,
        0.02,
    ]
    seen = path + error
    return Trajectory(
        t=np.asarray(t, dtype=np.float64),
        xy=seen[:, :2],
        theta=seen[:, 2],
        throw=throw,
        stone=stone,
        clock=60.0 * throw,
        sigma_xy=np.full(len(t), 0.0022),
        sigma_theta=np.full(len(t), 0.03),
    )
