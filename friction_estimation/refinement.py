"""From marks a hand made to a camera that the paint on the ice agrees with.

Corners are clicked to a few pixels, which at the far end of a sheet is metres; rings, hog lines and
the border are seen in hundreds of places to a tenth of a pixel. The pose is fitted to those, from a
wide search to a narrow one, and with it what is not known of the lens: the focal length and the two
leading terms of its distortion.
"""

from __future__ import annotations

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
WIDE_PX = (10.0, 6.0)
NARROW_PX = (4.0, 3.0, 2.0, 2.0, 2.0)
"""Search in each round, first for hog lines and border, then for all marks [px]."""
WIDEST_PX = (16.0, 10.0, 6.0)
"""The wide search where the lens is unknown [px]."""
MIN_READINGS = 60
"""Fewer readings do not outweigh what was clicked."""
MIN_SHARE = 0.25
"""Of the marks that should be seen; fewer found are chance."""
FOCALS = (0.35, 0.6, 1.0, 1.7)
"""Focal lengths tried where the points cannot tell, in image widths."""
BENDS = (-0.3, -0.22, -0.15, -0.09, -0.04, 0.0, 0.05)
"""Distortions tried: share by which the image's side is moved."""
CAMERA_HEIGHT = (8.0, 0.5)
"""Median height of rink cameras [m] and its spread (in log): halls, galleries and tripods. It
decides only where the paint cannot, as for a camera that looks straight down."""
BEND_SPREAD = 0.3
"""How far lenses bend the image's side, as a share."""
OUTLIER = 3.0


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
        camera's frame [m], and, where the lens was unknown, log focal length and two bends
    free_focal, free_bends : what of the lens was fitted
    """

    camera: Camera
    readings: int
    rms_px: float
    before_px: float
    covariance: Floats
    free_focal: bool
    free_bends: bool

    @property
    def log_focal_sigma(self) -> float:
        """Standard error of the logarithm of the focal length; 0 where it was given."""
        return float(np.sqrt(self.covariance[6, 6])) if self.free_focal else 0.0

    def moved(self, parameter: int, step: float) -> Camera:
        """The camera with one free parameter changed."""
        delta = np.zeros(len(self.covariance))
        delta[parameter] = step
        return _moved(self.camera, delta, self.free_focal)


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
    free_focal = scene.camera_matrix is None
    free_bends = scene.distortion is None
    grey = brightness(image)
    fit = _Fit(
        grey=grey,
        origin=origin_px,
        marks=marks_of(scene.sheet),
        scene=scene,
        free_focal=free_focal,
        free_bends=free_bends,
    )
    if free_focal or free_bends:
        starts = _starts(camera, scene, free_focal)
        tried = [fit.approach(start, WIDEST_PX, lens=False) for start in starts]
        tried = [found for found in tried if found is not None]
        tried.sort(key=fit.cost)
        found = [fit.approach(start, (6.0,), lens=True) for start in tried[:4]]
        ends = [fit.approach(c, NARROW_PX, lens=True) for c in found if c is not None]
        ends += [fit.approach(tried[0], NARROW_PX, lens=True)] if tried else []
        ends = [end for end in ends if end is not None]
        best = min(ends, key=fit.cost, default=None)
    else:
        near = fit.approach(camera, WIDE_PX, lens=False)
        best = None if near is None else fit.approach(near, NARROW_PX, lens=False)
    return fit.judged(camera, best)


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
        camera = _moved(camera, drift * log_change / steps, True)
    fit = _Fit(
        grey=brightness(image),
        origin=origin_px,
        marks=marks_of(scene.sheet),
        scene=scene,
        free_focal=False,
        free_bends=refined.free_bends,
    )
    found = fit.approach(camera, NARROW_PX, lens=True)
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
        free_focal=False,
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
        free_focal=False,
        free_bends=False,
    )


def _starts(camera: Camera, scene: Scene, free_focal: bool) -> list[Camera]:
    """Cameras to begin with where the lens is unknown."""
    width = camera.size[0]
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


def _moved(camera: Camera, delta: Floats, free_focal: bool) -> Camera:
    """A camera with its free parameters changed; see `Refined`."""
    matrix, distortion = camera.matrix, camera.distortion
    lens = delta[6:]
    half = camera.size[0] / 2
    bends = lens[1:] if free_focal else lens
    share = distortion[:2] * np.array([half / matrix[0, 0], half / matrix[0, 0]]) ** [2, 4]
    if free_focal and len(lens):
        matrix = matrix.copy()
        matrix[0, 0] *= np.exp(lens[0])
        matrix[1, 1] *= np.exp(lens[0])
    if len(lens):  # what the image shows of the distortion stays as it is when the focal changes
        if len(bends):
            share = share + bends
        distortion = distortion.copy()
        distortion[:2] = share / np.array([half / matrix[0, 0], half / matrix[0, 0]]) ** [2, 4]
    turn = cv2.Rodrigues(delta[:3])[0]
    translation = camera.translation + delta[3:6]
    if free_focal and len(lens):  # a longer lens further away shows nearly the same
        centre = camera.translation
        translation = translation + (np.exp(lens[0]) - 1) * np.array([0.0, 0.0, centre[2]])
    return replace(
        camera,
        matrix=matrix,
        distortion=distortion,
        rotation=turn @ camera.rotation,
        translation=translation,
    )


@dataclass(frozen=True, kw_only=True, eq=False)
class _Fit:
    grey: Grey
    origin: tuple[int, int]
    marks: Marks
    scene: Scene
    free_focal: bool
    free_bends: bool

    def approach(self, camera: Camera, searches: tuple[float, ...], *, lens: bool) -> Camera | None:
        """Read the marks and fit the camera, once for every search radius."""
        for search in searches:
            wide = search > NARROW_PX[0] and not lens
            readings = self.read(camera, search, only_strong=wide)
            if len(readings.index) < MIN_READINGS // (2 if wide else 1):
                return None
            camera = self.fitted(camera, readings, lens, max(search / 3, 0.5))[0]
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
        self, camera: Camera, readings: Readings, lens: bool, scale_px: float
    ) -> tuple[Camera, Floats, Floats]:
        """Gauss-Newton on fixed readings; the camera, its covariance, and the misses left [px]."""
        points = np.column_stack([self.marks.xy[readings.index], np.zeros(len(readings.index))])
        clicked = np.column_stack([self.scene.sheet_points, np.zeros(len(self.scene.points_px))])
        target = camera.project(points) + readings.offset_px[:, None] * readings.normal_px
        count = 6 + (self.free_focal + 2 * self.free_bends if lens else 0)
        free_focal = self.free_focal and lens
        prior = np.zeros(count)
        if lens and self.free_bends:
            prior[-2:] = BEND_SPREAD**-2
        steps = np.full(count, 1e-5)
        covariance = np.full((count, count), np.nan)
        scale = scale_px
        base = np.zeros(count)
        weight = np.ones(len(points))
        miss = np.zeros(len(points))
        for _ in range(6):
            seen, clicks = camera.project(points), camera.project(clicked)
            miss = np.sum((target - seen) * readings.normal_px, axis=1)
            left = (self.scene.points_px - clicks).ravel() / CLICK_PX
            columns, pulls, heights = [], [], []
            for p in range(count):
                delta = np.zeros(count)
                delta[p] = steps[p]
                other = _moved(camera, delta, free_focal)
                change = (other.project(points) - seen) / steps[p]
                heights.append(np.log(other.position[2] / camera.position[2]) / steps[p])
                columns.append(np.sum(change * readings.normal_px, axis=1))
                pulls.append(((other.project(clicked) - clicks) / steps[p]).ravel() / CLICK_PX)
            jacobian, pull = np.column_stack(columns), np.column_stack(pulls)
            scale = max(min(scale_px, 1.4826 * 2 * float(np.median(np.abs(miss)))), 0.1)
            weight = 1 / (1 + (miss / (OUTLIER * scale)) ** 2) ** 2
            sigma2 = (MARK_PX**2 + scale**2 / 4) * MARK_CORRELATION
            # A click may be a slip: it pulls no harder than a few standard errors.
            trust = 1 / (1 + left**2 / 9)
            normal = (jacobian * (weight / sigma2)[:, None]).T @ jacobian
            normal += (pull * trust[:, None]).T @ pull + np.diag(prior)
            right = (jacobian * (weight / sigma2)[:, None]).T @ miss
            right += (pull * trust[:, None]).T @ left - prior * base
            if free_focal:
                middle, spread = CAMERA_HEIGHT
                rise = np.array(heights) / spread
                normal += np.outer(rise, rise)
                right += rise * (np.log(middle) - np.log(camera.position[2])) / spread
            unit = np.sqrt(np.diag(normal))
            covariance = np.linalg.pinv(normal / np.outer(unit, unit), rcond=1e-12)
            covariance = covariance / np.outer(unit, unit)
            delta = covariance @ right
            delta[6:] = np.clip(delta[6:], -0.3, 0.3)
            base = base + delta
            camera = _moved(camera, delta, free_focal)
            if np.abs(delta * unit).max() < 0.01:
                break
        good = np.abs(miss) < OUTLIER * scale
        return camera, covariance, miss[good]

    def judged(self, before: Camera, after: Camera | None) -> Refined:
        """The better one of two cameras by what the marks say."""
        given = unrefined(before)
        if after is None:
            return given
        readings = self.read(after, 2.0)
        if len(readings.index) < max(MIN_READINGS, MIN_SHARE * readings.expected):
            return given
        if self.cost(after) >= self.cost(before):
            return given
        camera, covariance, miss = self.fitted(after, readings, True, 0.5)
        return Refined(
            camera=camera,
            readings=len(miss),
            rms_px=float(np.sqrt(np.mean(miss**2))),
            before_px=float(np.sqrt(self.cost(before))),
            covariance=covariance,
            free_focal=self.free_focal,
            free_bends=self.free_bends,
        )
