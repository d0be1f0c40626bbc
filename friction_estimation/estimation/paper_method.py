"""The method of the paper: differentiate the tracks, then average per cell.

Distance over time gives speed, speed over time gives acceleration, and every acceleration gives a
μ = −a/g, which is averaged over all values that fall into a cell. Differences of neighbouring
frames would be far too noisy, so each derivative is that of a quadratic fitted to a window. The
method is kept as a baseline for the joint fit.

Source
------
The paper, sections 3 and 4.2; "the measurement is the average value of all values obtained".
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from curling_env.ice import FrictionMap, Ice
from curling_env.physics.motion import GRAVITY
from curling_env.trajectory import Trajectory
from curling_env.typing import Floats, Indices
from friction_estimation.estimation.estimate import Estimate
from friction_estimation.tracks.free_slide import FreeSlide, free_slides
from friction_estimation.tracks.smoothing import smooth_motion

_MIN_MU = 1e-4
"""Minimum average of a cell: noise can make single cells negative."""


def estimate_by_paper(
    tracks: Sequence[Trajectory], *, start: Ice | None = None, uniform: bool = False
) -> Estimate:
    """Estimate an ice by the method of the paper.

    Parameters
    ----------
    tracks : tracks of one session, in order of play
    start : sheet and stone; the paper's sheet by default
    uniform : whether one μ for the sheet is wanted instead of a map

    Raises
    ------
    TrackTooShortError : no throw has a free slide that is long enough
    """
    slides, skipped = free_slides(tracks)
    ice, mu, sigma = average_cells(slides, start or Ice.uniform(0.0082), uniform=uniform)
    return Estimate(
        ice=ice,
        method="paper",
        uniform=uniform,
        mu=mu,
        sigma=sigma,
        slides=tuple(slides),
        skipped=tuple(skipped),
    )


def average_cells(
    slides: Sequence[FreeSlide], start: Ice, *, uniform: bool = False, window: float = 1.0
) -> tuple[Ice, float, float]:
    """Friction per cell as the average of all values obtained in it.

    Parameters
    ----------
    slides : free slides of all throws
    start : sheet and stone; its effects are dropped from the result, this method knows none
    uniform : whether one μ is wanted instead of a map
    window : width of the windows in which a track is differentiated [s]

    Returns
    -------
    ice, average of all values, and its standard error
    """
    sheet = start.sheet
    rows, columns = sheet.shape
    values: list[Floats] = []
    cells: list[Indices] = []
    means, variances, spacing = [], [], []
    for slide in slides:
        motion = smooth_motion(slide.t, slide.xy, window=window, noise=slide.noise)
        # One-sided windows at the ends of a track give much noisier derivatives than centred ones.
        t = slide.t
        whole = (t >= t[0] + window / 2) & (t <= t[-1] - window / 2)
        whole = whole if whole.sum() >= 5 else np.ones(len(t), dtype=bool)
        mu = -motion.acceleration[whole] / GRAVITY
        row, column = sheet.cell_of(slide.xy[whole])
        values.append(mu)
        cells.append(row * columns + column)
        means.append(float(mu.mean()))
        # The average of a derivative is the difference of the speeds at both ends.
        ends = np.hypot(*motion.speed_sigma[whole][[0, -1]])
        variances.append(float(ends / (GRAVITY * np.ptp(t[whole]))) ** 2)
        spacing.append(float(np.median(np.diff(t))))
    pooled, place = np.concatenate(values), np.concatenate(cells)
    mean = float(pooled.mean())
    between = float(np.var(means, ddof=1)) if len(means) > 1 else 0.0
    sigma = float(np.sqrt(max(between, float(np.mean(variances))) / len(means)))
    if uniform:
        friction = FrictionMap.uniform(max(mean, _MIN_MU), sheet, sigma=sigma)
        ice = Ice(sheet=sheet, friction=friction, stone=start.stone)
        return ice, mean, sigma
    count = np.bincount(place, minlength=rows * columns)
    total = np.bincount(place, weights=pooled, minlength=rows * columns)
    observed = count > 0
    average = np.where(observed, total / np.maximum(count, 1), mean)
    spread = float(pooled.std())
    # Neighbouring values share their window, so only one value per window counts as independent.
    independent = np.maximum(count * float(np.median(spacing)) / window, 0.25)
    error = np.where(observed, spread / np.sqrt(independent), spread)
    friction = FrictionMap(
        mu=np.maximum(average, _MIN_MU).reshape(rows, columns),
        sigma=error.reshape(rows, columns),
        observed=observed.reshape(rows, columns),
        interpolation=start.friction.interpolation,
    )
    return replace(start, friction=friction, effects=()), mean, sigma
