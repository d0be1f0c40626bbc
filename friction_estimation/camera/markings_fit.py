"""A camera fitted to the painted lines: they are measured around it, and it is moved to them.

The lines are measured anew in every round, from a wide search to a narrow one. What was marked by
hand and what lenses are like count as well, so that a lens is never stranger than the paint
demands.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from curling_env.typing import Flags, Floats, Integers, Singles
from friction_estimation.camera.camera import Camera
from friction_estimation.camera.lens import KNOWN_LENS, FreeLens
from friction_estimation.camera.markings import MarkingMeasurements, Markings, measure_markings
from friction_estimation.camera.tuning import (
    ALIKE_REACH,
    CAMERA_HEIGHT_PRIOR,
    CLICK_SIGMA_PX,
    CONVINCING_COST,
    CURVE_ERROR_PX,
    MARKING_CORRELATION,
    MARKING_SIGMA_PX,
    MAX_STARTS,
    MIN_MARKINGS,
    MIN_SCALE_PX,
    MIN_STARTS,
    NARROW_SEARCHES_PX,
    OUTLIER_AT,
    PAINT_PLACEMENT_SIGMA,
    PLACEMENT_SPREAD,
    RIM_SHIFT_POWER,
    RIM_SHIFT_PX,
)

MAX_ITERATIONS = 12
STEP = 1e-5
"""Change of each free parameter for its derivative."""


@dataclass(frozen=True, kw_only=True, eq=False)
class FittedCamera:
    """A camera moved to the paint.

    Parameters
    ----------
    camera : after the fit
    covariance : (m, m) covariance of its free parameters, see `Camera.moved`
    residuals_px : (n,) how far it still misses each measured point
    agrees : (n,) whether the point is no outlier
    misfit : misfit to the paint and to prior knowledge [squared standard errors], on one scale
        for all cameras
    """

    camera: Camera
    covariance: Floats
    residuals_px: Floats
    agrees: Flags
    misfit: float

    @property
    def measured(self) -> int:
        """Number of the points that agree."""
        return int(self.agrees.sum())

    @property
    def rms_px(self) -> float:
        """Root mean square residual of these points."""
        return float(np.sqrt(np.mean(self.residuals_px[self.agrees] ** 2)))


@dataclass(frozen=True, kw_only=True, eq=False)
class MarkingsFit:
    """An image, the markings to look for in it, and what else is known of the camera.

    Parameters
    ----------
    grey : grey levels of the image or of a part of it
    origin : column and row of its upper left pixel in the image
    markings : the sheet's painted markings
    sheet_points, points_px : (n, 2) what was marked by hand, on the ice [m] and in the image [px]
    lens : the unknown parts of the lens
    height : median of the camera's height [m] and its spread in log
    correlation : number of neighbouring points that count as one
    min_scale_px : measured points are never taken to agree better than this
    """

    grey: Singles
    origin: tuple[int, int]
    markings: Markings
    sheet_points: Floats
    points_px: Floats
    lens: FreeLens
    height: tuple[float, float] = CAMERA_HEIGHT_PRIOR
    correlation: float = MARKING_CORRELATION
    min_scale_px: float = MIN_SCALE_PX

    def from_starts(self, starts: Sequence[Camera], wide: tuple[float, ...]) -> Camera | None:
        """The best camera that any of several starts leads to.

        The pose is fitted first, then the lens with it. Points that were marked in the wrong place
        may favour starts that lead astray; more starts are followed until one convinces.
        """
        leading = replace(self.lens, minor=False, axis=False)
        tried = [self.approach(start, wide, KNOWN_LENS) for start in starts]
        tried = sorted((found for found in tried if found is not None), key=self.cost)
        best, least = None, np.inf
        for k, near in enumerate(tried):
            if k >= (MIN_STARTS if least < CONVINCING_COST else MAX_STARTS):
                break
            bent = self.approach(near, (6.0,), leading)
            for start in (bent, near) if k == 0 else (bent,):
                end = None if start is None else self.approach(start, NARROW_SEARCHES_PX, self.lens)
                if end is not None and self.cost(end) < least:
                    best, least = end, self.cost(end)
        return best

    def approach(
        self, camera: Camera, searches: tuple[float, ...], lens: FreeLens
    ) -> Camera | None:
        """Measure the markings and fit the camera, once for every search radius [px]."""
        for search in searches:
            wide = search > NARROW_SEARCHES_PX[0] and not lens.count
            measured = self.measure(camera, search, only_strong=wide)
            if len(measured.index) < MIN_MARKINGS // (2 if wide else 1):
                return None
            camera = self.fit(camera, measured, lens, max(search / 3, 0.5)).camera
            if not np.isfinite(camera.translation).all() or camera.position[2] < 0.3:
                return None
        return camera

    def measure(
        self, camera: Camera, search_px: float, *, only_strong: bool = False
    ) -> MarkingMeasurements:
        """The markings as they are seen near where a camera puts them; see `measure_markings`."""
        return measure_markings(
            self.grey, self.origin, camera, self.markings, search_px, only_strong=only_strong
        )

    def cost(self, camera: Camera) -> float:
        """Mean over the visible markings of the squared miss, at most 9 px² each."""
        measured = self.measure(camera, 3.0)
        if len(measured.index) < MIN_MARKINGS:
            return 9.0
        squares = np.minimum(measured.offset_px**2, 9.0).sum()
        return float(
            (squares + 9.0 * (measured.expected - len(measured.index))) / measured.expected
        )

    def fit(
        self, camera: Camera, measured: MarkingMeasurements, lens: FreeLens, scale_px: float
    ) -> FittedCamera:
        """The camera that meets fixed measurements best (Levenberg-Marquardt).

        Parameters
        ----------
        camera : the one that the markings were measured with
        measured : the measurements
        lens : the free parts of the lens
        scale_px : largest scale of the residuals of points that agree
        """
        residuals = _Residuals(self, camera, measured, lens)
        points = residuals.count
        # How far the paint at the rim is shifted is fitted beside the camera, and then forgotten.
        rim, damping = 0.0, 0.0
        now = residuals.of(camera, rim)
        near = residuals.linearised(camera, rim, now, scale_px)
        for _ in range(MAX_ITERATIONS):
            normal, unit = near.normal_equations
            right = near.jacobian.T @ (near.weight * now) / unit
            before = near.loss(now)
            for _ in range(8):
                damped = normal + damping * np.eye(len(unit))
                delta = np.linalg.pinv(damped, rcond=1e-12) @ right / unit
                after = camera.moved(delta[:-1], lens)
                found = residuals.of(after, rim + delta[-1])
                if np.isfinite(found).all() and near.loss(found) <= before:
                    break
                damping = max(10 * damping, 1e-5)
            else:
                break
            camera, rim, now, damping = after, rim + delta[-1], found, damping / 10
            if np.abs(delta * unit).max() < 0.01:
                break
            near = residuals.linearised(camera, rim, now, scale_px)
        agrees = np.abs(now[:points]) < OUTLIER_AT * near.scale
        even = max(2 * MARKING_SIGMA_PX, self.min_scale_px)
        misfit = residuals.loss(now, (OUTLIER_AT * even) ** 2, even**2 * self.correlation)
        return FittedCamera(
            camera=camera,
            covariance=self._covariance(near, camera, measured, now[:points])[:-1, :-1],
            residuals_px=now[:points],
            agrees=agrees,
            misfit=misfit + (measured.expected - points) * OUTLIER_AT**2 / self.correlation,
        )

    def _covariance(
        self, near: _Linearised, camera: Camera, measured: MarkingMeasurements, off_px: Floats
    ) -> Floats:
        """Covariance of the free parameters and the shift at the rim, (m + 1, m + 1).

        Points are weighed with care in the fit, for there may be other paint. How far they are off,
        and how far the curves are off their places, the fit shows.

        Parameters
        ----------
        near : the fit's last step
        off_px : (n,) how far the camera misses the measured points
        """
        points = len(off_px)
        normal, unit = near.normal_equations
        inverse = np.linalg.pinv(normal, rcond=1e-12) / np.outer(unit, unit)
        agrees = np.abs(off_px) < OUTLIER_AT * near.scale
        variance = _variance_together(off_px[agrees], measured.index[agrees], self.markings)
        pull = (near.jacobian * near.weight[:, None]).T
        noise = pull / np.sqrt(near.weight)
        noise[:, :points] = np.sqrt(variance) * pull[:, :points]
        errors = _placement_errors(self.markings, camera, measured)
        scale = _placement_scale(
            errors, off_px, near.weight[:points], near.jacobian[:points], inverse, variance
        )
        together = inverse @ np.column_stack([scale * pull[:, :points] @ errors, noise])
        return together @ together.T


@dataclass(frozen=True, kw_only=True, eq=False)
class _Linearised:
    """One step of a fit.

    Parameters
    ----------
    residuals : see `_Residuals`
    jacobian : (r, m + 1) what each free parameter, and the shift at the rim, takes off residuals
    weight : (r,) weights of the residuals; outliers count less
    scale : of the measured points that agree [px]
    cut, variance : see `_Residuals.loss`
    """

    residuals: _Residuals
    jacobian: Floats
    weight: Floats
    scale: float
    cut: float
    variance: float

    @property
    def normal_equations(self) -> tuple[Floats, Floats]:
        """The matrix with a diagonal of ones, and the units of the parameters that make it so."""
        normal = (self.jacobian * self.weight[:, None]).T @ self.jacobian
        unit = np.sqrt(np.diag(normal))
        return normal / np.outer(unit, unit), unit

    def loss(self, residuals: Floats) -> float:
        """What this step makes less, see `_Residuals.loss`."""
        return self.residuals.loss(residuals, self.cut, self.variance)


class _Residuals:
    """What a camera misses: measured points, points marked by hand, and what was known before.

    Parameters
    ----------
    fit : what is known
    camera : the one that the markings were measured with
    measured : the measurements
    lens : the free parts of the lens
    """

    def __init__(
        self, fit: MarkingsFit, camera: Camera, measured: MarkingMeasurements, lens: FreeLens
    ) -> None:
        self._fit, self._lens = fit, lens
        self._points = _on_ice(fit.markings.xy[measured.index])
        self._clicked = _on_ice(fit.sheet_points)
        self._normal = measured.normal_px
        self._target = camera.project(self._points) + measured.offset_px[:, None] * self._normal
        self.count = len(self._points)
        self._after_clicks = self.count + 2 * len(self._clicked)
        self.rim_shift = np.zeros(self.count)
        if lens.bends:
            self.rim_shift = _rim_shift(camera, self._points, self._normal)

    def of(self, camera: Camera, rim: float) -> Floats:
        """Residuals of measured points [px], and of all else [standard errors].

        Parameters
        ----------
        camera : any
        rim : how strongly the paint at the rim is shifted, see `tuning.RIM_SHIFT_PX`
        """
        fit = self._fit
        off = np.sum((self._target - camera.project(self._points)) * self._normal, axis=1)
        slips = (fit.points_px - camera.project(self._clicked)).ravel() / CLICK_SIGMA_PX
        middle, spread = fit.height
        free = self._lens.focal
        rise = np.log(middle / max(camera.position[2], 1e-3)) / spread if free else 0.0
        prior = -self._lens.prior_residuals(camera.lens)
        return np.r_[off - rim * self.rim_shift, slips, prior, rise, -rim]

    def linearised(self, camera: Camera, rim: float, now: Floats, scale_px: float) -> _Linearised:
        """How the residuals change around a camera, and how they are weighed there.

        Parameters
        ----------
        now : the camera's residuals as returned by `of`
        scale_px : largest scale of the residuals of points that agree
        """
        fit, count = self._fit, 6 + self._lens.count
        jacobian = np.zeros((len(now), count + 1))
        for p in range(count):
            beside = camera.moved(STEP * np.eye(count)[p], self._lens)
            jacobian[:, p] = (self.of(beside, rim) - now) / -STEP
        jacobian[: self.count, -1], jacobian[-1, -1] = self.rim_shift, 1.0
        spread = 1.4826 * float(np.median(np.abs(now[: self.count])))
        scale = max(min(scale_px, 2 * spread), fit.min_scale_px)
        variance = (MARKING_SIGMA_PX**2 + scale**2 / 4) * fit.correlation
        cut = (OUTLIER_AT * scale) ** 2
        return _Linearised(
            residuals=self,
            jacobian=jacobian,
            weight=self._weights(now, cut, variance),
            scale=scale,
            cut=cut,
            variance=variance,
        )

    def _weights(self, residuals: Floats, cut: float, variance: float) -> Floats:
        """Weights of a step: outliers count less, see `loss`."""
        weight = np.ones(len(residuals))
        hand = slice(self.count, self._after_clicks)
        weight[: self.count] = 1 / (1 + residuals[: self.count] ** 2 / cut) ** 2 / variance
        weight[hand] = 1 / (1 + residuals[hand] ** 2 / 9)
        return weight

    def loss(self, residuals: Floats, cut: float, variance: float) -> float:
        """The robust sum of squares that is minimised [squared standard errors].

        Parameters
        ----------
        residuals : residuals as returned by `of`
        cut : squared residual of a measured point at which its weight is a quarter [px²]
        variance : variance of a measured point [px²]
        """
        seen = residuals[: self.count] ** 2
        hand = residuals[self.count : self._after_clicks] ** 2
        total = np.sum(seen / (1 + seen / cut)) / variance
        # A point marked by hand may be a slip: it pulls no harder than a few standard errors.
        total += np.sum(9 * np.log1p(hand / 9)) + np.sum(residuals[self._after_clicks :] ** 2)
        return float(total)


def _variance_together(off_px: Floats, index: Integers, markings: Markings) -> float:
    """Variance of one of so many points as would tell as much if each erred for itself [px²].

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
    """How far each point may be seen outwards of its place, across its line, (n,) [px]."""
    seen = camera.project(points) - camera.lens.matrix[:2, 2]
    away = np.linalg.norm(seen, axis=1)
    squeeze = camera.lens.squeeze(camera.local(points))
    outward = np.sum(seen / np.maximum(away, 1.0)[:, None] * normal_px, axis=1)
    return RIM_SHIFT_PX * (2 * squeeze) ** RIM_SHIFT_POWER * outward


def _placement_errors(markings: Markings, camera: Camera, measured: MarkingMeasurements) -> Floats:
    """How far each point is off where one painted curve is, (n, curves) [px].

    A ring or a line is laid as a whole, and seen as a whole: an error of its place is the same all
    along it.
    """
    xy, normal = markings.xy[measured.index], markings.normal[measured.index]
    shifted = camera.project(_on_ice(xy + PAINT_PLACEMENT_SIGMA * normal))
    across = shifted - camera.project(_on_ice(xy))
    off = np.hypot(np.sum(across * measured.normal_px, axis=1), CURVE_ERROR_PX)
    line = markings.width[measured.index] > 0
    line |= markings.of("border")[measured.index]
    end, side = np.sign(xy[:, 1]), np.sign(xy[:, 0])
    along = np.abs(normal[:, 0]) > 0.5
    # A line along the sheet runs from end to end, with another one on the other side.
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
    """How many times as far as usual this sheet's curves are off their places; 1 if not seen.

    Its likelihood is that of what the fit leaves of them (restricted maximum likelihood), weighed
    by how well other sheets are painted.

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
    told, way = np.linalg.eigh(left @ errors)
    # What the fit follows altogether is not seen.
    seen = told > 1e-3 * (pull @ errors).max()
    told, left = told[seen], way[:, seen].T @ left
    found, noise = (left @ off_px) ** 2, variance * np.sum(left**2, axis=1)
    scales = np.geomspace(1 / 8, 8, 49)
    total = (scales[:, None] * told) ** 2 + noise
    cost = np.sum(np.log(total) + found / total, axis=1)
    cost += (np.log(scales) / PLACEMENT_SPREAD) ** 2
    likely = np.exp(-0.5 * (cost - cost.min()))
    return float(np.exp(likely @ np.log(scales) / likely.sum()))


def _on_ice(xy: Floats) -> Floats:
    return np.column_stack([xy, np.zeros(len(xy))])
