"""From marks a hand made to a camera that the paint on the ice agrees with.

Corners are clicked to a few pixels, which at the far end of a sheet is metres; rings, hog lines and
the border are seen in hundreds of places to a tenth of a pixel. The pose is fitted to those, from a
wide search to a narrow one, and with it what is not known of the lens: the focal length and its
distortion.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from curling_env.typing import Floats
from friction_estimation.camera.camera import Camera
from friction_estimation.camera.lens import KNOWN_LENS, TRIAL_BENDS, TRIAL_FOCALS, FreeLens, Lens
from friction_estimation.camera.markings import Markings, brightness, markings_of
from friction_estimation.camera.markings_fit import (
    CAMERA_HEIGHT,
    MIN_READINGS,
    NARROW_PX,
    MarkingsFit,
)
from friction_estimation.camera.pose import poses_from_points
from friction_estimation.camera.scene import Scene

PAINT_PX = 1.5
PAINT_CORRELATION = 24.0
"""Where the paint itself, laid to a centimetre or so, is less exact than its readings."""
WIDE_PX = (10.0, 6.0)
FARTHER_PX = (24.0, 14.0, 8.0, 6.0)
"""The wide search where the first did not find most of the marks."""
UNSURE_COST = 1.5
"""From this mean squared miss on [px²], of which a mark that is not found counts 9, it is tried."""
WIDEST_PX = (16.0, 10.0, 6.0)
"""The wide search where the lens is unknown [px]."""
MIN_SHARE = 0.25
"""Of the marks that should be seen; fewer found are chance."""
DOUBTFUL_PX = 0.35
DOUBTFUL_SHARE = 0.75
"""Fewer marks than this share, and those met no better than that, is a fit to the wrong paint."""
AS_GOOD = 1.02
"""Two cameras whose costs differ by less than this factor agree with the paint equally well: of
points that were marked exactly, nothing is left to improve."""
MEASURED_HEIGHT = 0.01
"""Standard error of a camera's height that somebody measured, in log."""


@dataclass(frozen=True, kw_only=True, eq=False)
class RefinedCamera:
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
    misfit : to the paint and to what was known before [squared standard errors]
    farther : a camera that the paint agrees with as well, a standard error of its height away,
        where something other than paint told the height
    """

    camera: Camera
    readings: int
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

    def moved(self, parameter: int, step: float) -> Camera:
        """The camera with one free parameter changed."""
        delta = np.zeros(len(self.covariance))
        delta[parameter] = step
        return self.camera.moved(delta, self.lens)


def refine(
    camera: Camera,
    scene: Scene,
    image: NDArray[np.uint8] | NDArray[np.float32],
    origin_px: tuple[int, int] = (0, 0),
) -> RefinedCamera:
    """The camera under which the painted marks fall where they are seen.

    Parameters
    ----------
    camera : from the scene's points alone
    scene : tells which part of the lens is known
    image : (rows, columns, 3) BGR, best without what moves; may be a part of the frame
    origin_px : column and row of the image's upper left pixel in the frame
    """
    no_matrix, no_terms = scene.camera_matrix is None, scene.distortion is None
    lens = FreeLens(focal=no_matrix, bends=no_terms, minor=no_terms, axis=no_matrix)
    fit = MarkingsFit(
        grey=brightness(image),
        origin=origin_px,
        marks=markings_of(scene.sheet),
        sheet_points=scene.sheet_points,
        points_px=scene.points_px,
        lens=lens,
    )
    if lens.count:
        best = fit.from_starts(_starts(camera, scene, free_focal=lens.focal), WIDEST_PX)
    else:
        best = fit.approach(camera, (*WIDE_PX, *NARROW_PX), KNOWN_LENS)
        if best is None or fit.cost(best) > UNSURE_COST:
            farther = fit.approach(camera, (*FARTHER_PX, *NARROW_PX), KNOWN_LENS)
            found = [c for c in (best, farther) if c is not None]
            best = min(found, key=fit.cost, default=None)
    return _judged(fit, camera, best)


def refine_from(
    starts: Sequence[Camera],
    sheet_points: Floats,
    points_px: Floats,
    image: NDArray[np.uint8] | NDArray[np.float32],
    marks: Markings,
    lens: FreeLens,
    *,
    height: float | None = None,
) -> RefinedCamera | None:
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
    fit = MarkingsFit(
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
    near = [fit.approach(start, (6.0, *NARROW_PX), lens) for start in starts]
    best = min((camera for camera in near if camera is not None), key=fit.cost, default=None)
    if best is None:
        return None
    found = _judged(fit, starts[0], best)
    return found if found.readings else None


def refine_at_focal(
    refined: RefinedCamera,
    scene: Scene,
    image: NDArray[np.uint8] | NDArray[np.float32],
    origin_px: tuple[int, int],
    log_change: float,
) -> RefinedCamera | None:
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
        camera = camera.moved(drift * log_change / steps, refined.lens)
    fit = MarkingsFit(
        grey=brightness(image),
        origin=origin_px,
        marks=markings_of(scene.sheet),
        sheet_points=scene.sheet_points,
        points_px=scene.points_px,
        lens=replace(refined.lens, focal=False),
    )
    found = fit.approach(camera, NARROW_PX, fit.lens)
    if found is None:
        return None
    readings = fit.read(found, 2.0)
    settled = fit.fitted(found, readings, fit.lens, 0.5)
    return replace(
        refined,
        camera=settled.camera,
        covariance=settled.covariance,
        readings=settled.readings,
        rms_px=settled.rms_px,
        misfit=settled.misfit,
        lens=fit.lens,
    )


def log_height_prior(camera: Camera) -> float:
    """How unlikely a camera's height is: squared standard deviations from the middle of halls'."""
    middle, spread = CAMERA_HEIGHT
    return float((np.log(camera.position[2] / middle) / spread) ** 2)


def unrefined(camera: Camera) -> RefinedCamera:
    """A camera that no mark was read for."""
    return RefinedCamera(
        camera=camera,
        readings=0,
        rms_px=np.nan,
        before_px=np.nan,
        covariance=np.zeros((6, 6)),
        lens=KNOWN_LENS,
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


def _judged(fit: MarkingsFit, before: Camera, after: Camera | None) -> RefinedCamera:
    """The better one of two cameras by what the marks say."""
    given = unrefined(before)
    if after is None:
        return given
    readings = fit.read(after, 2.0)
    if len(readings.index) < max(MIN_READINGS, MIN_SHARE * readings.expected):
        return given
    if fit.cost(after) > AS_GOOD * fit.cost(before):
        return given
    settled = fit.fitted(after, readings, fit.lens, 0.5)
    if settled.rms_px > DOUBTFUL_PX and settled.readings < DOUBTFUL_SHARE * readings.expected:
        return given
    return RefinedCamera(
        camera=settled.camera,
        readings=settled.readings,
        rms_px=settled.rms_px,
        misfit=settled.misfit,
        before_px=float(np.sqrt(fit.cost(before))),
        covariance=settled.covariance,
        lens=fit.lens,
    )
