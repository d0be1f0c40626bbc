"""Fit of a camera to the painted lines, which are measured around their projections.

The lines are measured again in every round, from a wide search to a narrow one. Marks made by hand
and the prior of lenses are included, so that a lens is no more unusual than the paint requires.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from curling_env.typing import Flags, Floats, Integers, Singles
from friction_estimation.camera.camera import Camera
from friction_estimation.camera.lens import FreeLens
from friction_estimation.camera.markings import MarkingMeasurements, Markings, measure_markings
from friction_estimation.camera.refined import RefinedCamera, prior_residuals
from friction_estimation.camera.tuning import (
    ALIKE_REACH,
    CAMERA_HEIGHT_PRIOR,
    CLICK_SIGMA_PX,
    CURVE_ERROR_PX,
    MARKING_CORRELATION,
    MARKING_SIGMA_PX,
    MIN_MARKINGS,
    MIN_SCALE_PX,
    OUTLIER_AT,
    PAINT_PLACEMENT_SIGMA,
    PLACEMENT_SPREAD,
    RIM_SHIFT_POWER,
    RIM_SHIFT_PX,
)

MAX_EVALUATIONS = 30
ROUND_CHANGE, FINAL_CHANGE = 1e-3, 1e-6
"""Share of the loss by which the last step of a fit may change it."""
STEP = 1e-5
"""Change of each free parameter for its derivative."""


@dataclass(frozen=True, kw_only=True, eq=False)
class PaintFit:
    """Image, markings to search for in it, and prior knowledge of the camera.

    Parameters
    ----------
    grey : grey levels of the image or of a part of it
    origin : column and row of its upper left pixel in the image
    markings : the sheet's painted markings
    sheet_points, points_px : (n, 2) what was marked by hand, on the ice [m] and in the image [px]
    lens : the unknown parts of the lens
    height : median of the camera's height [m] and its spread in log
    click_sigma_px : standard error of a mark made by hand
    correlation : number of neighbouring points that count as one
    min_scale_px : measured points are never taken to agree better than this
    depth_sigma : standard error of the thickness of the ice above the paint [m]
    """

    grey: Singles
    origin: tuple[int, int]
    markings: Markings
    sheet_points: Floats
    points_px: Floats
    lens: FreeLens
    height: tuple[float, float] = CAMERA_HEIGHT_PRIOR
    click_sigma_px: float = CLICK_SIGMA_PX
    correlation: float = MARKING_CORRELATION
    min_scale_px: float = MIN_SCALE_PX
    depth_sigma: float = 0.0

    def approach(self, camera: Camera, searches: Sequence[float], lens: FreeLens) -> Camera | None:
        """Measure the markings and fit the camera, once for every search radius [px]."""
        for search in searches:
            measured = self.measure(camera, search)
            if len(measured.index) < MIN_MARKINGS:
                return None
            camera = _Fit(self, camera, measured, lens, max(search / 3, 0.5)).camera
            if not np.isfinite(camera.translation).all() or camera.position[2] < 0.3:
                return None
        return camera

    def measure(self, camera: Camera, search_px: float) -> MarkingMeasurements:
        """Measure the markings near their projections; see `measure_markings`."""
        return measure_markings(self.grey, self.origin, camera, self.markings, search_px)

    def fit(
        self, camera: Camera, measured: MarkingMeasurements, lens: FreeLens, scale_px: float
    ) -> RefinedCamera:
        """Fit the camera to given measurements, with its covariance.

        Parameters
        ----------
        camera : the one that the markings were measured with
        measured : the measurements
        lens : the free parts of the lens
        scale_px : largest scale of the residuals of points that agree
        """
        return _Fit(self, camera, measured, lens, scale_px, final=True).judged()


class _Fit:
    """One robust least-squares fit (trust region, `scipy.optimize.least_squares`).

    Measured points have Geman and McClure's loss, marks made by hand Cauchy's. The shift of the
    paint at the rim is a nuisance parameter.

    Parameters
    ----------
    known, camera, measured, lens, scale_px : see `PaintFit.fit`
    final : whether no further round follows, in which the paint is measured again
    """

    def __init__(
        self,
        known: PaintFit,
        camera: Camera,
        measured: MarkingMeasurements,
        lens: FreeLens,
        scale_px: float,
        *,
        final: bool = False,
    ) -> None:
        self._known, self._lens, self._measured = known, lens, measured
        self._points = known.markings.seen_from(camera)[measured.index]
        self._clicked = _on_ice(known.sheet_points)
        self._normal = measured.normal_px
        self._target = camera.project(self._points) + measured.offset_px[:, None] * self._normal
        self._count = len(self._points)
        self._rim_shift = np.zeros(self._count)
        if lens.bends:
            self._rim_shift = _rim_shift(camera, self._points, self._normal)
        self.camera, self._rim = camera, 0.0
        for _ in range(2 if final else 1):
            self._weigh(self._scale(scale_px))
            self._move(FINAL_CHANGE if final else ROUND_CHANGE)

    def _weigh(self, scale: float) -> None:
        """Set the scale [px] of the residuals of points that agree."""
        known = self._known
        self.scale = scale
        self.variance = (MARKING_SIGMA_PX**2 + scale**2 / 4) * known.correlation
        unit = np.sqrt(self.variance)
        self._cut = (OUTLIER_AT * scale / unit) ** 2

    def _scale(self, most: float) -> float:
        if not self._count:
            return most
        off = self._off(self.camera, self._rim)
        spread = 1.4826 * float(np.median(np.abs(off)))
        return max(min(most, 2 * spread), self._known.min_scale_px)

    def _move(self, change: float) -> None:
        """Minimise the loss, until a step changes less than a share."""
        start, rim = self.camera, self._rim
        found = least_squares(
            lambda step: self._residuals(start.moved(step[:-1], self._lens), rim + step[-1]),
            np.zeros(7 + self._lens.count),
            x_scale="jac",
            loss=self._loss,  # pyright: ignore[reportArgumentType]
            ftol=change,
            max_nfev=MAX_EVALUATIONS,
        )
        self.camera, self._rim = start.moved(found.x[:-1], self._lens), rim + found.x[-1]

    def _off(self, camera: Camera, rim: float) -> Floats:
        """Distances of measured points from their projections with a shift at the rim [px]."""
        apart = self._target - camera.project(self._points)
        return np.sum(apart * self._normal, axis=1) - rim * self._rim_shift

    def _residuals(self, camera: Camera, rim: float) -> Floats:
        """Residuals of measured points, of marks by hand, and of priors [standard errors]."""
        known = self._known
        slips = (known.points_px - camera.project(self._clicked)).ravel() / known.click_sigma_px
        prior = -self._lens.prior_residuals(camera.lens)
        usual = prior_residuals(camera, known.height) * self._lens.focal
        off = self._off(camera, rim) / np.sqrt(self.variance)
        return np.r_[off, slips, prior, usual, -rim]

    def _loss(self, squares: Floats) -> Floats:
        """Loss of squared residuals (r,) and its two derivatives, (3, r)."""
        found = np.zeros((3, len(squares)))
        found[0], found[1] = squares, 1.0
        points, hand = slice(0, self._count), slice(self._count, self._count + 2 * self._marks)
        seen = 1 + squares[points] / self._cut
        found[:, points] = squares[points] / seen, 1 / seen**2, -2 / self._cut / seen**3
        # A point marked by hand may be wrong: its influence is limited to a few standard errors.
        slip = 1 + squares[hand] / 9
        found[:, hand] = 9 * np.log(slip), 1 / slip, -1 / 9 / slip**2
        return found

    @property
    def _marks(self) -> int:
        return len(self._clicked)

    def judged(self) -> RefinedCamera:
        """Return the fitted camera, its covariance and its misfit."""
        known, off = self._known, self._off(self.camera, self._rim)
        even = max(2 * MARKING_SIGMA_PX, known.min_scale_px)
        agrees = np.abs(off) < OUTLIER_AT * self.scale
        covariance = self._covariance(off, agrees)[:-1, :-1]
        # On one scale for all cameras.
        unit = even * np.sqrt(known.correlation)
        self.variance, self._cut = unit**2, (OUTLIER_AT * even / unit) ** 2
        misfit = float(self._loss(self._residuals(self.camera, self._rim) ** 2)[0].sum())
        missed = self._measured.expected - self._count
        return RefinedCamera(
            camera=self.camera,
            covariance=covariance,
            measured=int(agrees.sum()),
            rms_px=float(np.sqrt(np.mean(off[agrees] ** 2))) if agrees.any() else np.nan,
            misfit=misfit + missed * OUTLIER_AT**2 / known.correlation,
            lens=self._lens,
            depth_sigma=known.depth_sigma,
        )

    def _covariance(self, off_px: Floats, agrees: Flags) -> Floats:
        """Covariance of the free parameters and the shift at the rim, (m + 1, m + 1).

        The weights of the fit are conservative, because there may be other paint. The residuals
        show the errors of points, and of whole curves.

        Parameters
        ----------
        off_px : (n,) distances by which the camera misses the measured points
        agrees : (n,) whether the point is no outlier
        """
        known, points = self._known, self._count
        now = self._residuals(self.camera, self._rim)
        count = 6 + self._lens.count
        jacobian = np.zeros((len(now), count + 1))
        for p in range(count):
            beside = self.camera.moved(STEP * np.eye(count)[p], self._lens)
            jacobian[:, p] = (now - self._residuals(beside, self._rim)) / STEP
        unit_px = np.sqrt(self.variance)
        jacobian[:points, -1], jacobian[-1, -1] = self._rim_shift / unit_px, 1.0
        weight = self._loss(now**2)[1]
        jacobian[:points] *= unit_px  # from here on in pixels
        weight[:points] /= self.variance
        normal = (jacobian * weight[:, None]).T @ jacobian
        unit = np.sqrt(np.diag(normal))
        inverse = np.linalg.pinv(normal / np.outer(unit, unit), rcond=1e-12) / np.outer(unit, unit)
        index = self._measured.index
        pull = (jacobian * weight[:, None]).T
        noise = pull / np.sqrt(weight)
        if not points:
            return inverse @ noise @ noise.T @ inverse
        variance = _variance_together(off_px[agrees], index[agrees], known.markings)
        noise[:, :points] = np.sqrt(variance) * pull[:, :points]
        errors = _placement_errors(known.markings, self.camera, self._measured)
        scale = _placement_scale(
            errors, off_px, weight[:points], jacobian[:points], inverse, variance
        )
        together = inverse @ np.column_stack([scale * pull[:, :points] @ errors, noise])
        return together @ together.T


def _variance_together(off_px: Floats, index: Integers, markings: Markings) -> float:
    """Variance of one of the equivalent number of independent points [px²].

    Parameters
    ----------
    off_px : (n,) how far points are off
    index : (n,) which of the markings they are
    markings : neighbours on a curve follow each other
    """
    along = np.full(len(markings.curve), np.nan)
    along[index] = off_px
    total = float(np.mean(off_px**2))
    for apart in range(1, ALIKE_REACH + 1):
        same = markings.curve[apart:] == markings.curve[:-apart]
        pairs = (along[apart:] * along[:-apart])[same]
        pairs = pairs[np.isfinite(pairs)]
        total += 2 * float(np.mean(pairs)) if len(pairs) else 0.0
    return max(total, float(np.mean(off_px**2)))


def _rim_shift(camera: Camera, points: Floats, normal_px: Floats) -> Floats:
    """Return the outward error of each seen point across its line, (n,) [px]."""
    seen = camera.project(points) - camera.lens.matrix[:2, 2]
    away = np.linalg.norm(seen, axis=1)
    squeeze = camera.lens.squeeze(camera.local(points))
    outward = np.sum(seen / np.maximum(away, 1.0)[:, None] * normal_px, axis=1)
    return RIM_SHIFT_PX * (2 * squeeze) ** RIM_SHIFT_POWER * outward


def _placement_errors(markings: Markings, camera: Camera, measured: MarkingMeasurements) -> Floats:
    """Return the error of each point for a misplaced painted curve, (n, curves) [px].

    A ring or a line is painted as a whole: an error of its place is the same all along it.
    """
    xy, normal = markings.xy[measured.index], markings.normal[measured.index]
    shifted = camera.project(_on_ice(xy + PAINT_PLACEMENT_SIGMA * normal))
    across = shifted - camera.project(_on_ice(xy))
    off = np.hypot(np.sum(across * measured.normal_px, axis=1), CURVE_ERROR_PX)
    line = markings.width[measured.index] > 0
    line |= markings.of("border")[measured.index]
    end, side = np.sign(xy[:, 1]), np.sign(xy[:, 0])
    along = np.abs(normal[:, 0]) > 0.5
    # A line along the sheet runs from end to end, with a parallel one on the other side.
    place = np.where(line & along, 2 * side, np.where(line, 4 * end, end))
    _, own = np.unique(
        np.column_stack([markings.curve[measured.index], place, line & along]),
        axis=0,
        return_inverse=True,
    )
    own = own.ravel()
    errors = np.zeros((len(xy), int(own.max()) + 1))
    errors[np.arange(len(xy)), own] = off
    return errors


def _placement_scale(
    errors: Floats,
    off_px: Floats,
    weight: Floats,
    jacobian: Floats,
    covariance: Floats,
    variance: float,
) -> float:
    """Return the error of this sheet's curves as a multiple of the usual one; 1 if not seen.

    It maximises the restricted likelihood of the residuals, with a prior from other sheets.

    Parameters
    ----------
    errors : (n, curves) see `_placement_errors`
    off_px, weight, jacobian : (n,), (n,) and (n, m) residuals of the measured points, their weights
        in the fit, and their derivatives
    covariance : (m, m) inverse of the fit's normal equations
    variance : of a point, if each erred for itself [px²]
    """
    pull = errors.T * weight
    left = pull - pull @ jacobian @ covariance @ (jacobian * weight[:, None]).T
    strength, way = np.linalg.eigh(left @ errors)
    # Directions that the fit absorbs completely are not observed.
    seen = strength > 1e-3 * (pull @ errors).max()
    strength, left = strength[seen], way[:, seen].T @ left
    found, noise = (left @ off_px) ** 2, variance * np.sum(left**2, axis=1)
    scales = np.geomspace(1 / 8, 8, 49)
    total = (scales[:, None] * strength) ** 2 + noise
    cost = np.sum(np.log(total) + found / total, axis=1)
    cost += (np.log(scales) / PLACEMENT_SPREAD) ** 2
    likely = np.exp(-0.5 * (cost - cost.min()))
    return float(np.exp(likely @ np.log(scales) / likely.sum()))


def _on_ice(xy: Floats) -> Floats:
    return np.column_stack([xy, np.zeros(len(xy))])
