"""Expected error of a stone's track from a planned camera.

Three quantities limit a track: the accuracy of the camera's pose from the paint, the size of a
pixel on the ice, and the uncertainty of the stone's shape along the line of sight.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from curling_env.sheet import BACK_LINE_Y, HOG_LINE_Y, TEE_Y, Sheet
from curling_env.typing import Floats
from curling_env.units import Units, miss
from friction_estimation.camera.camera import Camera
from friction_estimation.camera.lens import FreeLens
from friction_estimation.camera.markings import expected_measurements, fitted_markings
from friction_estimation.camera.paint_fit import PaintFit
from friction_estimation.camera.refined import RefinedCamera, height_prior
from friction_estimation.camera.scene import Scene
from friction_estimation.camera.tuning import (
    EDGE_ERROR_PX,
    FIT_ERROR_PX,
    MIN_MARKINGS,
    MIN_STONE_PX,
    PAINT_DEPTH,
    PAINT_PLACEMENT_SIGMA,
    SHAPE_RISE,
    STONE_HEIGHT_SIGMA,
)

PLACES = {
    "home tee": -TEE_Y,
    "home hog line": -HOG_LINE_Y,
    "middle": 0.0,
    "away hog line": HOG_LINE_Y,
    "away tee": TEE_Y,
    "away back line": BACK_LINE_Y,
}
"""Places on the centre line for which errors are listed [m]."""
UNKNOWN_LENS = FreeLens(focal=True, bends=True, minor=True, axis=True)


@dataclass(frozen=True, kw_only=True)
class ExpectedError:
    """Expected standard error of a stone's place in a track.

    Parameters
    ----------
    place : name of the place, see `PLACES`
    across, along : standard errors across and along the sheet [m]; None where no camera sees all
        of a stone, or sees it smaller than `MIN_STONE_PX`
    stone_px : the stone's width in the picture [px]; None likewise
    """

    place: str
    across: float | None = None
    along: float | None = None
    stone_px: float | None = None

    def document(self) -> dict[str, Any]:
        """Return the error for JSON."""
        return {
            "place": self.place,
            "sigma_across_m": self.across,
            "sigma_along_m": self.along,
            "stone_px": self.stone_px,
        }


def expected_errors(
    cameras: Sequence[RefinedCamera],
    radius: float = Scene.stone_radius,
    height: float = Scene.stone_height,
) -> list[ExpectedError]:
    """Return expected errors at all `PLACES`, each from the best camera there.

    Parameters
    ----------
    cameras : cameras whose films are joined, and how well they are known
    radius, height : of the stone's body [m]
    """
    found: list[ExpectedError] = []
    for name, y in PLACES.items():
        xy = np.array([[0.0, y]])
        best = ExpectedError(place=name)
        for known in cameras:
            width = 2 * radius * known.camera.scale(xy, height / 2)[0]
            if not _shown(known.camera, xy[0], radius, height) or width < MIN_STONE_PX:
                continue
            across, along = expected_sigma(known, xy, radius, height)[0].tolist()
            if best.along is None or along < best.along:
                best = ExpectedError(place=name, across=across, along=along, stone_px=float(width))
        found.append(best)
    return found


def expected_of_scene(scene: Scene, camera: Camera) -> list[ExpectedError]:
    """Return expected errors from a scene, if the paint corrects its marks.

    Parameters
    ----------
    scene : tells what is known of the lens and the height
    camera : the camera that follows from it, see `camera_from_scene`
    """
    known = expected_camera(
        camera,
        scene.sheet,
        lens_known=scene.camera_matrix is not None,
        height_known=scene.camera_height is not None,
        depth_sigma=scene.ice_above_paint[1],
    )
    return expected_errors([known], scene.stone_radius, scene.stone_height)


def expected_in_words(errors: Sequence[ExpectedError], units: Units) -> str:
    """Describe expected errors at the visible places; empty if no place is visible."""
    seen = [
        f"{error.place} {miss(error.along, units)} along, {miss(error.across, units)} across"
        for error in errors
        if error.along is not None and error.across is not None
    ]
    return "; ".join(seen)


def expected_sigma(refined: RefinedCamera, xy: Floats, radius: float, height: float) -> Floats:
    """Expected standard errors across and along the sheet of a stone at places (n, 2), (n, 2) [m].

    Parameters
    ----------
    refined : the camera, and how well it is known
    xy : (n, 2) places of the stone [m]
    radius, height : of the stone's body [m]
    """
    camera, z = refined.camera, height / 2
    variance = _with_stone(refined).place_variance(xy, z)
    error_px = np.hypot(EDGE_ERROR_PX, FIT_ERROR_PX / (radius * camera.scale(xy, z)))
    sight = (xy - camera.position[:2]) / (camera.position[2] - z)
    return np.sqrt(
        variance
        + (error_px[:, None] * camera.metres_per_px(xy, z)) ** 2
        + (SHAPE_RISE * sight) ** 2
    )


def expected_camera(
    camera: Camera,
    sheet: Sheet,
    *,
    lens_known: bool,
    height_known: bool = False,
    paint: float = PAINT_PLACEMENT_SIGMA,
    depth_sigma: float = PAINT_DEPTH[1],
) -> RefinedCamera:
    """Return a camera with the expected accuracy of its pose and lens from the paint.

    Parameters
    ----------
    camera : the camera, which need not exist yet
    sheet : the ice
    lens_known : whether its lens is measured, see `curling calibrate`
    height_known : whether its height is measured
    paint : standard error with which rings and lines are painted [m]
    depth_sigma : standard error of the thickness of the ice above the paint [m]
    """
    markings = fitted_markings(sheet)
    measured = expected_measurements(camera, markings, paint, np.random.default_rng(0))
    lens = FreeLens() if lens_known else UNKNOWN_LENS
    if len(measured.index) < MIN_MARKINGS:
        return RefinedCamera(camera=camera, covariance=np.full((6, 6), np.inf))
    fit = PaintFit(
        grey=np.empty((0, 0), np.float32),
        origin=(0, 0),
        markings=markings,
        sheet_points=np.empty((0, 2)),
        points_px=np.empty((0, 2)),
        lens=lens,
        height=height_prior(float(camera.position[2]) if height_known else None),
        depth_sigma=depth_sigma,
    )
    return replace(fit.fit(camera, measured, lens, 0.5), camera=camera)


def _with_stone(refined: RefinedCamera) -> RefinedCamera:
    """Return the camera with its height estimated from pictures of the stone, as in tracking."""
    if not refined.lens.focal:
        return refined
    along = refined.covariance[:, 6]
    update = np.outer(along, along) / (refined.covariance[6, 6] + STONE_HEIGHT_SIGMA**2)
    return replace(refined, covariance=refined.covariance - update)


def _shown(camera: Camera, xy: Floats, radius: float, height: float) -> bool:
    """Return whether a stone at a place (2,) is completely in the picture."""
    around = np.linspace(0, 2 * np.pi, 12, endpoint=False)
    circle = xy + radius * np.column_stack([np.cos(around), np.sin(around)])
    rings = [np.column_stack([circle, np.full(len(circle), z)]) for z in (0.0, height)]
    return bool(camera.sees(np.concatenate(rings), margin_px=1.0).all())
