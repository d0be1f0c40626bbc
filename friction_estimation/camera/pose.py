"""Pose of a camera from known points of the ice.

If the scene does not give the lens, a rough one is found with the pose; `refinement` then refines
it on the painted lines.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import cv2
import numpy as np

from curling_env.errors import InputError
from curling_env.typing import Floats
from friction_estimation.camera.camera import Camera
from friction_estimation.camera.lens import (
    CUT_AXIS_SIGMA,
    NO_DISTORTION,
    TRIAL_BENDS,
    TRIAL_FOCALS,
    FreeLens,
    Lens,
)
from friction_estimation.camera.markings import MarkingMeasurements, markings_of
from friction_estimation.camera.paint_fit import PaintFit
from friction_estimation.camera.refined import RefinedCamera, height_prior
from friction_estimation.camera.scene import MIN_POINTS, Scene
from friction_estimation.camera.tuning import MAX_MISFIT

PLANE_TURNS = (0.0, 0.5, 1.0)
"""Rotations of the axes of the ice before the search for a pose [rad]."""
SAME_FOCAL = 0.2
"""Minimum difference of trial focal lengths, in log."""
FOLLOWED = 3
"""Number of trial lenses that are followed: those with the smallest misfit."""
NOTHING_MEASURED = MarkingMeasurements(
    index=np.empty(0, dtype=np.intp),
    normal_px=np.empty((0, 2)),
    offset_px=np.empty(0),
    expected=0,
)
"""No paint, for a camera from points alone."""


def best_camera(
    sheet_points: Floats, points_px: Floats, lenses: Sequence[Lens]
) -> tuple[float, Camera] | None:
    """Return the camera above the ice that projects known points best onto their marks.

    A plane seen by a pinhole allows two poses that fit almost equally well; both are refined.

    Parameters
    ----------
    sheet_points : (n, 2) sheet frame [m]
    points_px : (n, 2) raw image [px]
    lenses : possible lenses

    Returns
    -------
    root mean square distance of the points from where it puts them [px], and the camera; None if no
    camera above the ice has all points before it

    Source
    ------
    Collins and Bartoli, Infinitesimal plane-based pose estimation, IJCV 109 (2014): both poses.
    """
    world = np.column_stack([sheet_points, np.zeros(len(sheet_points))])
    pixels = np.ascontiguousarray(points_px)
    found: list[tuple[float, Camera]] = []
    for lens in lenses:
        matrix, distortion = lens.matrix, lens.distortion
        for rvec, tvec in _first_poses(world, pixels, matrix, distortion):
            rvec, tvec = cv2.solvePnPRefineLM(world, pixels, matrix, distortion, rvec, tvec)
            camera = Camera(
                lens=lens,
                rotation=np.asarray(cv2.Rodrigues(rvec)[0], dtype=np.float64),
                translation=np.asarray(tvec, dtype=np.float64).ravel(),
            )
            if camera.position[2] > 0 and camera.local(world)[:, 2].min() > 0:
                found.append((_apart_px(camera, sheet_points, points_px), camera))
    return min(found, key=lambda one: one[0], default=None)


def likely_cameras(
    sheet_points: Floats, points_px: Floats, lenses: Sequence[Lens]
) -> list[tuple[float, Camera]]:
    """Return `best_camera` with each of several lenses, best first."""
    found = [best_camera(sheet_points, points_px, [lens]) for lens in lenses]
    return sorted((one for one in found if one is not None), key=lambda one: one[0])


def _first_poses(
    world: Floats, pixels: Floats, matrix: Floats, distortion: Floats
) -> list[tuple[Floats, Floats]]:
    """Rotation vectors and translations of both poses before they are refined.

    OpenCV takes the root of a number that is zero if an axis of the plane is perpendicular to the
    line of sight, as from the middle of a long side; rounding then decides its sign. In that case
    the axes are rotated.
    """
    for turn in PLANE_TURNS:
        turned = cv2.Rodrigues(np.array([0.0, 0.0, turn]))[0]
        try:
            count, rotations, translations, *_ = cv2.solvePnPGeneric(
                world @ turned.T, pixels, matrix, distortion, flags=cv2.SOLVEPNP_IPPE
            )
        except cv2.error:
            return []
        if all(np.isfinite(r).all() for r in (*rotations[:count], *translations[:count])):
            back = [cv2.Rodrigues(cv2.Rodrigues(r)[0] @ turned)[0] for r in rotations[:count]]
            pairs = zip(back, translations[:count], strict=True)
            return [(np.asarray(r, np.float64), np.asarray(t, np.float64)) for r, t in pairs]
    return []


def trial_lenses(lens: Lens, *, focal: bool, bends: bool) -> list[Lens]:
    """Return a lens, and clearly different ones if its focal length or distortion is unknown."""
    lenses = [lens]
    if focal:
        focals = np.array(TRIAL_FOCALS) * max(lens.size)
        others = focals[np.abs(np.log(focals / lens.focal_px)) > SAME_FOCAL].tolist()
        lenses += [Lens.centred(focal, lens.size, lens.distortion) for focal in others]
    return [one.bent(bend) for one in lenses for bend in TRIAL_BENDS] if bends else lenses


def camera_from_scene(scene: Scene, size: tuple[int, int]) -> Camera:
    """Solve the camera from the scene's points; see `marked_camera`."""
    return marked_camera(scene, size).camera


def marked_camera(scene: Scene, size: tuple[int, int]) -> RefinedCamera:
    """Solve the camera from the scene's points, with its uncertainty.

    Without a camera matrix the focal length is solved with the pose, for square pixels and a
    principal point at the image's centre. Without a given distortion the lens is assumed to have
    none, unless the points contradict that.

    Parameters
    ----------
    scene : the points and what is known of the lens
    size : width and height of the image [px]

    Raises
    ------
    InputError : points outside the image, pictures of another shape than the scene's, or points
        that no camera above the ice sees so
    """
    _check_axis(scene, size)
    scene = scene.for_size(size)
    scene.check_inside(size)
    matrix, terms = scene.camera_matrix, scene.distortion
    lens = Lens.centred(max(size), size, NO_DISTORTION if terms is None else terms)
    lens = lens if matrix is None else replace(lens, matrix=matrix)
    limit_px = MAX_MISFIT * float(np.hypot(*size))
    for bends in (False, True)[: 1 + (terms is None)]:
        solved = _by_marks(scene, lens, FreeLens(focal=matrix is None, bends=bends))
        if solved is not None and solved[0] <= limit_px:
            return solved[1]
    raise InputError(
        "no camera above the ice fits these points; " + _suspect(scene, lens, limit_px),
        source=scene.source,
        where="corners_px" if scene.has_corners else "points",
    )


def _by_marks(scene: Scene, lens: Lens, free: FreeLens) -> tuple[float, RefinedCamera] | None:
    """Return the most likely camera from a scene's points and the prior of cameras.

    Returns
    -------
    root mean square distance of the points from where it puts them [px], and the camera; None
    where no camera above the ice has all points before it
    """
    points = scene.sheet_points, scene.points_px
    lenses = trial_lenses(lens, focal=free.focal, bends=free.bends)
    nearest = likely_cameras(*points, lenses)[:FOLLOWED]
    fit = PaintFit(
        grey=np.empty((0, 0), np.float32),
        origin=(0, 0),
        markings=markings_of(scene.sheet),
        sheet_points=scene.sheet_points,
        points_px=scene.points_px,
        lens=free,
        height=height_prior(scene.camera_height),
    )
    found = [fit.fit(camera, NOTHING_MEASURED, free, 1.0) for _, camera in nearest]
    if not found:
        return None
    best = min(found, key=lambda one: one.misfit)
    return _apart_px(best.camera, *points), best


def place_sigma(scene: Scene, camera: Camera, xy: Floats) -> Floats:
    """Standard error of each coordinate of places on the ice due to the camera, (n,) [m].

    For a scene of `curling locate` its errors are interpolated. Otherwise the points were marked by
    hand, and the error of the marks is propagated through the pose.

    Parameters
    ----------
    scene : the scene
    camera : the camera that follows from it, see `camera_from_scene`
    xy : (n, 2) places [m]
    """
    if scene.place_sigma is not None:
        places, sigma = scene.place_sigma[:, :2], scene.place_sigma[:, 2]
        weight = 1 / np.maximum(np.linalg.norm(xy[:, None] - places, axis=2), 1e-3) ** 4
        return weight @ sigma / weight.sum(axis=1)
    return marked_camera(scene, camera.size).place_sigma(xy)


def _apart_px(camera: Camera, sheet_points: Floats, points_px: Floats) -> float:
    """Root mean square distance of points from their projections [px]."""
    there = camera.project(np.column_stack([sheet_points, np.zeros(len(sheet_points))]))
    return float(np.sqrt(np.mean(np.sum((there - points_px) ** 2, axis=1))))


def _check_axis(scene: Scene, size: tuple[int, int]) -> None:
    """Refuse a camera matrix of unknown size whose axis is far from the middle of the picture."""
    matrix = scene.camera_matrix
    if matrix is None or scene.image_size is not None:
        return
    off = np.abs(matrix[:2, 2] - np.array(size) / 2) / (max(size) / 2)
    if off.max() > CUT_AXIS_SIGMA:  # farther than in most cropped pictures
        raise InputError(
            f"the principal point ({matrix[0, 2]:g}, {matrix[1, 2]:g}) px is far from the "
            f"middle of a film of {size[0]} × {size[1]} px; for a matrix of another picture size "
            "give image_size",
            source=scene.source,
            where="camera_matrix",
        )


def _suspect(scene: Scene, lens: Lens, limit_px: float) -> str:
    """Name the wrong point, as far as the others show it."""

    def agree(sheet_points: Floats, points_px: Floats) -> bool:
        found = best_camera(sheet_points, points_px, [lens])
        return found is not None and found[0] <= limit_px

    ice, px = scene.sheet_points, scene.points_px
    if scene.has_corners and any(agree(ice, np.roll(px, turn, axis=0)) for turn in (1, 3)):
        return "each corner is marked where the next one around the sheet is"
    others = ~np.eye(len(px), dtype=bool) if len(px) > MIN_POINTS else []
    alone = [k for k, rest in enumerate(others) if agree(ice[rest], px[rest])]
    if len(alone) == 1:
        x, y = ice[alone[0]]
        return f"point {alone[0] + 1}, at ({x:g}, {y:g}) m on the ice, contradicts all others"
    return "check each of them"
