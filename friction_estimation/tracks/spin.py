"""Spin of a thrown stone, from its measured heading."""

from __future__ import annotations

import numpy as np
from scipy.integrate import cumulative_trapezoid

from curling_env.typing import Floats
from friction_estimation.tracks.free_slide import FreeSlide
from friction_estimation.tracks.smoothing import smooth_motion
from friction_estimation.tracks.tuning import MIN_HEADINGS


def has_heading(slide: FreeSlide) -> bool:
    """Return whether the heading was measured often enough to estimate the spin."""
    return int(np.isfinite(slide.track.theta[slide.rows]).sum()) >= MIN_HEADINGS


def fit_spin(slide: FreeSlide) -> tuple[float, float, float, float]:
    """Return spin ω₀ and power p of ω = ω₀ (v/v₀)^p, with v₀ and the heading at the start.

    Returns
    -------
    ω₀ [rad/s], p, v₀ [m/s] and the heading [rad]; the spin is 0 if too few headings are known
    """
    motion = smooth_motion(slide.t, slide.xy, window=2.0)
    v0 = float(np.median(motion.speed[:10]))
    theta = slide.track.theta[slide.rows]
    known = np.isfinite(theta)
    if not has_heading(slide):
        return 0.0, 0.2, v0, 0.0
    ratio = np.maximum(motion.speed / v0, 1e-3)
    t = slide.t - slide.t[0]
    best = (np.inf, 0.0, 0.2, 0.0)
    for power in np.arange(0.0, 1.25, 0.1):
        rate = ratio**power
        turned = cumulative_trapezoid(rate, t, initial=0)
        basis = np.column_stack([np.ones_like(turned), turned])[known]
        coefficients, cost = _robust_line(basis, theta[known])
        if cost < best[0]:
            best = (cost, float(coefficients[1]), float(power), float(coefficients[0]))
    _, spin, power, heading = best
    return spin, power, v0, heading


def _robust_line(basis: Floats, values: Floats) -> tuple[Floats, float]:
    """Return least-squares coefficients with down-weighted outliers, and the sum of the
    residuals.
    """
    weights = np.ones(len(basis))
    coefficients: Floats = np.zeros(basis.shape[1])
    cost = np.inf
    for _ in range(4):
        rows, goal = basis * weights[:, None], values * weights
        coefficients = np.asarray(np.linalg.lstsq(rows, goal, rcond=None)[0], dtype=np.float64)
        residual = np.abs(values - basis @ coefficients)
        limit = 2.0 * max(1.4826 * float(np.median(residual)), 1e-4)
        weights = np.sqrt(np.minimum(1.0, limit / np.maximum(residual, 1e-12)))
        cost = float(np.minimum(residual, limit).sum())
    return coefficients, cost
