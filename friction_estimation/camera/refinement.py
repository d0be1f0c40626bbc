"""From points marked by hand to a camera that the painted lines agree with.

Corners are marked to a few pixels, which is metres at the far end of a sheet; rings, hog lines and
the border are seen in hundreds of points to a tenth of a pixel. The pose is fitted to those, from a
wide search to a narrow one, and with it the unknown parts of the lens. A camera counts as found
only if every ring and line in view is where it puts it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product

import cv2
import numpy as np

from curling_env.typing import Floats, Image, Singles
from friction_estimation.camera.agreement import disagreeing, seen_curves
from friction_estimation.camera.camera import Camera
from friction_estimation.camera.lens import KNOWN_LENS, FreeLens
from friction_estimation.camera.markings import fitted_markings, grey_levels, markings_of
from friction_estimation.camera.paint_fit import FittedCamera, PaintFit
from friction_estimation.camera.pose import cameras_from_points, trial_lenses
from friction_estimation.camera.scene import Scene
from friction_estimation.camera.tuning import (
    CAMERA_HEIGHT_PRIOR,
    DISPLACED_SEARCH_PX,
    EQUAL_COST_RATIO,
    FOCAL_PRIOR,
    MAX_MISFIT,
    MAX_STARTS,
    MEASURED_HEIGHT_SIGMA,
    MIN_MARKINGS,
    MIN_MARKINGS_SHARE,
    MIN_STARTS,
    NARROW_SEARCHES_PX,
    SEARCHED_SIDE,
    WIDE_SEARCHES_PX,
    WORKING_SIDE,
)


@dataclass(frozen=True, kw_only=True, eq=False)
class RefinedCamera:
    """A camera, and how well the paint on the ice agrees with it.

    Parameters
    ----------
    camera : after the fit, or as it was where the paint does not improve on it
    measured : number of points of painted lines that it was fitted to; 0 where it is as it was
    rms_px : root mean square residual of these points [px]
    before_px : the same with the camera as it was [px]
    covariance : (m, m) covariance of the free parameters, see `Camera.moved`
    lens : the parts of the lens that were fitted
    misfit : misfit to the paint and to prior knowledge [squared standard errors]
    farther : a camera that the paint agrees with as well, a standard error of its height away;
        only where the height comes from something other than the paint
    disagreeing : names of rings and lines that are not where it puts them; only where none is
        measured
    """

    camera: Camera
    measured: int = 0
    rms_px: float = np.nan
    before_px: float = np.nan
    covariance: Floats
    lens: FreeLens = KNOWN_LENS
    misfit: float = 0.0
    farther: Camera | None = None
    disagreeing: tuple[str, ...] = ()

    @classmethod
    def of_fit(
        cls, fitted: FittedCamera, lens: FreeLens, before_px: float = np.nan
    ) -> RefinedCamera:
        """A camera that was fitted to the paint."""
        return cls(
            camera=fitted.camera,
            measured=fitted.measured,
            rms_px=fitted.rms_px,
            before_px=before_px,
            covariance=fitted.covariance,
            lens=lens,
            misfit=fitted.misfit,
        )

    @property
    def log_focal_sigma(self) -> float:
        """Standard error of the logarithm of the focal length; 0 where it was given."""
        return float(np.sqrt(self.covariance[6, 6])) if self.lens.focal else 0.0

    @property
    def height_doubt(self) -> float:
        """Standard error of the log height from pictures of stones; 0 without such a height."""
        if self.farther is None:
            return 0.0
        return abs(float(np.log(self.farther.position[2] / self.camera.position[2])))

    def moved(self, parameter: int, step: float) -> Camera:
        """The camera with one free parameter changed."""
        delta = np.zeros(len(self.covariance))
        delta[parameter] = step
        return self.camera.moved(delta, self.lens)

    def place_variance(self, xy: Floats, z: float = 0.0) -> Floats:
        """Variances of both coordinates due to the camera's pose and lens, (n, 2) [m²].

        Parameters
        ----------
        xy : (n, 2) places [m]
        z : their height above the ice [m]
        """
        px = self.camera.project(np.column_stack([xy, np.full(len(xy), z)]))
        count = len(self.covariance)
        moved = np.zeros((len(xy), 2, count))
        if self.measured:
            step = 1e-5
            for p in range(count):
                moved[:, :, p] = (self.moved(p, step).on_plane(px, z) - xy) / step
        variance = np.einsum("nip,pq,niq->ni", moved, self.covariance, moved)
        if self.farther is not None:
            variance += (self.farther.on_plane(px, z) - xy) ** 2
        return variance

    def place_sigma(self, xy: Floats, z: float = 0.0) -> Floats:
        """Standard error of each coordinate due to the camera, (n,) [m]; see `place_variance`."""
        return np.sqrt(self.place_variance(xy, z).mean(axis=1))

    def resized(self, scale: Floats, size: tuple[int, int]) -> RefinedCamera:
        """The same for pictures enlarged along both sides (2,); see `Lens.resized`.

        The free parameters do not depend on the size of the picture.
        """
        factor = float(np.mean(scale))
        return replace(
            self,
            camera=self.camera.resized(scale, size),
            rms_px=factor * self.rms_px,
            before_px=factor * self.before_px,
            farther=None if self.farther is None else self.farther.resized(scale, size),
        )


def refine(
    camera: Camera, scene: Scene, image: Image | Singles, origin_px: tuple[int, int] = (0, 0)
) -> RefinedCamera:
    """The camera that sees the painted lines where they are in an image.

    Parameters
    ----------
    camera : found from the scene's points alone
    scene : tells which part of the lens is known
    image : (rows, columns, 3) BGR, best without what moves; may be a part of the frame
    origin_px : column and row of the image's upper left pixel in the frame
    """
    no_matrix, no_terms = scene.camera_matrix is None, scene.distortion is None
    lens = FreeLens(focal=no_matrix, bends=no_terms, minor=no_terms, axis=no_matrix)
    paint = _Paint(scene, camera.size, image, origin_px, lens)
    fit, small = paint.fit, paint.small(camera)
    best = paint.from_starts(_starts(small, fit))
    return paint.better(camera, best)


def refine_again(
    refined: RefinedCamera, scene: Scene, image: Image | Singles, origin_px: tuple[int, int]
) -> RefinedCamera:
    """The same camera, fitted to another picture of the same paint.

    Parameters
    ----------
    refined : the camera; its free parts of the lens stay free
    scene, image, origin_px : as in `refine`

    Returns
    -------
    The camera as it was, where the picture does not show the paint
    """
    paint = _Paint(scene, refined.camera.size, image, origin_px, refined.lens)
    near = paint.fit.approach(paint.small(refined.camera), NARROW_SEARCHES_PX, refined.lens)
    found = paint.better(refined.camera, near)
    return found if found.measured else refined


def displacement(
    refined: RefinedCamera, scene: Scene, image: Image | Singles, origin_px: tuple[int, int]
) -> float:
    """Distance of the paint in a picture from where a camera sees it [px].

    Infinite where less than half of the paint is near there that the camera was fitted to.

    Parameters
    ----------
    refined : the camera
    scene, image, origin_px : as in `refine`
    """
    paint = _Paint(scene, refined.camera.size, image, origin_px, KNOWN_LENS)
    measured = paint.fit.measure(paint.small(refined.camera), DISPLACED_SEARCH_PX)
    if len(measured.index) < max(MIN_MARKINGS, 0.5 * refined.measured):
        return float(np.inf)
    # Across a line that moves along itself nothing is seen to move; most do not.
    return float(paint.factor * np.sqrt(2 * np.median(measured.offset_px**2)))


def refine_at_focal(
    refined: RefinedCamera,
    scene: Scene,
    image: Image | Singles,
    origin_px: tuple[int, int],
    log_change: float,
) -> RefinedCamera | None:
    """The camera with another focal length that still sees the painted lines where they are.

    Parameters
    ----------
    refined : a camera whose focal length the paint does not fix
    scene, image, origin_px : as in `refine`
    log_change : change of the natural logarithm of the focal length

    Returns
    -------
    None where the paint contradicts it
    """
    drift = refined.covariance[:, 6] / refined.covariance[6, 6]
    fixed = replace(refined.lens, focal=False)
    paint = _Paint(scene, refined.camera.size, image, origin_px, fixed)
    camera = paint.small(refined.camera)
    steps = max(1, int(np.ceil(abs(log_change) / 0.1)))
    for _ in range(steps):  # in small steps, because the other parameters follow along a curve
        camera = camera.moved(drift * log_change / steps, refined.lens)
    found = paint.fit.approach(camera, NARROW_SEARCHES_PX, fixed)
    if found is None:
        return None
    return replace(paint.fitted(found), before_px=refined.before_px)


def height_prior(measured: float | None) -> tuple[float, float]:
    """Median of a camera's height [m] and its spread in log; narrow where it was measured."""
    return CAMERA_HEIGHT_PRIOR if measured is None else (measured, MEASURED_HEIGHT_SIGMA)


def log_height_prior(camera: Camera, measured: float | None = None) -> float:
    """Return the prior cost of a camera's height and focal length [squared standard deviations]."""
    middle, spread = height_prior(measured)
    usual, focal_spread = FOCAL_PRIOR
    focal = camera.lens.focal_px / (0.5 * np.hypot(*camera.size))
    height_off = np.log(camera.position[2] / middle) / spread
    return float(height_off**2 + (np.log(focal / usual) / focal_spread) ** 2)


def unrefined(camera: Camera, disagreeing: tuple[str, ...] = ()) -> RefinedCamera:
    """A camera that was not compared with the paint, or does not agree with it."""
    return RefinedCamera(camera=camera, covariance=np.zeros((6, 6)), disagreeing=disagreeing)


def reduced(
    grey: Singles, origin_px: tuple[int, int], factor: float
) -> tuple[Singles, tuple[int, int], Floats]:
    """A picture or a part of one, made smaller.

    Parameters
    ----------
    grey : grey levels
    origin_px : column and row of its upper left pixel in the whole picture
    factor : how much smaller; a whole number where the origin is not (0, 0)

    Returns
    -------
    the smaller picture, its origin, and the scale along both sides (2,)
    """
    if factor <= 1:
        return grey, origin_px, np.ones(2)
    if any(origin_px):
        step = int(factor)
        left, top = (-start % step for start in origin_px)
        rows, columns = ((n // step) * step for n in (grey.shape[0] - top, grey.shape[1] - left))
        grey = grey[top : top + rows, left : left + columns]
        origin_px = (origin_px[0] + left) // step, (origin_px[1] + top) // step
    rows, columns = grey.shape
    size = round(columns / factor), round(rows / factor)
    small = cv2.resize(grey, size, interpolation=cv2.INTER_AREA)
    return np.asarray(small, dtype=np.float32), origin_px, np.divide(size, (columns, rows))


class _Paint:
    """A picture of the sheet, at most `WORKING_SIDE` large, and the fit of a camera to it.

    Parameters
    ----------
    scene : the points, what is known of the lens, and the sheet
    size : width and height of the whole picture [px]
    image, origin_px : as in `refine`
    lens : the unknown parts of the lens
    """

    def __init__(
        self,
        scene: Scene,
        size: tuple[int, int],
        image: Image | Singles,
        origin_px: tuple[int, int],
        lens: FreeLens,
    ) -> None:
        self.factor = max(1, int(np.ceil(max(size) / WORKING_SIDE)))
        grey, origin, self._scale = reduced(grey_levels(image), origin_px, self.factor)
        self._size, self._small = size, (size[0] // self.factor, size[1] // self.factor)
        self._sheet = scene.sheet
        self.fit = PaintFit(
            grey=grey,
            origin=origin,
            markings=fitted_markings(scene.sheet),
            sheet_points=scene.sheet_points,
            points_px=(scene.for_size(size).points_px + 0.5) * self._scale - 0.5,
            lens=lens,
            height=height_prior(scene.camera_height),
        )

    def small(self, camera: Camera) -> Camera:
        """A camera of the whole picture as that of the smaller one."""
        return camera.resized(self._scale, self._small)

    def from_starts(self, starts: Sequence[Camera]) -> Camera | None:
        """The best camera of the smaller picture that any of several starts leads to.

        Points that were marked in the wrong place may favour starts that lead astray; more starts
        are followed until the paint agrees.
        """
        fit, leading = self.fit, replace(self.fit.lens, minor=False, axis=False)
        best, least = None, (True, np.inf)
        share = min(1.0, max(self._small) / SEARCHED_SIDE)
        for k, (searches, start) in enumerate(product(WIDE_SEARCHES_PX, starts[:MAX_STARTS])):
            if not least[0] and k >= MIN_STARTS:
                break
            near = fit.approach(start, [share * radius for radius in searches], leading)
            end = None if near is None else fit.approach(near, NARROW_SEARCHES_PX, fit.lens)
            if end is None:
                continue
            rank = bool(self.disagreeing(end)), fit.cost(end)
            if rank < least:
                best, least = end, rank
        return best

    def disagreeing(self, camera: Camera) -> tuple[str, ...]:
        """Names of the curves that are not where a camera of the smaller picture puts them."""
        markings = markings_of(self._sheet)
        return disagreeing(seen_curves(camera, self.fit.grey, self.fit.origin, markings))

    def fitted(self, camera: Camera, before: Camera | None = None) -> RefinedCamera:
        """A camera of the smaller picture as that of the whole one, after a last fit."""
        fit, measured = self.fit, self.fit.measure(camera, 2.0)
        before_px = np.nan if before is None else float(np.sqrt(fit.cost(before)))
        fitted = fit.fit(camera, measured, fit.lens, 0.5)
        return RefinedCamera.of_fit(fitted, fit.lens, before_px).resized(
            1 / self._scale, self._size
        )

    def better(self, before: Camera, after: Camera | None) -> RefinedCamera:
        """The one of two cameras that the paint agrees with better.

        Parameters
        ----------
        before, after : a camera of the whole picture, and one of the smaller picture
        """
        fit, small = self.fit, self.small(before)
        if after is None:
            return unrefined(before)
        if fit.cost(after) > EQUAL_COST_RATIO * fit.cost(small):
            after = small  # there is nothing to improve on points that were marked exactly
        measured = fit.measure(after, 2.0)
        if len(measured.index) < max(MIN_MARKINGS, MIN_MARKINGS_SHARE * measured.expected):
            return unrefined(before)
        wrong = self.disagreeing(after)
        if wrong:
            return unrefined(before, wrong)
        found = self.fitted(after, small)
        return replace(found, camera=before) if after is small else found


def _starts(camera: Camera, fit: PaintFit) -> list[Camera]:
    """Cameras to begin with, those that meet the points best first."""
    starts = [
        one
        for lens in trial_lenses(camera.lens, focal=fit.lens.focal, bends=fit.lens.bends)
        for one in cameras_from_points(fit.sheet_points, fit.points_px, lens)[:1]
    ]
    starts.sort(key=lambda one: one[0])
    return [found for rms_px, found in starts if rms_px < MAX_MISFIT * max(camera.size)]
