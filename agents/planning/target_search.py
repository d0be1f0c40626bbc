"""Search for throws that come to rest at a target on the empty sheet.

For each spin and kind of sweeping, a grid over possible weights and lines is simulated. The best
few throws are then corrected by Newton's method on (speed, angle) → rest, which is exact to a
fraction of a millimetre if the ice is smooth.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from agents.planning.rollouts import roll_out
from agents.planning.tuning import (
    GRID_HALF_WIDTH,
    GRID_LINES,
    GRID_SPEEDS,
    NEWTON_STARTS,
    NEWTON_TOLERANCE,
    REACHED,
    SPINS,
    SWEEPS,
)
from curling_env.errors import InputError
from curling_env.ice import Ice
from curling_env.sheet import BACK_LINE_Y, Direction
from curling_env.throw import FROM_HOG_LINE, Delivery
from curling_env.typing import Floats


@dataclass(frozen=True, kw_only=True)
class ThrowsToTarget:
    """Throws that come to rest at a target on the empty sheet.

    Parameters
    ----------
    throws : (n, 6), see `rollouts.releases_of`
    rest : (n, 2) place of rest of each, sheet frame [m]
    """

    throws: Floats
    rest: Floats


def direction_to(target: Floats) -> Direction:
    """Return the end played to for a target: its half of the sheet."""
    return Direction.AWAY if target[1] >= 0 else Direction.HOME


def check_target(ice: Ice, target: Floats) -> None:
    """Refuse a target at which no stone can rest in play.

    Raises
    ------
    InputError : the target is off the ice, touches a side line, or is wholly past the back line
    """
    x, y = (float(value) for value in target)
    place = f"({x:g}, {y:g}) m"
    if not (np.isfinite(x) and np.isfinite(y)):
        raise InputError(f"expected a target of two finite numbers, got {place}")
    half_width, radius = ice.sheet.width / 2, ice.stone.radius
    if not bool(ice.sheet.contains(target)):
        raise InputError(
            f"the target {place} is off the ice, which extends to x = ±{half_width:g} and "
            f"y = ±{ice.sheet.length / 2:g} m"
        )
    if abs(x) > half_width - radius:
        raise InputError(
            f"a stone at {place} touches the side line: x must be within ±{half_width - radius:g}"
        )
    if abs(y) > BACK_LINE_Y + radius:
        raise InputError(
            f"a stone at {place} is past the back line: y must be within "
            f"±{BACK_LINE_Y + radius:.3f} m"
        )


def handles_of(ice: Ice, spins: Sequence[float]) -> Floats:
    """Return spins and sweeping to try, (n, 3): spin, and start and end of the sweeping."""
    sweeps = SWEEPS if ice.effect("sweeping") else SWEEPS[:1]
    return np.array([(spin, *sweep) for sweep in sweeps for spin in dict.fromkeys(spins)])


def find_throws(
    ice: Ice,
    target: Floats,
    *,
    spins: Sequence[float] = SPINS,
    x: float = 0.0,
    delivery: Delivery = FROM_HOG_LINE,
) -> ThrowsToTarget:
    """Find throws that come to rest at a target on the empty sheet.

    Parameters
    ----------
    ice : known or estimated ice
    target : (2,) target, sheet frame [m]
    spins : spins to try [rad/s]
    x : offset of the release, delivery frame [m]
    delivery : start and maximum speed of throws

    Returns
    -------
    one or more throws within `REACHED` of the target, the nearest first for each spin and sweeping

    Raises
    ------
    InputError : no throw reaches it
    """
    direction = direction_to(target)
    start = np.array([direction * x, -direction * delivery.line_y])
    ahead = direction * (target - start)  # in the delivery frame: to the right, along play
    distance = float(np.hypot(*ahead))
    slowest, fastest = speed_range_to(ice, distance, direction, x, delivery)
    line = float(np.arctan2(-ahead[0], ahead[1]))
    widest = min(float(np.arctan2(GRID_HALF_WIDTH, ahead[1])), 0.4)
    handles = handles_of(ice, spins)
    speeds = np.linspace(slowest, fastest, GRID_SPEEDS)
    lines = np.linspace(-widest, widest, GRID_LINES)
    handle = np.tile(np.arange(len(handles)), GRID_SPEEDS * GRID_LINES)
    speed = np.repeat(speeds, GRID_LINES * len(handles))
    angle = np.tile(np.repeat(line + lines, len(handles)), GRID_SPEEDS)
    spin, *sweep = handles[handle].T
    grid = np.column_stack([speed, angle, spin, np.full(len(spin), x), *sweep])
    rest = roll_out(ice, grid, direction, delivery=delivery).xy
    miss = np.nan_to_num(np.hypot(*(rest - target).T), nan=np.inf)
    chosen = [
        index
        for value in range(len(handles))
        for index in np.flatnonzero(handle == value)[
            np.argsort(miss[handle == value])[:NEWTON_STARTS]
        ]
    ]
    throws, rest = _make_exact(ice, grid[chosen], target, direction, delivery)
    miss = np.hypot(*(rest - target).T)
    reached = miss <= REACHED
    if not reached.any():
        raise InputError(
            f"no throw found that comes to rest at ({target[0]:g}, {target[1]:g}) m on this ice; "
            f"the nearest ends {float(np.nanmin(miss)):.2f} m from it"
        )
    throws, rest = throws[reached], rest[reached]
    different = _different(throws)
    return ThrowsToTarget(throws=throws[different], rest=rest[different])


def speed_range_to(
    ice: Ice,
    distance: float,
    direction: Direction,
    x: float,
    delivery: Delivery = FROM_HOG_LINE,
) -> tuple[float, float]:
    """Return a speed that stops well short of a distance and one that goes well past it [m/s].

    Parameters
    ----------
    distance : distance from the line of release [m]
    direction : the end played to
    x : offset of the release, delivery frame [m]
    delivery : start and maximum speed of throws

    Raises
    ------
    InputError : no speed reaches the distance
    """
    most = delivery.max_speed
    speeds = np.concatenate([[1e-2, 5e-2, 0.1], np.arange(0.2, most + 1e-9, 0.1)])
    throws = np.column_stack([speeds, np.zeros((len(speeds), 2)), np.full(len(speeds), x)])
    lengths: list[float] = []
    for begin in range(0, len(speeds), 8):  # faster throws than needed are not simulated
        some = throws[begin : begin + 8]
        ends = roll_out(ice, some, direction, delivery=delivery).xy[:, 1]
        lengths += [direction * float(end) + delivery.line_y for end in ends]
        if any(length > 1.2 * distance or np.isnan(length) for length in lengths):
            break
    past = [k for k, length in enumerate(lengths) if not length <= 1.1 * distance]
    short = [k for k, length in enumerate(lengths) if length < 0.9 * distance]
    if not past and max(lengths) < distance:
        raise InputError(
            f"the target is out of reach: at {most:g} m/s a stone stops after "
            f"{max(lengths):.1f} m on this ice, and the target is {distance:.1f} m away"
        )
    fastest = speeds[past[0]] if past else most
    slowest = speeds[short[-1]] if short else 0.5 * speeds[0]
    return float(slowest), float(fastest)


def _make_exact(
    ice: Ice, throws: Floats, target: Floats, direction: Direction, delivery: Delivery
) -> tuple[Floats, Floats]:
    """Correct speed and angle of all throws until they rest at the target.

    Newton's method with a numerical derivative; a step that does not help is halved.

    Returns
    -------
    the corrected throws (n, 6), and their places of rest (n, 2) [m]
    """
    throws = throws.copy()
    rest = roll_out(ice, throws, direction, delivery=delivery).xy
    miss = np.nan_to_num(np.hypot(*(rest - target).T), nan=np.inf)
    step = np.zeros((len(throws), 2))
    damping = np.ones(len(throws))
    fresh = np.ones(len(throws), dtype=bool)  # throws that moved and need a new derivative
    for _ in range(20):
        busy = np.flatnonzero((miss > NEWTON_TOLERANCE) & np.isfinite(miss) & (damping > 1e-3))
        if not busy.size:
            break
        moved = busy[fresh[busy]]
        if moved.size:
            step[moved] = _newton_step(ice, throws[moved], rest[moved], target, direction, delivery)
            fresh[moved] = False
        trial = throws[busy].copy()
        trial[:, :2] += damping[busy, None] * step[busy]
        trial[:, 0] = np.clip(trial[:, 0], 1e-3, delivery.max_speed)
        ends = roll_out(ice, trial, direction, delivery=delivery).xy
        trial_miss = np.nan_to_num(np.hypot(*(ends - target).T), nan=np.inf)
        better = trial_miss < miss[busy]
        kept = busy[better]
        throws[kept], rest[kept], miss[kept] = trial[better], ends[better], trial_miss[better]
        fresh[kept], damping[kept] = True, 1.0
        damping[busy[~better]] *= 0.5
    return throws, rest


def _newton_step(
    ice: Ice,
    throws: Floats,
    rest: Floats,
    target: Floats,
    direction: Direction,
    delivery: Delivery,
) -> Floats:
    """Return the first-order change of (speed, angle) that brings each rest to the target, (n,
    2).
    """
    columns: list[Floats] = []
    for k, change in enumerate((1e-4, 1e-5)):
        nudged = throws.copy()
        nudged[:, k] += change
        there = roll_out(ice, nudged, direction, delivery=delivery).xy
        columns.append((there - rest) / change)
    jacobian = np.stack(columns, axis=2)
    determinant = np.linalg.det(jacobian)
    singular = ~(np.abs(determinant) > 1e-9)
    jacobian[singular] = np.eye(2)
    step = np.linalg.solve(jacobian, (target - rest)[:, :, None])[:, :, 0]
    step[singular] = 0.0
    # Far from the target the derivative is unreliable, so steps are limited.
    limits = np.column_stack([0.2 * throws[:, 0], np.full(len(throws), 0.1)])
    return step / np.maximum(1.0, np.max(np.abs(step) / limits, axis=1))[:, None]


def _different(throws: Floats) -> list[int]:
    """Return the indices of throws that differ from every throw listed before."""
    alike = [2e-3, 5e-4, 1e-3, 1.0, 0.1, 0.1]
    kept: list[int] = []
    for i, throw in enumerate(throws):
        if all(np.abs((throws[k] - throw) / alike).max() > 1 for k in kept):
            kept.append(i)
    return kept
