"""The lens of a camera: from directions to pixels and back, and its free parameters.

Everything that depends on the kind of lens is in this module: the formula and its inverse, the
names and order of its terms, the trial values of a search, and the terms that a fit may free.
Another lens model changes this file, and the calls of OpenCV in `chessboard` and `pose`.
"""

# OpenCV's stubs widen the element type of every array that they return.
# pyright: reportArgumentType=false, reportCallIssue=false

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import cv2
import numpy as np
from numpy.typing import ArrayLike

from curling_env.typing import Floats

TERMS = ("k1", "k2", "p1", "p2", "k3")
"""The terms of the distortion in OpenCV's order: radial (k) and tangential (p)."""
POWERS = np.array([2, 4, 1, 1, 6])
"""Power of the distance from the axis with which the displacement of each term grows."""
NO_DISTORTION = np.zeros(len(TERMS))
TRIAL_FOCALS = (0.35, 0.6, 1.0, 1.7)
"""Initial focal lengths of a search, in longer sides of the image."""
TRIAL_BENDS = (-0.3, -0.22, -0.15, -0.09, -0.04, 0.0, 0.05)
"""Initial distortions of a search: relative displacement of the longer side's end."""

# Prior of lenses: standard deviations, in units of half of the image's longer side.
BEND_SIGMA = 0.3
"""Displacement by k1, and by k2, at the end of the longer side."""
MINOR_SIGMA = 0.001
"""The same by each of the other terms."""
AXIS_SIGMA = 0.015
"""Distance of the axis from the middle of an uncropped picture."""
CUT_AXIS_SIGMA = 0.2
"""The same if the picture was cropped."""
STRETCH_SIGMA = 0.06
"""Standard deviation of the stretch of a cropped picture, in log."""


def distort(x: Any, y: Any, terms: Any) -> tuple[Any, Any]:
    """Return the image point of a ray, in focal lengths from the axis.

    Parameters
    ----------
    x, y : place at which a lens without distortion would show it, numbers or arrays
    terms : (5,) in the order of `TERMS`

    Source
    ------
    Brown, Decentering distortion of lenses (1966), in the form and the order of OpenCV.
    """
    k1, k2, p1, p2, k3 = terms
    r2 = x * x + y * y
    radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
    return (
        x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x),
        y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y,
    )


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
        """Return a lens with square pixels whose axis meets the middle of the image."""
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

    def project(self, points: Floats) -> Floats:
        """Points (n, 3) of the camera's frame [m] to pixels (n, 2); NaN for those behind it."""
        x, y, z = points.T
        depth = np.where(z > 0, z, np.nan)
        u, v = distort(x / depth, y / depth, self.distortion.tolist())
        (fx, skew, cx), (_, fy, cy), _ = self.matrix.tolist()
        return np.column_stack([fx * u + skew * v + cx, fy * v + cy])

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
        """Tangent of the largest angle to the axis for which the formula is valid.

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

    # --- other lenses ------------------------------------------------------------------------

    def bent(self, share: float, *, further: bool = False) -> Lens:
        """Return the lens with the distortion that moves the end of the longer side by a share.

        Parameters
        ----------
        further : whether the second term is the square of the first, about as of wide lenses; then
            the formula never folds the picture back
        """
        distortion = NO_DISTORTION.copy()
        distortion[0] = share * (2 * self.matrix[0, 0] / max(self.size)) ** 2
        distortion[1] = further * distortion[0] ** 2
        return replace(self, distortion=distortion)

    def resized(self, scale: Floats, size: tuple[int, int]) -> Lens:
        """Return the lens for pictures enlarged along both sides (2,) to a size (width, height)
        [px].
        """
        return replace(self, matrix=resized_matrix(self.matrix, scale), size=size)

    def with_terms_added(self, changes: Mapping[str, float]) -> Lens:
        """Return the lens with additions to terms of its distortion, by name."""
        added = np.array([changes.get(term, 0.0) for term in TERMS])
        return replace(self, distortion=self.distortion + added)

    @property
    def half_side_px(self) -> float:
        """Half of the image's longer side [px]."""
        return max(self.size) / 2

    @property
    def shares(self) -> Floats:
        """Relative displacement of the end of the longer side by each term, (5,)."""
        return self.distortion * (self.half_side_px / self.matrix[0, 0]) ** POWERS

    def changed(self, step: Floats, free: FreeLens) -> Lens:
        """Return the lens after a step (count,) of its free parameters.

        The distortion in the image stays the same when the focal length changes.
        """
        rest, matrix, shares = iter(step.tolist()), self.matrix.copy(), self.shares
        if free.focal:
            matrix[[0, 1], [0, 1]] *= np.exp(next(rest))
        for term in free.terms:
            shares[term] += next(rest)
        if free.moves_axis:
            matrix[:2, 2] += self.half_side_px * np.array([next(rest), next(rest)])
        distortion = shares / (self.half_side_px / matrix[0, 0]) ** POWERS
        if free.cut:
            matrix[1, 1] *= np.exp(next(rest))
        return replace(self, matrix=matrix, distortion=distortion)


def resized_matrix(matrix: Floats, scale: Floats) -> Floats:
    """Return a camera matrix (3, 3) for pictures enlarged along both sides (2,).

    Pixels are counted from the first one's centre.
    """
    matrix = matrix.copy()
    matrix[:2, :2] *= scale[:, None]
    matrix[:2, 2] = (matrix[:2, 2] + 0.5) * scale - 0.5
    return matrix


@dataclass(frozen=True, kw_only=True)
class FreeLens:
    """Unknown parts of a lens, which are free in a fit.

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
    def terms(self) -> list[int]:
        """Indices of the free terms of the distortion."""
        return [0, 1] * self.bends + [2, 3, 4] * self.minor

    @property
    def moves_axis(self) -> bool:
        """Return whether the axis is free."""
        return self.axis or self.cut

    @property
    def _sigmas(self) -> list[float]:
        """Prior standard deviation of each free parameter; infinite without a prior."""
        found = [np.inf] * self.focal + [BEND_SIGMA] * (2 * self.bends)
        found += [MINOR_SIGMA] * (3 * self.minor)
        found += [CUT_AXIS_SIGMA if self.cut else AXIS_SIGMA] * (2 * self.moves_axis)
        return found + [STRETCH_SIGMA] * self.cut

    def prior_residuals(self, lens: Lens) -> Floats:
        """Return the deviations of a lens from usual lenses, (count,) [standard deviations]."""
        values: list[float] = [0.0] * self.focal
        values += lens.shares[self.terms].tolist()
        if self.moves_axis:
            middle = np.array(lens.size) / 2
            values += ((lens.matrix[:2, 2] - middle) / lens.half_side_px).tolist()
        if self.cut:
            values.append(float(np.log(lens.matrix[1, 1] / lens.matrix[0, 0])))
        return np.array(values) / np.array(self._sigmas)


KNOWN_LENS = FreeLens()
"""A completely known lens."""
