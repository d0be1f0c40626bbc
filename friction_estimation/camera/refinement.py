"""From points marked by hand to a camera that the painted lines agree with.

Corners are marked to a few pixels, which is metres at the far end of a sheet; rings, hog lines and
the border are seen in hundreds of points to a tenth of a pixel. The pose is fitted to those, from a
wide search to a narrow one, and with it the unknown parts of the lens.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from curling_env.typing import Floats, Image, Singles
from friction_estimation.camera.camera import Camera
from friction_estimation.camera.lens import KNOWN_LENS, TRIAL_BENDS, TRIAL_FOCALS, FreeLens, Lens
from friction_estimation.camera.markings import Markings, grey_levels, markings_of
from friction_estimation.camera.markings_fit import FittedCamera, MarkingsFit
from friction_estimation.camera.pose import poses_from_points
from friction_estimation.camera.scene import Scene
from friction_estimation.camera.tuning import (
    CAMERA_HEIGHT_PRIOR,
    DISPLACED_SEARCH_PX,
    DOUBTFUL_COST,
    EQUAL_COST_RATIO,
    FOCAL_PRIOR,
    MEASURED_HEIGHT_SIGMA,
    MIN_MARKINGS,
    MIN_MARKINGS_SHARE,
    NARROW_SEARCHES_PX,
    PHOTO_CORRELATION,
    PHOTO_MIN_SCALE_PX,
    PHOTO_SEARCH_PX,
    UNKNOWN_LENS_SEARCHES_PX,
    WIDE_SEARCHES_PX,
    WIDER_SEARCHES_PX,
    WRONG_PAINT_RMS_PX,
    WRONG_PAINT_SHARE,
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
        only where something other than the paint told the height
    """

    camera: Camera
    measured: int
    rms_px: float
    before_px: float
    covariance: Floats
    lens: FreeLens
    misfit: float = 0.0
    farther: Camera | None = None

    @property
    def log_focal_sigma(self) -> float:
        """Standard error of the logarithm of the focal length; 0 where it was given."""
        return float(np.sqrt(self.covariance[6, 6])) if self.lens.focal else 0.0

    @property
    def height_doubt(self) -> float:
        """Standard error of the log height that pictures of stones told; 0 where they did not."""
        if self.farther is None:
            return 0.0
        return abs(float(np.log(self.farther.position[2] / self.camera.position[2])))

    def moved(self, parameter: int, step: float) -> Camera:
        """The camera with one free parameter changed."""
        delta = np.zeros(len(self.covariance))
        delta[parameter] = step
        return self.camera.moved(delta, self.lens)


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
    fit = _fit_to(scene, image, origin_px, lens)
    if lens.count:
        starts = _starts(camera, scene, free_focal=lens.focal)
        best = fit.from_starts(starts, UNKNOWN_LENS_SEARCHES_PX)
    else:
        best = fit.approach(camera, (*WIDE_SEARCHES_PX, *NARROW_SEARCHES_PX), KNOWN_LENS)
        if best is None or fit.cost(best) > DOUBTFUL_COST:
            wider = fit.approach(camera, (*WIDER_SEARCHES_PX, *NARROW_SEARCHES_PX), KNOWN_LENS)
            found = [c for c in (best, wider) if c is not None]
            best = min(found, key=fit.cost, default=None)
    return _better(fit, camera, best)


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
    fit = _fit_to(scene, image, origin_px, refined.lens)
    near = fit.approach(refined.camera, NARROW_SEARCHES_PX, refined.lens)
    found = _better(fit, refined.camera, near)
    return found if found.measured else refined


def displacement(
    refined: RefinedCamera, scene: Scene, image: Image | Singles, origin_px: tuple[int, int]
) -> float:
    """How far the paint in a picture is from where a camera sees it [px].

    Infinite where less than half of the paint is near there that the camera was fitted to.

    Parameters
    ----------
    refined : the camera
    scene, image, origin_px : as in `refine`
    """
    fit = _fit_to(scene, image, origin_px, KNOWN_LENS)
    measured = fit.measure(refined.camera, DISPLACED_SEARCH_PX)
    if len(measured.index) < max(MIN_MARKINGS, 0.5 * refined.measured):
        return float(np.inf)
    # Across a line that moves along itself nothing is seen to move; most do not.
    return float(np.sqrt(2 * np.median(measured.offset_px**2)))


def refine_from(
    starts: Sequence[Camera],
    sheet_points: Floats,
    points_px: Floats,
    image: Image | Singles,
    markings: Markings,
    lens: FreeLens,
    *,
    height: float | None = None,
) -> RefinedCamera | None:
    """The camera that the paint agrees with best, from several rough guesses.

    Parameters
    ----------
    starts : the guesses
    sheet_points, points_px : (n, 2) what was marked by hand, on the ice [m] and in the image [px]
    image : (rows, columns, 3) BGR
    markings : the paint to look for
    lens : the unknown parts of the lens
    height : the camera's height [m], if it was measured

    Returns
    -------
    None where the paint agrees with none of them
    """
    fit = MarkingsFit(
        grey=grey_levels(image),
        origin=(0, 0),
        markings=markings,
        sheet_points=sheet_points,
        points_px=points_px,
        lens=lens,
        height=height_prior(height),
        correlation=PHOTO_CORRELATION,
        min_scale_px=PHOTO_MIN_SCALE_PX,
    )
    near = [fit.approach(start, (PHOTO_SEARCH_PX, *NARROW_SEARCHES_PX), lens) for start in starts]
    best = min((camera for camera in near if camera is not None), key=fit.cost, default=None)
    if best is None:
        return None
    found = _better(fit, starts[0], best)
    return found if found.measured else None


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
    camera = refined.camera
    steps = max(1, int(np.ceil(abs(log_change) / 0.1)))
    for _ in range(steps):  # in small steps, because the other parameters follow along a curve
        camera = camera.moved(drift * log_change / steps, refined.lens)
    fit = _fit_to(scene, image, origin_px, replace(refined.lens, focal=False))
    found = fit.approach(camera, NARROW_SEARCHES_PX, fit.lens)
    if found is None:
        return None
    measured = fit.measure(found, 2.0)
    fitted = fit.fit(found, measured, fit.lens, 0.5)
    return _judged(replace(refined, camera=fitted.camera), fit, fitted)


def height_prior(measured: float | None) -> tuple[float, float]:
    """Median of a camera's height [m] and its spread in log; narrow where it was measured."""
    return CAMERA_HEIGHT_PRIOR if measured is None else (measured, MEASURED_HEIGHT_SIGMA)


def log_height_prior(camera: Camera, measured: float | None = None) -> float:
    """How unlikely a camera's height and focal length are [squared standard deviations]."""
    middle, spread = height_prior(measured)
    usual, focal_spread = FOCAL_PRIOR
    focal = camera.lens.focal_px / (0.5 * np.hypot(*camera.size))
    height_off = np.log(camera.position[2] / middle) / spread
    return float(height_off**2 + (np.log(focal / usual) / focal_spread) ** 2)


def unrefined(camera: Camera) -> RefinedCamera:
    """A camera that was not compared with the paint."""
    return RefinedCamera(
        camera=camera,
        measured=0,
        rms_px=np.nan,
        before_px=np.nan,
        covariance=np.zeros((6, 6)),
        lens=KNOWN_LENS,
    )


def _fit_to(
    scene: Scene, image: Image | Singles, origin_px: tuple[int, int], lens: FreeLens
) -> MarkingsFit:
    return MarkingsFit(
        grey=grey_levels(image),
        origin=origin_px,
        markings=markings_of(scene.sheet),
        sheet_points=scene.sheet_points,
        points_px=scene.points_px,
        lens=lens,
        height=height_prior(scene.camera_height),
    )


def _starts(camera: Camera, scene: Scene, *, free_focal: bool) -> list[Camera]:
    """Cameras to begin with where the lens is unknown."""
    side = max(camera.size)
    lenses = [camera.lens]
    if free_focal:
        focals = [camera.lens.focal_px, *(share * side for share in TRIAL_FOCALS)]
        lenses = [Lens.centred(focal, camera.size, camera.lens.distortion) for focal in focals]
    if scene.distortion is None:
        lenses = [lens.bent(bend) for lens in lenses for bend in TRIAL_BENDS]
    starts: list[Camera] = []
    for lens in lenses:
        for pose in poses_from_points(scene.sheet_points, scene.points_px, lens)[:1]:
            if pose.rms_px < 0.02 * side:
                starts.append(
                    Camera(lens=lens, rotation=pose.rotation, translation=pose.translation)
                )
    return starts


def _confirmed(fit: MarkingsFit, given: RefinedCamera) -> RefinedCamera:
    """A camera that the paint cannot improve, and how well the paint determines it.

    Nearly all of the paint must be where it sees it, as it is where points were marked exactly.
    """
    measured = fit.measure(given.camera, 2.0)
    if len(measured.index) < max(MIN_MARKINGS, WRONG_PAINT_SHARE * measured.expected):
        return given
    fitted = fit.fit(given.camera, measured, fit.lens, 0.5)
    if fitted.rms_px > WRONG_PAINT_RMS_PX:
        return given
    return _judged(replace(given, before_px=fitted.rms_px), fit, fitted)


def _judged(refined: RefinedCamera, fit: MarkingsFit, fitted: FittedCamera) -> RefinedCamera:
    """The camera with what a fit to the paint says of how well it is known."""
    return replace(
        refined,
        covariance=fitted.covariance,
        measured=fitted.measured,
        rms_px=fitted.rms_px,
        misfit=fitted.misfit,
        lens=fit.lens,
    )


def _better(fit: MarkingsFit, before: Camera, after: Camera | None) -> RefinedCamera:
    """The one of two cameras that the paint agrees with better."""
    given = unrefined(before)
    if after is None:
        return given
    measured = fit.measure(after, 2.0)
    if len(measured.index) < max(MIN_MARKINGS, MIN_MARKINGS_SHARE * measured.expected):
        return given
    if fit.cost(after) > EQUAL_COST_RATIO * fit.cost(before):
        return _confirmed(fit, given)
    fitted = fit.fit(after, measured, fit.lens, 0.5)
    enough = WRONG_PAINT_SHARE * measured.expected
    if fitted.rms_px > WRONG_PAINT_RMS_PX and fitted.measured < enough:
        return given
    return RefinedCamera(
        camera=fitted.camera,
        measured=fitted.measured,
        rms_px=fitted.rms_px,
        misfit=fitted.misfit,
        before_px=float(np.sqrt(fit.cost(before))),
        covariance=fitted.covariance,
        lens=fit.lens,
    )
