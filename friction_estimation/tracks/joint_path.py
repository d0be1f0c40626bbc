"""Smooth path through several cameras' tracks of a throw, with their clocks and offsets.

The path is a cubic spline in time for each coordinate. Its smoothness is that of a sliding stone:
the jerk is white noise of small spectral density while the stone slides freely, and of a large one
while it is pushed or stopped. The density of the free slide is chosen by evidence.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import BSpline

from curling_env.errors import TrackTooShortError
from curling_env.sheet import HOG_LINE_Y
from curling_env.trajectory import Trajectory
from curling_env.typing import Flags, Floats
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

    def velocity(self, t: Floats) -> Floats:
        """Return velocities at times, (n, 2) [m/s]."""
        return _spline_basis(self.knots, t, 1) @ self.coefficients

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
    best: tuple[float, JointPath] | None = None
    for jerk in SLIDING_JERKS:
        evidence, path = _Fit(chain, offset, jerk).solve()
        if best is None or evidence > best[0]:
            best = evidence, path
    assert best is not None
    return best[1]


def thinned_rows(track: Trajectory) -> tuple[Floats, Floats, Floats]:
    """Return times [s], positions [m] and standard errors [m] of the rows to use."""
    every = max(1, round(len(track) / max(track.duration * JOIN_ROWS_PER_SECOND, 1.0)))
    sigma = track.sigma_xy if track.sigma_xy.size else np.full(len(track), UNKNOWN_ROW_SIGMA)
    return track.t[::every], track.xy[::every], np.maximum(sigma[::every], MIN_ROW_SIGMA)


def passing_time(track: Trajectory, direction: float, along: float) -> float:
    """Return the time at which a stone passes a place along the sheet [s].

    Parameters
    ----------
    track : track of the stone
    direction : 1 for travel towards positive y, −1 towards negative y
    along : place, as direction times y [m]
    """
    forward = np.maximum.accumulate(direction * track.xy[:, 1])
    rising = np.concatenate([[True], np.diff(forward) > 0])
    return float(np.interp(along, forward[rising], track.t[rising]))


class _Fit:
    """Gauss-Newton fit with one density of the jerk; unknowns are x, y, displacements, clocks."""

    def __init__(self, chain: Sequence[Trajectory], offset: Floats, jerk: float) -> None:
        self.offset = offset.copy()
        self.rows = [thinned_rows(track) for track in chain]
        first = min(t[0] + tau for (t, _, _), tau in zip(self.rows, offset, strict=True))
        last = max(t[-1] + tau for (t, _, _), tau in zip(self.rows, offset, strict=True))
        count = int(np.ceil((last - first + 2.0) / JOIN_KNOT_STEP)) + 1
        inner = first - 1.0 + JOIN_KNOT_STEP * np.arange(count)
        self.knots = np.r_[inner[0] - JOIN_KNOT_STEP * np.arange(3, 0, -1), inner, 0, 0, 0]
        self.knots[-3:] = inner[-1] + JOIN_KNOT_STEP * np.arange(1, 4)
        self.m = len(self.knots) - 4
        self.cameras = len(chain)
        self.jerk = jerk
        start, stop = _free_interval(chain, offset)
        between = inner[:-1] + JOIN_KNOT_STEP / 2
        self.free: Flags = (between > start) & (between < stop)
        # The third derivative of a cubic spline is constant between knots, like white jerk.
        roughness = _spline_basis(self.knots, between, 3) * np.sqrt(JOIN_KNOT_STEP)
        roughness /= np.where(self.free, jerk, PUSHED_JERK)[:, None]
        self.smooth = roughness.T @ roughness
        self.size = 2 * self.m + 2 * self.cameras + self.cameras
        self.spread = np.array([float(np.median(sigma)) for _, _, sigma in self.rows])
        self.coefficients = np.zeros((self.m, 2))
        self.displacement = np.zeros((self.cameras, 2))
        self.weights = [np.ones((len(t), 2)) for t, _, _ in self.rows]

    def solve(self) -> tuple[float, JointPath]:
        """Return the logarithm of the evidence, and the path."""
        m, cameras, size = self.m, self.cameras, self.size
        normal, misfit = np.eye(size), 0.0
        for number in range(_ROUNDS):
            normal, right, misfit = self._normal_equations(number)
            ridge = 1e-12 * np.trace(normal) / size * np.eye(size)
            solved = np.linalg.solve(normal + ridge, right)
            self.coefficients = np.column_stack([solved[:m], solved[m : 2 * m]])
            self.displacement = solved[2 * m : 2 * m + 2 * cameras].reshape(cameras, 2)
            self.offset = solved[-cameras:]
        covariance = np.linalg.inv(normal)
        _, determinant = np.linalg.slogdet(normal)
        # Only terms that depend on the jerk matter; each free interval between knots has one.
        evidence = -0.5 * (misfit + determinant)
        evidence -= 2 * float(np.sum(self.free)) * np.log(self.jerk)
        sigma = np.sqrt(np.maximum(np.diag(covariance)[-cameras:], 0.0))
        sigma[0] = 0.0
        return evidence, JointPath(
            knots=self.knots,
            coefficients=self.coefficients,
            covariance=np.asarray(covariance, dtype=np.float64),
            offset=self.offset,
            offset_sigma=sigma,
            displacement=self.displacement,
        )

    def _normal_equations(self, number: int) -> tuple[Floats, Floats, float]:
        """Return normal matrix, right-hand side and −2·ln density of an iteration, from the present
        values.
        """
        m, cameras, size = self.m, self.cameras, self.size
        normal, right = np.zeros((size, size)), np.zeros(size)
        chi2 = logs = 0.0
        for k, (t, xy, sigma) in enumerate(self.rows):
            basis = _spline_basis(self.knots, t + self.offset[k])
            rate = _spline_basis(self.knots, t + self.offset[k], 1) @ self.coefficients
            for axis in range(2):
                design = np.zeros((len(t), size))
                design[:, axis * m : (axis + 1) * m] = basis
                design[:, 2 * m + 2 * k + axis] = 1.0
                if k and number:  # before the first iteration there is no path for the rate
                    design[:, 2 * m + 2 * cameras + k] = rate[:, axis]
                target = xy[:, axis] + design[:, -cameras:] @ self.offset
                weight = self.weights[k][:, axis] / sigma**2
                normal += (design * weight[:, None]).T @ design
                right += (design * weight[:, None]).T @ target
                residual = xy[:, axis] - basis @ self.coefficients[:, axis]
                residual = residual - self.displacement[k, axis]
                chi2 += float(np.sum(weight * residual**2))
                logs += float(np.sum(np.log(sigma**2 / self.weights[k][:, axis])))
                robust = 1 / (1 + (residual / (4 * sigma)) ** 2) if number > 2 else 1.0
                self.weights[k][:, axis] = robust
        for axis in range(2):
            part = slice(axis * m, (axis + 1) * m)
            normal[part, part] += self.smooth
            along = self.coefficients[:, axis]
            chi2 += float(along @ self.smooth @ along)
        for k in range(cameras):
            for axis in range(2):
                place = 2 * m + 2 * k + axis
                normal[place, place] += self.spread[k] ** -2
            chi2 += float(np.sum(self.displacement[k] ** 2) / self.spread[k] ** 2)
            # The first clock is the common one; the others are free within seconds.
            weight = 1e12 if k == 0 or not number else 1e-2
            normal[-cameras + k, -cameras + k] += weight
            right[-cameras + k] += weight * self.offset[k]
        return normal, right, chi2 + logs


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
        start = passing_time(first, direction, -HOG_LINE_Y) + float(offset[0])
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
