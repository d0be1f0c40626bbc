"""The lens of a camera: from directions to pixels and back, and what of it may be unknown.

Everything that depends on the kind of lens stands in two files, this one and `lens_formula`: the
formula and its inverse there; here the names and the order of its terms, the trial values a search
begins with, and the terms a fit may free. Another lens model changes these two files, and the call
of OpenCV in `chessboard`.
"""

# OpenCV's stubs widen the element type of every array that they return.
# pyright: reportArgumentType=false, reportCallIssue=false

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import ArrayLike

from curling_env.typing import Floats
from friction_estimation.camera.lens_formula import project_points

TERMS = ("k1", "k2", "p1", "p2", "k3")
"""The terms of the distortion in OpenCV's order: radial (k) and tangential (p)."""
POWERS = np.array([2, 4, 1, 1, 6])
"""Power of the distance from the axis with which the displacement of each term grows."""
NO_DISTORTION = np.zeros(len(TERMS))
TRIAL_FOCALS = (0.35, 0.6, 1.0, 1.7)
"""Focal lengths that a search begins with, in longer sides of the image."""
TRIAL_BENDS = (-0.3, -0.22, -0.15, -0.09, -0.04, 0.0, 0.05)
"""Distortions that a search begins with: share by which the longer side's end is moved."""

# What lenses are like: standard deviations of a prior that decides where the paint cannot. The
# unit of each is half of the image's longer side.
BEND_SIGMA = 0.3
"""Displacement by k1, and by k2, at the end of the longer side."""
MINOR_SIGMA = 0.001
"""The same by each of the other terms."""
AXIS_SIGMA = 0.015
"""Distance of the axis from the middle of a whole picture."""
CUT_AXIS_SIGMA = 0.2
"""The same where the picture was cut out of another."""
STRETCH_SIGMA = 0.06
"""Standard deviation of the stretch of a cut picture, in log."""

_UNDISTORT_UNTIL = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 60, 1e-10)


@dataclass(frozen=True, kw_only=True, eq=False)
class Lens:
    """A lens and the image behind it.

    Parameters
    ----------
    matrix : (3, 3) camera matrix: focal lengths and principal point [px]
    distortion : (5,) in the order of `TERMS`
    size : width and height of the image [px]
    """

    matrix: Floats
    distortion: Floats
    size: tuple[int, int]

    @classmethod
    def centred(
        cls, focal_px: float, size: tuple[int, int], distortion: ArrayLike = NO_DISTORTION
    ) -> Lens:
        """A lens with square pixels whose axis meets the middle of the image."""
        return cls(
            matrix=np.array([[focal_px, 0, size[0] / 2], [0, focal_px, size[1] / 2], [0, 0, 1.0]]),
            distortion=np.asarray(distortion, dtype=np.float64),
            size=size,
        )

    # --- directions and pixels ---------------------------------------------------------------

    @property
    def focal_px(self) -> float:
        """Focal length across the image [px]."""
        return float(self.matrix[0, 0])

    @property
    def terms(self) -> tuple[float, ...]:
        """The distortion as the compiled loops take it."""
        return tuple(self.distortion.tolist())

    def project(self, points: Floats) -> Floats:
        """Points (n, 3) of the camera's frame [m] to pixels (n, 2); NaN for those behind it."""
        px = np.empty((len(points), 2))
        project_points(np.ascontiguousarray(points), self.matrix, self.terms, px)
        return px

    def rays(self, px: ArrayLike) -> Floats:
        """Directions (n, 3) in the camera's frame, with depth 1, through pixels (n, 2)."""
        points = np.asarray(px, dtype=np.float64).reshape(-1, 1, 2)
        if len(points) == 0:
            return np.empty((0, 3))
        flat = cv2.undistortPoints(
            points, self.matrix, self.distortion, criteria=_UNDISTORT_UNTIL
        ).reshape(-1, 2)
        return np.column_stack([flat, np.ones(len(flat))]).astype(np.float64, copy=False)

    @property
    def reach(self) -> float:
        """Tangent of the largest angle to the axis that the formula can show.

        Beyond it the terms of a strong distortion fold the picture back over itself.
        """
        k1, k2, _, _, k3 = self.distortion
        roots = np.roots([7 * k3, 5 * k2, 3 * k1, 1.0])
        folds = roots.real[(np.abs(roots.imag) < 1e-9) & (roots.real > 0)]
        return float(np.sqrt(folds.min(initial=np.inf)))

    def squeeze(self, points: Floats) -> Floats:
        """Return the radial shrinkage at points (n, 3) of the camera's frame, 0 to 1."""
        r2 = np.sum(points[:, :2] ** 2, axis=1) / points[:, 2] ** 2
        k1, k2, _, _, k3 = self.distortion
        return np.clip(-r2 * (3 * k1 + r2 * (5 * k2 + r2 * 7 * k3)), 0.0, 1.0)

    def for_opencv(self, px: Floats) -> tuple[Floats, Floats, Floats]:
        """Pixels, camera matrix and distortion for OpenCV's solvers of a pose.

        The formula is OpenCV's own, so the pixels stay as they are. A lens with another formula
        would give pixels that are free of distortion, and no distortion.
        """
        return np.ascontiguousarray(px, dtype=np.float64), self.matrix, self.distortion

    # --- other lenses ------------------------------------------------------------------------

    def bent(self, share: float, *, further: bool = False) -> Lens:
        """The lens with no distortion but that which moves the longer side's end by a share.

        Parameters
        ----------
        further : whether the second term is the square of the first, about as of wide lenses; then
            the formula never folds the picture back
        """
        distortion = NO_DISTORTION.copy()
        distortion[0] = share * (2 * self.matrix[0, 0] / max(self.size)) ** 2
        distortion[1] = further * distortion[0] ** 2
        return replace(self, distortion=distortion)

    def stretched(self, log_stretch: float) -> Lens:
        """The lens with its pixels' height changed against their width, in log."""
        matrix = self.matrix.copy()
        matrix[1, 1] *= np.exp(log_stretch)
        return replace(self, matrix=matrix)

    def resized(self, scale: Floats, size: tuple[int, int]) -> Lens:
        """The lens for pictures enlarged along both sides (2,) to a size (width, height) [px]."""
        return replace(self, matrix=resized_matrix(self.matrix, scale), size=size)

    def with_terms_added(self, changes: Mapping[str, float]) -> Lens:
        """The lens with something added to terms of its distortion, by name."""
        added = np.array([changes.get(term, 0.0) for term in TERMS])
        return replace(self, distortion=self.distortion + added)

    @property
    def half_side_px(self) -> float:
        """Half of the image's longer side [px]."""
        return max(self.size) / 2

    @property
    def shares(self) -> Floats:
        """By what share of it each term moves the end of the longer side, (5,)."""
        return self.distortion * (self.half_side_px / self.matrix[0, 0]) ** POWERS

    def changed(self, change: LensChange) -> Lens:
        """The lens after a step of a fit.

        What the image shows of the distortion stays as it is when the focal length changes.
        """
        matrix = self.matrix.copy()
        matrix[[0, 1], [0, 1]] *= np.exp(change.log_focal)
        matrix[1, 1] *= np.exp(change.log_stretch)
        matrix[:2, 2] += change.axis * self.half_side_px
        shares = self.shares + change.shares
        return replace(
            self,
            matrix=matrix,
            distortion=shares / (self.half_side_px / matrix[0, 0]) ** POWERS,
        )


def resized_matrix(matrix: Floats, scale: Floats) -> Floats:
    """A camera matrix (3, 3) for pictures made larger along both sides (2,).

    Pixels are counted from the first one's centre.
    """
    matrix = matrix.copy()
    matrix[:2, :2] *= scale[:, None]
    matrix[:2, 2] = (matrix[:2, 2] + 0.5) * scale - 0.5
    return matrix


class LensChange(NamedTuple):
    """A step of a fit.

    Parameters
    ----------
    log_focal : change of the logarithm of the focal length
    shares : (5,) change of `Lens.shares`
    axis : (2,) shift of the principal point [halves of the image's longer side]
    log_stretch : change of the logarithm of a pixel's height over its width
    """

    log_focal: float
    shares: Floats
    axis: Floats
    log_stretch: float


@dataclass(frozen=True, kw_only=True)
class FreeLens:
    """Parts of a lens that are unknown, and so free in a fit.

    Their order is that of these flags, and within the distortion that of `TERMS`.

    Parameters
    ----------
    focal : the focal length
    bends : k1 and k2, which make nearly all of the distortion
    minor : the small terms: a third radial one, and those of a lens that sits askew
    axis : the point at which the lens's axis meets the picture
    cut : the picture was cut out of another and perhaps stretched, as those of club cameras often
        are; the axis is free with it
    """

    focal: bool = False
    bends: bool = False
    minor: bool = False
    axis: bool = False
    cut: bool = False

    @property
    def count(self) -> int:
        """Number of free parameters."""
        return len(self._sigmas)

    @property
    def _free_terms(self) -> list[int]:
        """Indices of the free terms of the distortion."""
        return [0, 1] * self.bends + [2, 3, 4] * self.minor

    @property
    def _sigmas(self) -> tuple[float, ...]:
        """Prior standard deviation of each free parameter; infinite where nothing is presumed."""
        found: tuple[float, ...] = (np.inf,) * self.focal
        found += (BEND_SIGMA,) * (2 * self.bends) + (MINOR_SIGMA,) * (3 * self.minor)
        if self.cut:
            return (*found, CUT_AXIS_SIGMA, CUT_AXIS_SIGMA, STRETCH_SIGMA)
        return found + (AXIS_SIGMA, AXIS_SIGMA) * self.axis

    def change(self, step: Floats) -> LensChange:
        """The change of the lens that a step (count,) of the free parameters makes."""
        rest = iter(step.tolist())
        log_focal = next(rest) if self.focal else 0.0
        shares = np.zeros(len(TERMS))
        for term in self._free_terms:
            shares[term] = next(rest)
        axis = [next(rest), next(rest)] if self.axis or self.cut else [0.0, 0.0]
        return LensChange(log_focal, shares, np.array(axis), next(rest) if self.cut else 0.0)

    def prior_residuals(self, lens: Lens) -> Floats:
        """Return the deviations of a lens from usual lenses, (count,) [standard deviations]."""
        values: list[float] = [0.0] * self.focal
        values += lens.shares[self._free_terms].tolist()
        if self.axis or self.cut:
            middle = np.array(lens.size) / 2
            values += ((lens.matrix[:2, 2] - middle) / lens.half_side_px).tolist()
        if self.cut:
            values.append(float(np.log(lens.matrix[1, 1] / lens.matrix[0, 0])))
        return np.array(values) / np.array(self._sigmas)


KNOWN_LENS = FreeLens()
"""Nothing of the lens is unknown."""
