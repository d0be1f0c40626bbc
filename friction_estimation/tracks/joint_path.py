"""Smooth path through several cameras' tracks of a throw, with their clocks and offsets.

The path is a cubic spline in time for each coordinate. Its smoothness is that of a sliding stone:
the jerk is white noise of small spectral density while the stone slides freely, and of a large one
while it is pushed or stopped. The density of the free slide is chosen by evidence.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import BSpline
from scipy.linalg import block_diag

from curling_env.errors import TrackTooShortError
from curling_env.sheet import HOG_LINE_Y
from curling_env.trajectory import Trajectory
from curling_env.typing import Floats
from friction_estimation.tracks.free_slide import free_slide
from friction_estimation.tracks.tuning import (
    JOIN_KNOT_STEP,
    JOIN_ROWS_PER_SECOND,
    MIN_ROW_SIGMA,
    PUSHED_JERK,
    SLIDING_JERKS,
    UNKNOWN_ROW_SIGMA,
)

_ROUNDS = 8
"""Number of Gauss-Newton iterations."""


@dataclass(frozen=True, kw_only=True, eq=False)
class JointPath:
    """Path of a stone seen by c cameras.

    Parameters
    ----------
    knots : knots of the spline [s]
    coefficients : (m, 2) coefficients of x and y [m]
    covariance : covariance of all unknowns: x, y, displacements, clocks
    offset, offset_sigma : (c,) offset added to the times of each camera, and its standard error [s]
    displacement : (c, 2) displacement of each camera's positions [m]
    """

    knots: Floats
    coefficients: Floats
    covariance: Floats
    offset: Floats
    offset_sigma: Floats
    displacement: Floats

    def at(self, t: Floats) -> Floats:
        """Return positions at times, (n, 2) [m]."""
        return _spline_basis(self.knots, t) @ self.coefficients

    def sigma(self, t: Floats) -> Floats:
        """Return the standard error of one coordinate at times, (n,) [m]."""
        basis = _spline_basis(self.knots, t)
        m = basis.shape[1]
        variance = sum(
            np.einsum("ni,ij,nj->n", basis, self.covariance[s : s + m, s : s + m], basis)
            for s in (0, m)
        )
        return np.sqrt(np.asarray(variance) / 2)


def fit_joint_path(chain: Sequence[Trajectory], offset: Floats) -> JointPath:
    """Fit path, clocks and displacements together.

    Parameters
    ----------
    chain : tracks of one throw, in the order in which the cameras saw the stone
    offset : (c,) first guess of the offset added to the times of each camera [s]
    """
    tried = (_fit(chain, offset, jerk) for jerk in SLIDING_JERKS)
    return max(tried, key=lambda fit: fit[0])[1]


def thinned_rows(track: Trajectory) -> tuple[Floats, Floats, Floats]:
    """Return times [s], positions [m] and standard errors [m] of the rows to use."""
    every = max(1, round(len(track) / max(track.duration * JOIN_ROWS_PER_SECOND, 1.0)))
    sigma = track.sigma_xy if track.sigma_xy.size else np.full(len(track), UNKNOWN_ROW_SIGMA)
    return track.t[::every], track.xy[::every], np.maximum(sigma[::every], MIN_ROW_SIGMA)


def passing_times(
    track: Trajectory, direction: float, along: ArrayLike, *, beyond: float | None = None
) -> Floats:
    """Return the times at which a stone first passes places along the sheet [s].

    Parameters
    ----------
    track : track of the stone
    direction : 1 for travel towards positive y, −1 towards negative y
    along : places, as direction times y [m]
    beyond : time of a place that the track does not show; its first or last one by default [s]
    """
    forward = np.maximum.accumulate(direction * track.xy[:, 1])
    rising = np.concatenate([[True], np.diff(forward) > 0])
    places, times = forward[rising], track.t[rising]
    return np.asarray(np.interp(np.asarray(along), places, times, left=beyond, right=beyond))


def _fit(chain: Sequence[Trajectory], offset: Floats, jerk: float) -> tuple[float, JointPath]:
    """Return the logarithm of the evidence, and the path, with one density of the jerk.

    Gauss-Newton iterations; the unknowns are x, y, displacements and clocks.
    """
    rows = [thinned_rows(track) for track in chain]
    first = min(t[0] + tau for (t, _, _), tau in zip(rows, offset, strict=True))
    last = max(t[-1] + tau for (t, _, _), tau in zip(rows, offset, strict=True))
    count = int(np.ceil((last - first + 2.0) / JOIN_KNOT_STEP)) + 1
    knots = first - 1.0 + JOIN_KNOT_STEP * np.arange(-3, count + 3)
    m, cameras = len(knots) - 4, len(chain)
    size = 2 * m + 3 * cameras
    moved, clocks = slice(2 * m, 2 * m + 2 * cameras), slice(2 * m + 2 * cameras, size)
    start, stop = _free_interval(chain, offset)
    between = knots[3:-4] + JOIN_KNOT_STEP / 2
    free = (between > start) & (between < stop)
    # The third derivative of a cubic spline is constant between knots, like white jerk.
    roughness = _spline_basis(knots, between, 3) * np.sqrt(JOIN_KNOT_STEP)
    roughness /= np.where(free, jerk, PUSHED_JERK)[:, None]
    spread = np.repeat([float(np.median(sigma)) for _, _, sigma in rows], 2)
    found = np.zeros(size)
    found[clocks] = offset
    normal, misfit = np.eye(size), 0.0
    for number in range(_ROUNDS):
        # The first clock is the common one; the others are free within seconds.
        held = np.full(cameras, 0.1 if number else 1e6)
        held[0] = 1e6
        priors = roughness, roughness, np.diag(1 / spread), np.diag(held)
        prior = np.asarray(block_diag(*priors), dtype=np.float64)
        designs, targets, logs = [prior], [prior[:, clocks] @ found[clocks]], 0.0
        for k, (t, xy, sigma) in enumerate(rows):
            clock = found[clocks][k]
            basis, rate = _spline_basis(knots, t + clock), _spline_basis(knots, t + clock, 1)
            for axis in range(2):
                own = slice(axis * m, (axis + 1) * m)
                design = np.zeros((len(t), size))
                design[:, own] = basis
                design[:, moved.start + 2 * k + axis] = 1.0
                residual = xy[:, axis] - design @ found
                if k and number:  # before the first iteration there is no path for the rate
                    design[:, clocks.start + k] = rate @ found[own]
                robust = 1 / (1 + (residual / (4 * sigma)) ** 2) if number > 5 else np.ones(len(t))
                weight = np.sqrt(robust) / sigma
                designs.append(weight[:, None] * design)
                targets.append(weight * (xy[:, axis] + design[:, clocks] @ found[clocks]))
                logs -= 2 * float(np.log(weight).sum())
        design, target = np.concatenate(designs), np.concatenate(targets)
        normal = design.T @ design
        ridge = 1e-12 * np.trace(normal) / size * np.eye(size)
        found = np.linalg.solve(normal + ridge, design.T @ target)
        misfit = float(((target - design @ found) ** 2).sum()) + logs
    covariance: Floats = np.asarray(np.linalg.inv(normal), dtype=np.float64)
    # Only terms that depend on the jerk matter; each free interval between knots has one.
    evidence = -0.5 * (misfit + np.linalg.slogdet(normal)[1])
    evidence -= 2 * float(np.sum(free)) * np.log(jerk)
    sigma = np.sqrt(np.maximum(np.diag(covariance)[clocks], 0.0))
    sigma[0] = 0.0
    return evidence, JointPath(
        knots=knots,
        coefficients=found[: 2 * m].reshape(2, m).T,
        covariance=covariance,
        offset=found[clocks],
        offset_sigma=sigma,
        displacement=found[moved].reshape(cameras, 2),
    )


def _spline_basis(knots: Floats, t: Floats, derivative: int = 0) -> Floats:
    """Return B-splines (n, m) at times, or a derivative of them; constant beyond the ends."""
    t = np.clip(t, knots[3], knots[-4])
    if not derivative:
        return BSpline.design_matrix(t, knots, 3).toarray()
    m = len(knots) - 4
    return np.asarray(BSpline(knots, np.eye(m), 3).derivative(derivative)(t))


def _free_interval(chain: Sequence[Trajectory], offset: Floats) -> tuple[float, float]:
    """Return the interval from release to rest according to the tracks, on the common clock [s].

    Before the delivery hog line a hand may still hold the stone, so that part does not count as
    free.
    """
    start, stop = -np.inf, np.inf
    first = chain[0]
    direction = 1.0 if chain[-1].xy[-1, 1] > first.xy[0, 1] else -1.0
    if direction * first.xy[0, 1] < -HOG_LINE_Y < direction * first.xy[-1, 1]:
        start = float(passing_times(first, direction, -HOG_LINE_Y)) + float(offset[0])
    for k, track in enumerate(chain):
        try:
            slide = free_slide(track)
        except TrackTooShortError:
            continue
        if k == 0:
            start = max(start, float(slide.t[0] + offset[k]))
        if k == len(chain) - 1:
            stop = float(slide.t[-1] + offset[k])
    return start, stop
