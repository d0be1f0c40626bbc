"""A camera fitted to the paint on the ice: marks are read around it, and it is moved to them.

The marks are read anew from a wide search to a narrow one. What was clicked, and what lenses are
like, is weighed with them, so that a lens is never stranger than the paint demands.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from curling_env.typing import Floats
from friction_estimation.camera.camera import Camera
from friction_estimation.camera.lens import KNOWN_LENS, FreeLens
from friction_estimation.camera.markings import MarkingMeasurements, Markings, measure_markings

Grey = NDArray[np.float32]

CLICK_PX = 3.0
"""Standard error of a point marked by hand [px]."""
MARK_PX = 0.15
"""Standard error of one reading of a mark that is not noise: paint, blur, compression [px]."""
MARK_CORRELATION = 6.0
"""Neighbouring readings share their errors: so many count as one."""
LAID = 0.002
"""How far a ring's radius or a line is off where it should be painted [m]; it is so all along."""
LEAST_SCALE_PX = 0.1
"""MarkingMeasurements are never taken to agree better than this [px]."""
NARROW_PX = (4.0, 3.0, 2.0, 2.0, 2.0)
"""Search in each round, first for hog lines and border, then for all marks [px]."""
FEW_STARTS, MOST_STARTS = 4, 12
SURE_COST = 0.5
"""So many starts are followed at least, and up to so many until the mean squared miss is below
this [px²], of which a mark that is not found counts 9."""
MIN_READINGS = 60
"""Fewer readings do not outweigh what was clicked."""
CAMERA_HEIGHT = (8.0, 0.5)
"""Median height of rink cameras [m] and its spread (in log): halls, galleries and tripods. It
decides only where the paint cannot, as for a camera that looks straight down."""
RIM_PX = 1.0
"""How far paint may be seen beside its place, outwards, where a lens squeezes the picture's rim to
half its scale [px]: colours part there and edges blur, and no formula of distortion is exact."""
SQUEEZE_POWER = 4
"""So it grows with the squeeze: in the middle of a picture nothing of it is left."""
OUTLIER = 3.0
ROUNDS = 12
STEP = 1e-5
"""Of each free parameter, for its derivative."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Fitted:
    """A camera moved to the paint.

    Parameters
    ----------
    camera : the fitted one
    covariance : (m, m) of its free parameters, see `moved`
    left_px : (n,) by how much it misses each reading
    agrees : (n,) whether that is no outlier
    misfit : to the paint and to what was known before [squared standard errors], at one scale for
        all cameras
    """

    camera: Camera
    covariance: Floats
    left_px: Floats
    agrees: NDArray[np.bool_]
    misfit: float

    @property
    def readings(self) -> int:
        """Number of the readings that agree."""
        return int(self.agrees.sum())

    @property
    def rms_px(self) -> float:
        """Root mean square miss of these."""
        return float(np.sqrt(np.mean(self.left_px[self.agrees] ** 2)))


@dataclass(frozen=True, kw_only=True, eq=False)
class MarkingsFit:
    """An image, the marks to look for in it, and what else is known of the camera.

    Parameters
    ----------
    grey, origin : part of the image, and its upper left pixel's column and row
    marks : of the sheet
    sheet_points, points_px : (n, 2) what was marked by hand, on the ice [m] and in the image [px]
    lens : what of it is to be found
    height : median of the camera's height [m] and its spread in log
    correlation : so many neighbouring readings count as one
    least_scale_px : readings are never taken to agree better than this
    """

    grey: Grey
    origin: tuple[int, int]
    marks: Markings
    sheet_points: Floats
    points_px: Floats
    lens: FreeLens
    height: tuple[float, float] = CAMERA_HEIGHT
    correlation: float = MARK_CORRELATION
    least_scale_px: float = LEAST_SCALE_PX

    def from_starts(self, starts: Sequence[Camera], wide: tuple[float, ...]) -> Camera | None:
        """The best camera that starts lead to: the pose first, then the lens with it."""
        leading = replace(self.lens, minor=False, axis=False)
        tried = [self.approach(start, wide, KNOWN_LENS) for start in starts]
        tried = sorted((found for found in tried if found is not None), key=self.cost)
        best, least = None, np.inf
        for k, near in enumerate(tried):
            # Clicks that are off may favour starts that lead astray: then others are tried.
            if k >= (FEW_STARTS if least < SURE_COST else MOST_STARTS):
                break
            bent = self.approach(near, (6.0,), leading)
            for start in (bent, near) if k == 0 else (bent,):
                end = None if start is None else self.approach(start, NARROW_PX, self.lens)
                if end is not None and self.cost(end) < least:
                    best, least = end, self.cost(end)
        return best

    def approach(
        self, camera: Camera, searches: tuple[float, ...], lens: FreeLens
    ) -> Camera | None:
        """Read the marks and fit the camera, once for every search radius."""
        for search in searches:
            wide = search > NARROW_PX[0] and not lens.count
            readings = self.read(camera, search, only_strong=wide)
            if len(readings.index) < MIN_READINGS // (2 if wide else 1):
                return None
            camera = self.fitted(camera, readings, lens, max(search / 3, 0.5)).camera
            if not np.isfinite(camera.translation).all() or camera.position[2] < 0.3:
                return None
        return camera

    def read(
        self, camera: Camera, search_px: float, *, only_strong: bool = False
    ) -> MarkingMeasurements:
        return measure_markings(
            self.grey, self.origin, camera, self.marks, search_px, only_strong=only_strong
        )

    def cost(self, camera: Camera) -> float:
        """Mean over the visible marks of the squared miss, at most 9 px² each."""
        readings = self.read(camera, 3.0)
        if len(readings.index) < MIN_READINGS:
            return 9.0
        squares = np.minimum(readings.offset_px**2, 9.0).sum()
        return float(
            (squares + 9.0 * (readings.expected - len(readings.index))) / readings.expected
        )

    def fitted(
        self,
        camera: Camera,
        readings: MarkingMeasurements,
        lens: FreeLens,
        scale_px: float,
    ) -> Fitted:
        """Levenberg-Marquardt on fixed readings.

        Parameters
        ----------
        camera : that the readings were made with
        scale_px : of what agrees, at most
        """
        points = _on_ice(self.marks.xy[readings.index])
        clicked = _on_ice(self.sheet_points)
        target = camera.project(points) + readings.offset_px[:, None] * readings.normal_px
        marks, clicks = len(points), 2 * len(clicked)

        def misses(camera: Camera, rim: float) -> Floats:
            """Of readings [px], of clicks, and of what is known beforehand [standard errors]."""
            off = np.sum((target - camera.project(points)) * readings.normal_px, axis=1)
            slips = (self.points_px - camera.project(clicked)).ravel() / CLICK_PX
            middle, spread = self.height
            rise = np.log(middle / max(camera.position[2], 1e-3)) / spread if lens.focal else 0.0
            return np.r_[off - rim * outward, slips, -lens.prior_residuals(camera.lens), rise, -rim]

        def loss(off: Floats, cut: float, sigma2: float) -> float:
            seen, hand = off[:marks] ** 2, off[marks : marks + clicks] ** 2
            told = np.sum(seen / (1 + seen / cut)) / sigma2
            # A click may be a slip: it pulls no harder than a few standard errors.
            told += np.sum(9 * np.log1p(hand / 9)) + np.sum(off[marks + clicks :] ** 2)
            return float(told)

        # How far the rim's paint is off is found beside the camera, and forgotten.
        outward = self._outward(camera, points, readings) if lens.bends else np.zeros(marks)
        rim, count = 0.0, 6 + lens.count
        now = misses(camera, rim)
        damping = 0.0
        covariance = np.full((count + 1, count + 1), np.nan)
        pulls = np.zeros((count + 1, 0))
        scale = scale_px
        for _ in range(ROUNDS):
            jacobian = np.zeros((len(now), count + 1))
            for p in range(count):
                beside = camera.moved(STEP * np.eye(count)[p], lens)
                jacobian[:, p] = (misses(beside, rim) - now) / -STEP
            jacobian[:marks, -1], jacobian[-1, -1] = outward, 1.0
            scale = max(
                min(scale_px, 2 * 1.4826 * float(np.median(np.abs(now[:marks])))),
                self.least_scale_px,
            )
            sigma2 = (MARK_PX**2 + scale**2 / 4) * self.correlation
            cut = (OUTLIER * scale) ** 2
            weight = np.ones(len(now))
            weight[:marks] = 1 / (1 + now[:marks] ** 2 / cut) ** 2 / sigma2
            weight[marks : marks + clicks] = 1 / (1 + now[marks : marks + clicks] ** 2 / 9)
            normal = (jacobian * weight[:, None]).T @ jacobian
            unit = np.sqrt(np.diag(normal))
            normal /= np.outer(unit, unit)
            covariance = np.linalg.pinv(normal, rcond=1e-12) / np.outer(unit, unit)
            pulls = (jacobian[:marks] * weight[:marks, None]).T @ self._laid(camera, readings)
            right = jacobian.T @ (weight * now) / unit
            before = loss(now, cut, sigma2)
            for _ in range(8):
                damped = normal + damping * np.eye(count + 1)
                delta = np.linalg.pinv(damped, rcond=1e-12) @ right / unit
                after = camera.moved(delta[:-1], lens)
                found = misses(after, rim + delta[-1])
                if np.isfinite(found).all() and loss(found, cut, sigma2) <= before:
                    break
                damping = max(10 * damping, 1e-5)
            else:
                break
            camera, rim, now, damping = after, rim + delta[-1], found, damping / 10
            if np.abs(delta * unit).max() < 0.01:
                break
        together = covariance @ pulls
        even = max(2 * MARK_PX, self.least_scale_px)
        return Fitted(
            camera=camera,
            covariance=(covariance + together @ together.T)[:count, :count],
            left_px=now[:marks],
            agrees=np.abs(now[:marks]) < OUTLIER * scale,
            misfit=loss(now, (OUTLIER * even) ** 2, even**2 * self.correlation)
            + (readings.expected - marks) * OUTLIER**2 / self.correlation,
        )

    def _outward(self, camera: Camera, points: Floats, readings: MarkingMeasurements) -> Floats:
        """How far each reading is off where the rim's paint is, (n,) [px]; see `RIM_PX`."""
        seen = camera.project(points) - camera.lens.matrix[:2, 2]
        away = np.linalg.norm(seen, axis=1)
        squeeze = camera.lens.squeeze(camera.local(points))
        outward = np.sum(seen / np.maximum(away, 1.0)[:, None] * readings.normal_px, axis=1)
        return RIM_PX * (2 * squeeze) ** SQUEEZE_POWER * outward

    def _laid(self, camera: Camera, readings: MarkingMeasurements) -> Floats:
        """How far each reading is off [px] where one painted curve is, (n, curves)."""
        marks = self.marks
        xy, normal = marks.xy[readings.index], marks.normal[readings.index]
        across = camera.project(_on_ice(xy + LAID * normal)) - camera.project(_on_ice(xy))
        off = np.sum(across * readings.normal_px, axis=1)
        line = marks.width[readings.index] > 0
        line |= marks.of("border")[readings.index]
        end, side = np.sign(xy[:, 1]), np.sign(xy[:, 0])
        along = np.abs(normal[:, 0]) > 0.5
        # A line along the sheet is one from end to end, and there is one on either side.
        place = np.where(line & along, 2 * side, np.where(line, 4 * end, end))
        _, own = np.unique(
            np.column_stack([marks.curve[readings.index], place, line & along]),
            axis=0,
            return_inverse=True,
        )
        own = own.ravel()
        pulled = np.zeros((len(xy), int(own.max()) + 1))
        pulled[np.arange(len(xy)), own] = off
        return pulled


def _on_ice(xy: Floats) -> Floats:
    return np.column_stack([xy, np.zeros(len(xy))])
