"""From marks a hand made to a camera that the paint on the ice agrees with.

Corners are clicked to a few pixels, which at the far end of a sheet is metres; rings, hog lines and
the border are seen in hundreds of places to a tenth of a pixel. The pose is fitted to those, from a
wide search to a narrow one, and with it what is not known of the lens: the focal length and the two
leading terms of its distortion.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from friction_estimation.calibration import poses_from_points
from friction_estimation.camera import NO_DISTORTION, Camera, intrinsics
from friction_estimation.landmarks import Marks, Readings, brightness, marks_of, read_marks
from friction_estimation.scene import Scene

Floats = NDArray[np.float64]
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
"""Readings are never taken to agree better than this [px]."""
PAINT_PX = 1.5
PAINT_CORRELATION = 24.0
"""The same where the paint itself, laid to a centimetre or so, is less exact than its readings."""
WIDE_PX = (10.0, 6.0)
FARTHER_PX = (24.0, 14.0, 8.0, 6.0)
"""The wide search where the first did not find most of the marks."""
UNSURE_COST = 1.5
"""From this mean squared miss on [px²], of which a mark that is not found counts 9, it is tried."""
NARROW_PX = (4.0, 3.0, 2.0, 2.0, 2.0)
"""Search in each round, first for hog lines and border, then for all marks [px]."""
WIDEST_PX = (16.0, 10.0, 6.0)
"""The wide search where the lens is unknown [px]."""
MIN_READINGS = 60
"""Fewer readings do not outweigh what was clicked."""
MIN_SHARE = 0.25
"""Of the marks that should be seen; fewer found are chance."""
DOUBTFUL_PX = 0.35
DOUBTFUL_SHARE = 0.75
"""Fewer marks than this share, and those met no better than that, is a fit to the wrong paint."""
FOCALS = (0.35, 0.6, 1.0, 1.7)
"""Focal lengths tried where the points cannot tell, in the longer sides of the image."""
BENDS = (-0.3, -0.22, -0.15, -0.09, -0.04, 0.0, 0.05)
"""Distortions tried: share by which the longer side's end is moved."""
CAMERA_HEIGHT = (8.0, 0.5)
"""Median height of rink cameras [m] and its spread (in log): halls, galleries and tripods. It
decides only where the paint cannot, as for a camera that looks straight down."""
MEASURED_HEIGHT = 0.01
"""Standard error of a camera's height that somebody measured, in log."""
BEND_SPREAD = 0.3
"""How far lenses bend the image's side, as a share."""
MIDDLE_SPREAD = 0.2
"""How far from its middle the axis of a cut picture may lie, in halves of its longer side."""
ASPECT_SPREAD = 0.06
"""How far a picture may be stretched, in log."""
AS_GOOD = 1.02
"""Two cameras whose costs differ by less than this factor agree with the paint equally well: of
points that were marked exactly, nothing is left to improve."""
OUTLIER = 3.0
ROUNDS = 12
STEP = 1e-5
"""Of each free parameter, for its derivative."""


@dataclass(frozen=True, kw_only=True)
class FreeLens:
    """What of a lens is not known.

    Parameters
    ----------
    focal : the focal length
    bends : the two leading terms of the distortion
    frame : where the axis meets the picture, and how far the picture was stretched: of pictures
        that were cut out of others, as those of club cameras often are
    """

    focal: bool = False
    bends: bool = False
    frame: bool = False

    @property
    def count(self) -> int:
        """Number of free parameters of the lens."""
        return self.focal + 2 * self.bends + 3 * self.frame

    def changes(self, delta: Floats) -> tuple[float, Floats, Floats]:
        """The log focal length, the bends (2,) and the frame (3,) out of a step; 0 where fixed."""
        focal, bends, frame = 0.0, np.zeros(2), np.zeros(3)
        if len(delta):
            if self.focal:
                focal = float(delta[0])
            if self.bends:
                bends = delta[self.focal : self.focal + 2]
            if self.frame:
                frame = delta[-3:]
        return focal, bends, frame

    def known(self, camera: Camera) -> tuple[Floats, Floats]:
        """Where the lens stands in what lenses are like: values and their weights, (count,)."""
        values, weights = np.zeros(self.count), np.zeros(self.count)
        half = _half(camera)
        if self.bends:
            at = slice(self.focal, self.focal + 2)
            values[at], weights[at] = _bends(camera), BEND_SPREAD**-2
        if self.frame:
            middle = np.array(camera.size) / 2
            values[-3:-1] = (camera.matrix[:2, 2] - middle) / half
            values[-1] = np.log(camera.matrix[1, 1] / camera.matrix[0, 0])
            weights[-3:] = [MIDDLE_SPREAD**-2, MIDDLE_SPREAD**-2, ASPECT_SPREAD**-2]
        return values, weights


KNOWN_LENS = FreeLens()


@dataclass(frozen=True, kw_only=True, eq=False)
class Refined:
    """A camera, and how well the paint on the ice agrees with it.

    Parameters
    ----------
    camera : refined, or as it was where the marks do not improve on it
    readings : number of readings of marks that it was fitted to; 0 where it is as it was
    rms_px : of these readings [px]
    before_px : of the same readings with the camera as it was [px]
    covariance : (m, m) of the free parameters: turn about the camera's axes [rad], shift in the
        camera's frame [m], and what was unknown of the lens
    lens : what of the lens was fitted
    farther : a camera that the paint agrees with as well, a standard error of its height away,
        where something other than paint told the height
    """

    camera: Camera
    readings: int
    rms_px: float
    before_px: float
    covariance: Floats
    lens: FreeLens
    farther: Camera | None = None

    @property
    def log_focal_sigma(self) -> float:
        """Standard error of the logarithm of the focal length; 0 where it was given."""
        return float(np.sqrt(self.covariance[6, 6])) if self.lens.focal else 0.0

    def moved(self, parameter: int, step: float) -> Camera:
        """The camera with one free parameter changed."""
        delta = np.zeros(len(self.covariance))
        delta[parameter] = step
        return _moved(self.camera, delta, self.lens)


def refine(
    camera: Camera,
    scene: Scene,
    image: NDArray[np.uint8] | NDArray[np.float32],
    origin_px: tuple[int, int] = (0, 0),
) -> Refined:
    """The camera under which the painted marks fall where they are seen.

    Parameters
    ----------
    camera : from the scene's points alone
    scene : tells which part of the lens is known
    image : (rows, columns, 3) BGR, best without what moves; may be a part of the frame
    origin_px : column and row of the image's upper left pixel in the frame
    """
    lens = FreeLens(focal=scene.camera_matrix is None, bends=scene.distortion is None)
    fit = _Fit(
        grey=brightness(image),
        origin=origin_px,
        marks=marks_of(scene.sheet),
        sheet_points=scene.sheet_points,
        points_px=scene.points_px,
        lens=lens,
    )
    if lens.count:
        best = fit.from_starts(_starts(camera, scene, lens.focal), WIDEST_PX)
    else:
        best = fit.approach(camera, (*WIDE_PX, *NARROW_PX), free=False)
        if best is None or fit.cost(best) > UNSURE_COST:
            farther = fit.approach(camera, (*FARTHER_PX, *NARROW_PX), free=False)
            found = [c for c in (best, farther) if c is not None]
            best = min(found, key=fit.cost, default=None)
    return fit.judged(camera, best)


def refine_from(
    starts: Sequence[Camera],
    sheet_points: Floats,
    points_px: Floats,
    image: NDArray[np.uint8] | NDArray[np.float32],
    marks: Marks,
    lens: FreeLens,
    *,
    height: float | None = None,
) -> Refined | None:
    """The camera that the paint agrees with best, from several rough guesses.

    Parameters
    ----------
    starts : the guesses
    sheet_points, points_px : (n, 2) what was marked by hand, on the ice [m] and in the image [px]
    marks : the paint to look for
    lens : what of it is to be found
    height : of the camera, where it was measured [m]

    Returns
    -------
    None where the paint agrees with none of them
    """
    fit = _Fit(
        grey=brightness(image),
        origin=(0, 0),
        marks=marks,
        sheet_points=sheet_points,
        points_px=points_px,
        lens=lens,
        height=CAMERA_HEIGHT if height is None else (height, MEASURED_HEIGHT),
        correlation=PAINT_CORRELATION,
        least_scale_px=PAINT_PX,
    )
    near = [fit.approach(start, (6.0, *NARROW_PX), free=True) for start in starts]
    best = min((camera for camera in near if camera is not None), key=fit.cost, default=None)
    if best is None:
        return None
    found = fit.judged(starts[0], best)
    return found if found.readings else None


def at_focal(
    refined: Refined,
    scene: Scene,
    image: NDArray[np.uint8] | NDArray[np.float32],
    origin_px: tuple[int, int],
    log_change: float,
) -> Refined | None:
    """The camera with another focal length under which the marks still fall where they are seen.

    Parameters
    ----------
    refined : with a focal length that the marks do not fix
    log_change : of the focal length, natural logarithm

    Returns
    -------
    None where the marks contradict
    """
    drift = refined.covariance[:, 6] / refined.covariance[6, 6]
    camera = refined.camera
    steps = max(1, int(np.ceil(abs(log_change) / 0.1)))
    for _ in range(steps):  # the marks are followed round the bend in small steps
        camera = _moved(camera, drift * log_change / steps, refined.lens)
    fit = _Fit(
        grey=brightness(image),
        origin=origin_px,
        marks=marks_of(scene.sheet),
        sheet_points=scene.sheet_points,
        points_px=scene.points_px,
        lens=replace(refined.lens, focal=False),
    )
    found = fit.approach(camera, NARROW_PX, free=True)
    if found is None:
        return None
    readings = fit.read(found, 2.0)
    found, covariance, miss = fit.fitted(found, readings, True, 0.5)
    return replace(
        refined,
        camera=found,
        covariance=covariance,
        readings=len(miss),
        rms_px=float(np.sqrt(np.mean(miss**2))),
        lens=fit.lens,
    )


def log_height_prior(camera: Camera) -> float:
    """How unlikely a camera's height is: squared standard deviations from the middle of halls'."""
    middle, spread = CAMERA_HEIGHT
    return float((np.log(camera.position[2] / middle) / spread) ** 2)


def unrefined(camera: Camera) -> Refined:
    """A camera that no mark was read for."""
    return Refined(
        camera=camera,
        readings=0,
        rms_px=np.nan,
        before_px=np.nan,
        covariance=np.zeros((6, 6)),
        lens=KNOWN_LENS,
    )


def _starts(camera: Camera, scene: Scene, free_focal: bool) -> list[Camera]:
    """Cameras to begin with where the lens is unknown."""
    width = max(camera.size)
    focals = [camera.matrix[0, 0]]
    if free_focal:
        focals += [share * width for share in FOCALS]
    bends = BENDS if scene.distortion is None else (None,)
    starts: list[Camera] = []
    for focal in focals:
        matrix = intrinsics(focal, camera.size) if free_focal else camera.matrix
        for bend in bends:
            distortion = camera.distortion
            if bend is not None:
                distortion = NO_DISTORTION.copy()
                distortion[0] = bend * (2 * matrix[0, 0] / width) ** 2
            for pose in poses_from_points(scene.sheet_points, scene.points_px, matrix, distortion)[
                :1
            ]:
                if pose.rms_px < 0.02 * width:
                    starts.append(
                        replace(
                            camera,
                            matrix=matrix,
                            distortion=distortion,
                            rotation=pose.rotation,
                            translation=pose.translation,
                        )
                    )
    return starts


def _half(camera: Camera) -> float:
    """Half of the picture's longer side [px]: where distortion is told as a share."""
    return max(camera.size) / 2


def _bends(camera: Camera) -> Floats:
    """By what share the two terms of the distortion move the longer side's end, (2,)."""
    return camera.distortion[:2] * (_half(camera) / camera.matrix[0, 0]) ** np.array([2, 4])


def _moved(camera: Camera, delta: Floats, lens: FreeLens) -> Camera:
    """A camera with its free parameters changed; see `Refined`. A step of six moves it only."""
    log_focal, bends, frame = lens.changes(delta[6:])
    matrix, distortion, translation = camera.matrix, camera.distortion, camera.translation
    if len(delta) > 6:
        bent = _bends(camera) + bends
        matrix = matrix.copy()
        matrix[[0, 1], [0, 1]] *= np.exp(log_focal)
        matrix[1, 1] *= np.exp(frame[2])
        matrix[:2, 2] += frame[:2] * _half(camera)
        # What the image shows of the distortion stays as it is when the focal length changes.
        distortion = distortion.copy()
        distortion[:2] = bent / (_half(camera) / matrix[0, 0]) ** np.array([2, 4])
        # A longer lens further away shows nearly the same.
        translation = translation + (np.exp(log_focal) - 1) * np.array([0.0, 0.0, translation[2]])
    return replace(
        camera,
        matrix=matrix,
        distortion=distortion,
        rotation=cv2.Rodrigues(delta[:3])[0] @ camera.rotation,
        translation=translation + delta[3:6],
    )


@dataclass(frozen=True, kw_only=True, eq=False)
class _Fit:
    grey: Grey
    origin: tuple[int, int]
    marks: Marks
    sheet_points: Floats
    points_px: Floats
    lens: FreeLens
    height: tuple[float, float] = CAMERA_HEIGHT
    correlation: float = MARK_CORRELATION
    least_scale_px: float = LEAST_SCALE_PX

    def from_starts(self, starts: Sequence[Camera], wide: tuple[float, ...]) -> Camera | None:
        """The best camera that starts lead to: the pose first, then the lens with it."""
        tried = [self.approach(start, wide, free=False) for start in starts]
        tried = sorted((found for found in tried if found is not None), key=self.cost)
        found = [self.approach(start, (6.0,), free=True) for start in tried[:4]]
        ends = [self.approach(c, NARROW_PX, free=True) for c in found if c is not None]
        ends += [self.approach(tried[0], NARROW_PX, free=True)] if tried else []
        return min((end for end in ends if end is not None), key=self.cost, default=None)

    def approach(self, camera: Camera, searches: tuple[float, ...], *, free: bool) -> Camera | None:
        """Read the marks and fit the camera, once for every search radius."""
        for search in searches:
            wide = search > NARROW_PX[0] and not free
            readings = self.read(camera, search, only_strong=wide)
            if len(readings.index) < MIN_READINGS // (2 if wide else 1):
                return None
            camera = self.fitted(camera, readings, free, max(search / 3, 0.5))[0]
            if not np.isfinite(camera.translation).all() or camera.position[2] < 0.3:
                return None
        return camera

    def read(self, camera: Camera, search_px: float, *, only_strong: bool = False) -> Readings:
        return read_marks(
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
        self, camera: Camera, readings: Readings, free: bool, scale_px: float
    ) -> tuple[Camera, Floats, Floats]:
        """Levenberg-Marquardt on fixed readings.

        Returns
        -------
        the camera, its covariance, and the misses left of the readings that agree [px]
        """
        lens = self.lens if free else KNOWN_LENS
        points = np.column_stack([self.marks.xy[readings.index], np.zeros(len(readings.index))])
        clicked = np.column_stack([self.sheet_points, np.zeros(len(self.points_px))])
        target = camera.project(points) + readings.offset_px[:, None] * readings.normal_px
        marks, clicks = len(points), 2 * len(clicked)

        def misses(camera: Camera) -> Floats:
            """Of readings [px], of clicks, and of what is known beforehand [standard errors]."""
            off = np.sum((target - camera.project(points)) * readings.normal_px, axis=1)
            slips = (self.points_px - camera.project(clicked)).ravel() / CLICK_PX
            values, weights = lens.known(camera)
            middle, spread = self.height
            rise = np.log(middle / max(camera.position[2], 1e-3)) / spread if lens.focal else 0.0
            return np.r_[off, slips, -values * np.sqrt(weights), rise]

        now = misses(camera)
        damping, count = 0.0, 6 + lens.count
        covariance = np.full((count, count), np.nan)
        pulls = np.zeros((count, 0))
        scale = scale_px
        for _ in range(ROUNDS):
            jacobian = np.empty((len(now), count))
            for p in range(count):
                jacobian[:, p] = (
                    misses(_moved(camera, STEP * np.eye(count)[p], lens)) - now
                ) / -STEP
            scale = max(
                min(scale_px, 2 * 1.4826 * float(np.median(np.abs(now[:marks])))),
                self.least_scale_px,
            )
            sigma2 = (MARK_PX**2 + scale**2 / 4) * self.correlation
            cut = (OUTLIER * scale) ** 2

            def loss(off: Floats, cut: float = cut, sigma2: float = sigma2) -> float:
                seen, hand = off[:marks] ** 2, off[marks : marks + clicks] ** 2
                told = np.sum(seen / (1 + seen / cut)) / sigma2
                # A click may be a slip: it pulls no harder than a few standard errors.
                told += np.sum(9 * np.log1p(hand / 9)) + np.sum(off[marks + clicks :] ** 2)
                return float(told)

            weight = np.ones(len(now))
            weight[:marks] = 1 / (1 + now[:marks] ** 2 / cut) ** 2 / sigma2
            weight[marks : marks + clicks] = 1 / (1 + now[marks : marks + clicks] ** 2 / 9)
            normal = (jacobian * weight[:, None]).T @ jacobian
            unit = np.sqrt(np.diag(normal))
            normal /= np.outer(unit, unit)
            covariance = np.linalg.pinv(normal, rcond=1e-12) / np.outer(unit, unit)
            pulls = (jacobian[:marks] * weight[:marks, None]).T @ self._laid(camera, readings)
            right = jacobian.T @ (weight * now) / unit
            before = loss(now)
            for _ in range(8):
                delta = np.linalg.pinv(normal + damping * np.eye(count), rcond=1e-12) @ right / unit
                after = _moved(camera, delta, lens)
                found = misses(after)
                if np.isfinite(found).all() and loss(found) <= before:
                    break
                damping = max(10 * damping, 1e-5)
            else:
                break
            camera, now, damping = after, found, damping / 10
            if np.abs(delta * unit).max() < 0.01:
                break
        left = now[:marks]
        together = covariance @ pulls
        covariance = covariance + together @ together.T
        return camera, covariance, left[np.abs(left) < OUTLIER * scale]

    def _laid(self, camera: Camera, readings: Readings) -> Floats:
        """How far each reading is off [px] where one painted curve is, (n, curves)."""
        marks = self.marks
        xy, normal = marks.xy[readings.index], marks.normal[readings.index]
        on_ice = np.column_stack([xy, np.zeros(len(xy))])
        across = np.column_stack([xy + LAID * normal, np.zeros(len(xy))])
        off = np.sum((camera.project(across) - camera.project(on_ice)) * readings.normal_px, axis=1)
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

    def judged(self, before: Camera, after: Camera | None) -> Refined:
        """The better one of two cameras by what the marks say."""
        given = unrefined(before)
        if after is None:
            return given
        readings = self.read(after, 2.0)
        if len(readings.index) < max(MIN_READINGS, MIN_SHARE * readings.expected):
            return given
        if self.cost(after) > AS_GOOD * self.cost(before):
            return given
        camera, covariance, miss = self.fitted(after, readings, True, 0.5)
        rms_px = float(np.sqrt(np.mean(miss**2)))
        if rms_px > DOUBTFUL_PX and len(miss) < DOUBTFUL_SHARE * readings.expected:
            return given
        return Refined(
            camera=camera,
            readings=len(miss),
            rms_px=rms_px,
            before_px=float(np.sqrt(self.cost(before))),
            covariance=covariance,
            lens=self.lens,
        )
