"""The landscape of a shot: what every weight and every line would be worth, for each handle.

First a grid over weight and line, played out in the batch engine among the stones that lie there.
Blurred by the errors of the hand, its heights are expectations: a narrow peak sinks and a broad one
stays, so that the throw that forgives stands out before any trial is repeated. Then clouds of
throws about the best peaks contract, trials repeated with the same errors for all (the
cross-entropy method; no derivative, for hits have none).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.ndimage import gaussian_filter, maximum_filter

from agents.planning.monte_carlo import end_in_play
from agents.planning.objective import Wanted
from agents.planning.rollouts import ANGLE, EVERYWHERE, OFFSET, SPEED, SPIN, SWEEP, roll_out
from agents.planning.target_search import weights_to
from curling_env.ice import Ice
from curling_env.sheet import HOG_LINE_Y, TEE_Y, to_delivery
from curling_env.throw import MAX_SPEED, SKILLS, Skill
from curling_env.typing import Floats

Worth = Callable[[Floats], Floats]
"""Expected worth (m,) of throws (m, 6)."""

CANDIDATES = 30_000
"""Throws of the grid, of all handles together."""
PEAKS = 2
"""Kept of each handle."""
STARTS = 6
"""Peaks about which a cloud contracts."""
CLOUD, BEST, ROUNDS = 16, 4, 4
"""Throws in a cloud, those of them that make the next one, and how often."""
LEAST_ERROR = SKILLS["elite"].sigma_speed / 4, SKILLS["elite"].sigma_angle / 4
"""Blur for a hand that never errs: of two throws that both do, the one in the middle [m/s, rad]."""


def survey(
    ice: Ice,
    wanted: Wanted,
    skill: Skill,
    ways: Floats,
    *,
    x: float = 0.0,
    candidates: int = CANDIDATES,
) -> Floats:
    """Promising throws (m, 6), most promising first; see `rollouts.releases_of`.

    Parameters
    ----------
    ice : thrown on
    wanted : of the throw
    skill : whose errors blur the landscape
    ways : (n, 3) spin, sweep from and to
    x : offset of the release at the hog line, delivery frame [m]
    candidates : throws of the grid
    """
    mark = np.asarray(to_delivery(wanted.target, wanted.direction))
    length = HOG_LINE_Y + TEE_Y + float(mark[1])
    slowest, fastest = weights_to(ice, length, wanted.direction, x)
    fastest = min(fastest * wanted.hardest, MAX_SPEED)
    # As many steps of weight as of line, counted in errors of the hand.
    blur = np.maximum((skill.sigma_speed, skill.sigma_angle), LEAST_ERROR)
    extent = np.array([fastest - slowest, 2 * wanted.aside / length])
    steps = extent / blur
    scale = np.sqrt(candidates / len(ways) / steps.prod())
    rows, lines = np.maximum(np.ceil(scale * steps).astype(int), 5)
    speeds = np.linspace(slowest, fastest, rows)
    beside = np.linspace(-0.5, 0.5, lines) * extent[1]
    grid = np.zeros((len(ways), rows, lines, 6))
    grid[..., SPEED] = speeds[:, None]
    grid[..., SPIN] = ways[:, None, None, 0]
    grid[..., SWEEP:] = ways[:, None, None, 1:]
    grid[..., OFFSET] = x
    drift = _drift(ice, wanted, grid[:, :, 0].reshape(-1, 6), length).reshape(len(ways), rows)
    grid[..., ANGLE] = np.arctan((drift - mark[0]) / length)[..., None] + beside
    ended = end_in_play(ice, grid.reshape(-1, 6), wanted.direction, wanted.stones)
    worth = wanted.judge(ended, ice.stone.radius).worth.reshape(grid.shape[:-1])
    cell = extent / (rows - 1, lines - 1)
    expected = gaussian_filter(worth, (0.0, *(blur / cell)), mode="nearest", truncate=3.0)
    peaks = (expected == maximum_filter(expected, (1, 5, 5))) & np.isfinite(expected)
    chosen: list[tuple[float, tuple[int, ...]]] = []
    for way in range(len(ways)):
        places = np.argwhere(peaks[way])
        heights = expected[way][tuple(places.T)]
        for k in np.argsort(-heights, kind="stable")[:PEAKS]:
            chosen.append((-float(heights[k]), (way, *places[k].tolist())))
    return np.array([grid[place] for _, place in sorted(chosen)])


def _drift(ice: Ice, wanted: Wanted, throws: Floats, length: float) -> Floats:
    """Where straight throws cross the target's height or rest, to the right of the centre [m]."""
    bounds = EVERYWHERE.copy()
    bounds[3 if wanted.direction > 0 else 2] = wanted.direction * (length - HOG_LINE_Y)
    xy = roll_out(ice, throws, wanted.direction, bounds=bounds).xy
    return np.nan_to_num(wanted.direction * xy[:, 0])


def contract(
    starts: Floats, worth: Worth, skill: Skill, rng: np.random.Generator, *, turns: bool = True
) -> Floats:
    """Better throws (m, 6) near given ones.

    Parameters
    ----------
    starts : (m, 6)
    worth : expected worth of throws
    skill : its errors are the first clouds' size
    turns : whether the spin may change too
    """
    m = len(starts)
    least = (*LEAST_ERROR, 0.1)
    size = np.maximum((skill.sigma_speed, skill.sigma_angle, 0.1), least) * [1.0, 1.0, turns]
    sizes = np.broadcast_to(size, (m, 3)).copy()
    centres = starts.copy()
    best, height = starts.copy(), worth(starts)
    for _ in range(ROUNDS):
        cloud = np.repeat(centres[:, None, :], CLOUD, axis=1)
        cloud[:, :, : SPIN + 1] += sizes[:, None] * rng.standard_normal((m, CLOUD, 3))
        cloud[:, :, SPEED] = np.clip(cloud[:, :, SPEED], 1e-2, MAX_SPEED)
        heights = worth(cloud.reshape(-1, cloud.shape[2])).reshape(m, CLOUD)
        order = np.argsort(-heights, axis=1, kind="stable")[:, :BEST]
        elite = np.take_along_axis(cloud, order[:, :, None], axis=1)
        centres[:, : SPIN + 1] = elite[:, :, : SPIN + 1].mean(axis=1)
        sizes = np.maximum(elite[:, :, : SPIN + 1].std(axis=1), 0.1 * size)
        top = np.take_along_axis(heights, order[:, :1], axis=1)[:, 0]
        better = top > height
        best[better], height[better] = elite[better, 0], top[better]
    return np.concatenate([best, centres])
