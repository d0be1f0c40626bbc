"""The search for throws that come to rest at a target.

First broad, then fine. For each spin and way of sweeping, throws over the range of weights and
lines that could get there are simulated; the best few are then corrected by Newton's method on
(speed, angle) → rest, which lands within a fraction of a millimetre wherever the ice is smooth.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from agents.planning.rollouts import roll_out
from curling_env.errors import InputError
from curling_env.ice import Ice
from curling_env.sheet import BACK_LINE_Y, HOG_LINE_Y, Direction
from curling_env.throw import MAX_SPEED
from curling_env.typing import Floats

SPINS = (1.0, -1.0, 0.8, -0.8, 1.3, -1.3, 0.5, -0.5, 1.6, -1.6)
"""Spins tried [rad/s], the usual one first: one to five turns on a draw's way, both handles."""

SWEEPS = ((0.0, 0.0), (0.0, 60.0), (8.0, 60.0))
"""Sweeping that is tried where the ice knows what it does: never, all the way, late [s]."""

WEIGHTS, LINES = 13, 9
"""Grid of the broad search for each spin."""
SIDEWAYS = 3.0
"""How far to each side of the target the broad search aims [m]: a draw curls 1-2 m."""
STARTS = 3
"""Throws of the grid, for each spin, that are made exact."""
CLOSE_ENOUGH = 1e-4
"""Distance from the target at which Newton's method stops [m]."""
REACHED = 5e-3
"""Distance from the target within which a throw is said to get there [m]."""
MAX_CORRECTIONS = 20


@dataclass(frozen=True, kw_only=True)
class Candidates:
    """Throws that come to rest at the target on an empty sheet.

    Parameters
    ----------
    throws : (n, 6) see `rollouts.releases_of`
    rest : (n, 2) where they rest, sheet frame [m]
    """

    throws: Floats
    rest: Floats


def direction_to(target: Floats) -> Direction:
    """The end that a target is played from the other: its own half of the sheet."""
    return Direction.AWAY if target[1] >= 0 else Direction.HOME


def check_target(ice: Ice, target: Floats) -> None:
    """Refuse a target at which no stone can lie in play.

    Raises
    ------
    InputError : the target is off the ice, touches a side line, or is wholly past the back line
    """
    x, y = (float(value) for value in target)
    place = f"({x:g}, {y:g}) m"
    if not (np.isfinite(x) and np.isfinite(y)):
        raise InputError(f"a target is two finite numbers, got {place}")
    half_width, radius = ice.sheet.width / 2, ice.stone.radius
    if not bool(ice.sheet.contains(target)):
        raise InputError(
            f"the target {place} is off the ice, which reaches to x = ±{half_width:g} and "
            f"y = ±{ice.sheet.length / 2:g} m"
        )
    if abs(x) > half_width - radius:
        raise InputError(
            f"a stone at {place} touches the side line: x must lie within ±{half_width - radius:g}"
        )
    if abs(y) > BACK_LINE_Y + radius:
        raise InputError(
            f"a stone at {place} is past the back line: y must lie within "
            f"±{BACK_LINE_Y + radius:.3f} m"
        )


def ways_of(ice: Ice, spins: Sequence[float]) -> Floats:
    """Handles and ways of sweeping to try, (n, 3): spin, sweep from and to."""
    sweeps = SWEEPS if ice.effect("sweeping") else SWEEPS[:1]
    return np.array([(spin, *sweep) for sweep in sweeps for spin in dict.fromkeys(spins)])


def find_throws(
    ice: Ice, target: Floats, *, spins: Sequence[float] = SPINS, x: float = 0.0
) -> Candidates:
    """All throws found that come to rest at a target on the empty sheet.

    Parameters
    ----------
    ice : known ice
    target : (2,) sheet frame [m]
    spins : to try [rad/s]
    x : offset of the release at the hog line, delivery frame [m]

    Returns
    -------
    one or more throws within `REACHED` of the target, nearest first for each spin and sweeping

    Raises
    ------
    InputError : no throw gets there
    """
    direction = direction_to(target)
    start = np.array([direction * x, -direction * HOG_LINE_Y])
    ahead = direction * (target - start)  # in the delivery frame: to the right, along play
    slowest, fastest = weights_to(ice, float(np.hypot(*ahead)), direction, x)
    line = float(np.arctan2(-ahead[0], ahead[1]))
    widest = min(float(np.arctan2(SIDEWAYS, ahead[1])), 0.4)
    ways = ways_of(ice, spins)
    weights, lines = np.linspace(slowest, fastest, WEIGHTS), np.linspace(-widest, widest, LINES)
    way = np.tile(np.arange(len(ways)), WEIGHTS * LINES)
    speed = np.repeat(weights, LINES * len(ways))
    angle = np.tile(np.repeat(line + lines, len(ways)), WEIGHTS)
    spin, *sweep = ways[way].T
    grid = np.column_stack([speed, angle, spin, np.full(len(spin), x), *sweep])
    rest = roll_out(ice, grid, direction).xy
    miss = np.nan_to_num(np.hypot(*(rest - target).T), nan=np.inf)
    chosen = [
        index
        for value in range(len(ways))
        for index in np.flatnonzero(way == value)[np.argsort(miss[way == value])[:STARTS]]
    ]
    throws, rest = _make_exact(ice, grid[chosen], target, direction)
    miss = np.hypot(*(rest - target).T)
    reached = miss <= REACHED
    if not reached.any():
        raise InputError(
            f"no throw found that comes to rest at ({target[0]:g}, {target[1]:g}) m on this ice; "
            f"the nearest ends {float(np.nanmin(miss)):.2f} m from it"
        )
    throws, rest = throws[reached], rest[reached]
    different = _different(throws)
    return Candidates(throws=throws[different], rest=rest[different])


def weights_to(ice: Ice, distance: float, direction: Direction, x: float) -> tuple[float, float]:
    """Speeds between which a throw goes from well short of a distance to well past it [m/s]."""
    speeds = np.concatenate([[1e-2, 5e-2, 0.1], np.arange(0.2, MAX_SPEED + 1e-9, 0.1)])
    throws = np.column_stack([speeds, np.zeros((len(speeds), 2)), np.full(len(speeds), x)])
    lengths: list[float] = []
    for begin in range(0, len(speeds), 8):  # no need to throw faster than past the target
        ends = roll_out(ice, throws[begin : begin + 8], direction).xy[:, 1]
        lengths += [direction * float(end) + HOG_LINE_Y for end in ends]
        if any(length > 1.2 * distance or np.isnan(length) for length in lengths):
            break
    past = [k for k, length in enumerate(lengths) if not length <= 1.1 * distance]
    short = [k for k, length in enumerate(lengths) if length < 0.9 * distance]
    if not past and max(lengths) < distance:
        raise InputError(
            f"the target is out of reach: at {MAX_SPEED:g} m/s a stone stops after "
            f"{max(lengths):.1f} m on this ice, and the target is {distance:.1f} m away"
        )
    fastest = speeds[past[0]] if past else MAX_SPEED
    slowest = speeds[short[-1]] if short else 0.5 * speeds[0]
    return float(slowest), float(fastest)


def _make_exact(
    ice: Ice, throws: Floats, target: Floats, direction: Direction
) -> tuple[Floats, Floats]:
    """Correct speed and angle of each throw until it rests at the target, all at once.

    Newton's method with a derivative by differences; a step that does not help is halved.
    """
    throws = throws.copy()
    rest = roll_out(ice, throws, direction).xy
    miss = np.nan_to_num(np.hypot(*(rest - target).T), nan=np.inf)
    step = np.zeros((len(throws), 2))
    damping = np.ones(len(throws))
    fresh = np.ones(len(throws), dtype=bool)  # throws that moved and need a new derivative
    for _ in range(MAX_CORRECTIONS):
        busy = np.flatnonzero((miss > CLOSE_ENOUGH) & np.isfinite(miss) & (damping > 1e-3))
        if not busy.size:
            break
        moved = busy[fresh[busy]]
        if moved.size:
            step[moved] = _newton_step(ice, throws[moved], rest[moved], target, direction)
            fresh[moved] = False
        trial = throws[busy].copy()
        trial[:, :2] += damping[busy, None] * step[busy]
        trial[:, 0] = np.clip(trial[:, 0], 1e-3, MAX_SPEED)
        ends = roll_out(ice, trial, direction).xy
        trial_miss = np.nan_to_num(np.hypot(*(ends - target).T), nan=np.inf)
        better = trial_miss < miss[busy]
        kept = busy[better]
        throws[kept], rest[kept], miss[kept] = trial[better], ends[better], trial_miss[better]
        fresh[kept], damping[kept] = True, 1.0
        damping[busy[~better]] *= 0.5
    return throws, rest


def _newton_step(
    ice: Ice, throws: Floats, rest: Floats, target: Floats, direction: Direction
) -> Floats:
    """Change of (speed, angle) that brings each rest to the target, to first order (n, 2)."""
    small = (1e-4, 1e-5)
    columns: list[Floats] = []
    for k, change in enumerate(small):
        nudged = throws.copy()
        nudged[:, k] += change
        columns.append((roll_out(ice, nudged, direction).xy - rest) / change)
    jacobian = np.stack(columns, axis=2)
    determinant = np.linalg.det(jacobian)
    singular = ~(np.abs(determinant) > 1e-9)
    jacobian[singular] = np.eye(2)
    step = np.linalg.solve(jacobian, (target - rest)[:, :, None])[:, :, 0]
    step[singular] = 0.0
    # Far from the target the derivative promises too much.
    limits = np.column_stack([0.2 * throws[:, 0], np.full(len(throws), 0.1)])
    return step / np.maximum(1.0, np.max(np.abs(step) / limits, axis=1))[:, None]


def _different(throws: Floats) -> list[int]:
    """Indices of throws that are not, within a hair, one listed before."""
    kept: list[int] = []
    for i, throw in enumerate(throws):
        if all(
            np.abs((throws[k] - throw) / [2e-3, 5e-4, 1e-3, 1.0, 0.1, 0.1]).max() > 1 for k in kept
        ):
            kept.append(i)
    return kept
