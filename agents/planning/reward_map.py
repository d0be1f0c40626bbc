"""Promising throws for a task, from a map of the reward over weight and line for each handle.

First a grid over weight and line is simulated in the batch engine among the resting stones. Blurred
by the player's execution errors, it shows expected rewards: a narrow peak sinks and a broad one
stays. Then clouds of throws around the best peaks contract (the cross-entropy method, which needs
no derivative: hits have none).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.ndimage import gaussian_filter, maximum_filter

from agents.planning.objective import Objective
from agents.planning.rollouts import (
    ANGLE,
    OFFSET,
    SPEED,
    SPIN,
    SWEEP,
    roll_out,
    roll_out_in_play,
)
from agents.planning.target_search import speed_range_to
from agents.planning.tuning import (
    CLOUD_ELITE,
    CLOUD_ROUNDS,
    CLOUD_SIZE,
    GRID_THROWS,
    MIN_BLUR,
    PEAKS_PER_HANDLE,
)
from curling_env.ice import Ice
from curling_env.physics.slides import NO_BOUNDS
from curling_env.sheet import to_delivery
from curling_env.throw import MAX_SPEED, Skill
from curling_env.typing import Floats

ExpectedValue = Callable[[Floats], Floats]
"""Expected value (m,) of throws (m, 6)."""


def reward_peaks(
    ice: Ice,
    objective: Objective,
    skill: Skill,
    handles: Floats,
    *,
    x: float = 0.0,
    grid_throws: int = GRID_THROWS,
) -> Floats:
    """Return promising throws (m, 6), the most promising first; see
    `curling_env.physics.batch.releases_of`.

    Parameters
    ----------
    ice : known or estimated ice
    objective : objective of the throw
    skill : player whose execution errors blur the map
    handles : (n, 3) spin, and start and end of the sweeping
    x : offset of the release, delivery frame [m]
    grid_throws : throws in the grid, over all handles
    """
    mark = np.asarray(to_delivery(objective.target, objective.direction))
    delivery = objective.delivery
    length = float(mark[1]) - delivery.start_y
    slowest, fastest = speed_range_to(ice, float(mark[1]), objective.direction, x, delivery)
    fastest = min(fastest * objective.max_weight, delivery.max_speed)
    # Steps of weight and line are equal in units of the player's errors.
    blur = np.maximum((skill.sigma_speed, skill.sigma_angle), MIN_BLUR)
    extent = np.array([fastest - slowest, 2 * objective.aim_margin / length])
    steps = extent / blur
    scale = np.sqrt(grid_throws / len(handles) / steps.prod())
    rows, lines = np.maximum(np.ceil(scale * steps).astype(int), 5)
    beside = np.linspace(-0.5, 0.5, lines) * extent[1]
    grid = np.zeros((len(handles), rows, lines, 6))
    grid[..., SPEED] = np.linspace(slowest, fastest, rows)[:, None]
    grid[..., SPIN] = handles[:, None, None, 0]
    grid[..., SWEEP:] = handles[:, None, None, 1:]
    grid[..., OFFSET] = x
    straight = grid[:, :, 0].reshape(-1, 6)
    drift = _drift(ice, objective, straight, length).reshape(len(handles), rows)
    grid[..., ANGLE] = np.arctan((drift - mark[0]) / length)[..., None] + beside
    ended = roll_out_in_play(
        ice, grid.reshape(-1, 6), objective.direction, objective.stones, delivery=delivery
    )
    value = objective.judge(ended, ice.stone.radius).value.reshape(grid.shape[:-1])
    cell = extent / (rows - 1, lines - 1)
    expected = gaussian_filter(value, (0.0, *(blur / cell)), mode="nearest", truncate=3.0)
    peaks = (expected == maximum_filter(expected, (1, 5, 5))) & np.isfinite(expected)
    chosen: list[tuple[float, tuple[int, ...]]] = []
    for handle in range(len(handles)):
        places = np.argwhere(peaks[handle])
        heights = expected[handle][tuple(places.T)]
        for k in np.argsort(-heights, kind="stable")[:PEAKS_PER_HANDLE]:
            chosen.append((-float(heights[k]), (handle, *places[k].tolist())))
    return np.array([grid[place] for _, place in sorted(chosen)])


def _drift(ice: Ice, objective: Objective, throws: Floats, length: float) -> Floats:
    """Return the crossings of straight throws at the target's height, or rests, to the right
    [m].
    """
    bounds = NO_BOUNDS.copy()
    direction, delivery = objective.direction, objective.delivery
    bounds[3 if direction > 0 else 2] = direction * (length - delivery.line_y)
    xy = roll_out(ice, throws, direction, bounds=bounds, delivery=delivery).xy
    return np.nan_to_num(direction * xy[:, 0])


def cross_entropy_search(
    starts: Floats,
    expected_value: ExpectedValue,
    skill: Skill,
    rng: np.random.Generator,
    *,
    vary_spin: bool = True,
    max_speed: float = MAX_SPEED,
) -> Floats:
    """Return better throws near given ones, (2 m, 6): the best of each cloud, and its last centre.

    Parameters
    ----------
    starts : (m, 6) throws around which the clouds begin
    expected_value : expected value of throws
    skill : player whose errors are the size of the first clouds
    vary_spin : let the spin change too
    max_speed : the fastest throw [m/s]
    """
    m = len(starts)
    least = (*MIN_BLUR, 0.1)
    size = np.maximum((skill.sigma_speed, skill.sigma_angle, 0.1), least) * [1.0, 1.0, vary_spin]
    sizes = np.broadcast_to(size, (m, 3)).copy()
    centres = starts.copy()
    best, height = starts.copy(), expected_value(starts)
    for _ in range(CLOUD_ROUNDS):
        cloud = np.repeat(centres[:, None, :], CLOUD_SIZE, axis=1)
        cloud[:, :, : SPIN + 1] += sizes[:, None] * rng.standard_normal((m, CLOUD_SIZE, 3))
        cloud[:, :, SPEED] = np.clip(cloud[:, :, SPEED], 1e-2, max_speed)
        heights = expected_value(cloud.reshape(-1, cloud.shape[2])).reshape(m, CLOUD_SIZE)
        order = np.argsort(-heights, axis=1, kind="stable")[:, :CLOUD_ELITE]
        elite = np.take_along_axis(cloud, order[:, :, None], axis=1)
        centres[:, : SPIN + 1] = elite[:, :, : SPIN + 1].mean(axis=1)
        sizes = np.maximum(elite[:, :, : SPIN + 1].std(axis=1), 0.1 * size)
        top = np.take_along_axis(heights, order[:, :1], axis=1)[:, 0]
        better = top > height
        best[better], height[better] = elite[better, 0], top[better]
    return np.concatenate([best, centres])
