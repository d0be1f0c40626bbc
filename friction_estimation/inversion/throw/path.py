"""The path of a stone: the line it followed over the ice, and how far along it was at each time.

Friction acts along the travel. Curl, a slope across the sheet or a nudge act across it and turn
the travel without slowing it. So the estimator takes the line itself from the measurement, like
the wire of a bead, and explains only the distance along it. No model of the sideways forces is
used, and none can bias the friction.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.interpolate import BSpline

from curling_env.typing import Floats
from friction_estimation.inversion.tuning import PATH_KNOT_SPACING
from friction_estimation.tracks.free_slide import FreeSlide
from friction_estimation.tracks.outliers import robust_deviation

PATH_STEP = 0.05
"""Distance between the tabulated points of a path [m]; straight chords err by 0.02 mm at most."""
_MARGIN = 1.5
"""How far a path continues beyond the first and the last sample [m]."""


@dataclass(frozen=True, kw_only=True)
class StonePath:
    """A smooth line over the ice, tabulated by the distance along it.

    Parameters
    ----------
    origin : distance of the first tabulated point [m]; 0 is at the first sample
    points : (k, 2) points in the sheet frame, one every `PATH_STEP` metres of distance [m]
    heading : (k, 2) unit vectors of travel
    """

    origin: float
    points: Floats
    heading: Floats

    def at(self, distance: Floats) -> Floats:
        """Points of the sheet at distances along the path, (n, 2) [m]."""
        place = (distance - self.origin) / PATH_STEP
        index = np.arange(len(self.points))
        return np.column_stack([np.interp(place, index, self.points[:, k]) for k in range(2)])

    def heading_at(self, distance: Floats) -> Floats:
        """Unit vectors of travel at distances along the path, (n, 2)."""
        nearest = np.rint((distance - self.origin) / PATH_STEP).astype(int)
        return self.heading[np.clip(nearest, 0, len(self.heading) - 1)]


def fit_path(slide: FreeSlide) -> tuple[StonePath, Floats]:
    """The line that a free slide followed, and the measured distance along it.

    Parameters
    ----------
    slide : free slide of one track

    Returns
    -------
    path : the line, a robustly fitted cubic spline over the chord
    distance : (n,) distance along the path of the point nearest to each row [m]
    """
    xy = slide.xy
    first, last = np.median(xy[:5], axis=0), np.median(xy[-5:], axis=0)
    chord = (last - first) / np.hypot(*(last - first))
    across = np.array([-chord[1], chord[0]])
    u, w = (xy - first) @ chord, (xy - first) @ across
    line = _smooth_line(u, w)
    low, high = float(u.min()), float(u.max())

    def offset(at: Floats, derivative: int = 0) -> Floats:
        inside = np.clip(at, low, high)
        if derivative:
            return line(inside, 1)
        return line(inside) + (at - inside) * line(inside, 1)

    grid = np.arange(low - _MARGIN, high + _MARGIN + PATH_STEP, PATH_STEP / 2)
    steps = np.hypot(np.diff(grid), np.diff(offset(grid)))
    length = np.concatenate([[0.0], np.cumsum(steps)])
    length -= np.interp(u[0], grid, length)
    # One step along the tangent finds the nearest point well enough for errors of millimetres.
    slope = offset(u, 1)
    foot = u + (w - offset(u)) * slope / (1 + slope**2)
    table = np.arange(length[0], length[-1], PATH_STEP)
    at = np.interp(table, length, grid)
    slope = offset(at, 1)
    along = np.column_stack([np.ones_like(slope), slope]) / np.hypot(1, slope)[:, None]
    path = StonePath(
        origin=float(table[0]),
        points=first + at[:, None] * chord + offset(at)[:, None] * across,
        heading=along[:, :1] * chord + along[:, 1:] * across,
    )
    return path, np.interp(foot, grid, length)


def _smooth_line(u: Floats, w: Floats) -> Any:
    """Robust least-squares spline w(u) with a weak preference for straightness."""
    low, high = float(u.min()), float(u.max())
    spans = max(1, int((high - low) / PATH_KNOT_SPACING))
    inner = np.linspace(low, high, spans + 1)
    knots = np.concatenate([[low] * 3, inner, [high] * 3])
    basis = BSpline.design_matrix(np.clip(u, low, high), knots, 3).toarray()
    # Third differences bridge stretches without samples; they are too weak to bend anything else.
    count = basis.shape[1]
    bridge = 1e-2 * np.diff(np.eye(count), 3, axis=0) if count > 3 else np.zeros((0, count))
    weights = np.ones_like(u)
    coefficients = np.zeros(count)
    for _ in range(5):
        rows = np.vstack([basis * weights[:, None], bridge])
        goal = np.concatenate([w * weights, np.zeros(len(bridge))])
        coefficients = np.linalg.lstsq(rows, goal, rcond=None)[0]
        residual = w - basis @ coefficients
        limit = 2.0 * max(robust_deviation(residual), 1e-6)
        weights = np.sqrt(np.minimum(1.0, limit / np.maximum(np.abs(residual), 1e-12)))
    return BSpline(knots, coefficients, 3)
