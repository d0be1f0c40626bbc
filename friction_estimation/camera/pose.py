"""Calibration: the pose from known points of the ice, and the focal length where it is unknown."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from scipy.optimize import minimize_scalar

from curling_env.typing import Floats

FOCAL_RANGE = (0.25, 8.0)
"""Focal lengths tried, in longer sides of the image: from a 127° to a 7° view."""
FOCAL_PRIOR = (1.0, 1.5)
"""Median and spread (in log) of rink cameras' focal lengths, in the same.

Weak on purpose: it decides only where the points cannot, as for a camera that looks straight down.
"""

FOCALS = (0.35, 0.6, 1.0, 1.7)
"""Focal lengths tried where the points cannot tell, in the longer sides of the image."""
BENDS = (-0.3, -0.22, -0.15, -0.09, -0.04, 0.0, 0.05)
"""Distortions tried: share by which the longer side's end is moved."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Pose:
    """Where a camera stands.

    Parameters
    ----------
    rotation : (3, 3) from the sheet frame to the camera's
    translation : (3,) the sheet's origin in the camera's frame [m]
    rms_px : root mean square distance of the given points from where this pose puts them [px]
    """

    rotation: Floats
    translation: Floats
    rms_px: float


def poses_from_points(
    sheet_points: Floats, points_px: Floats, matrix: Floats, distortion: Floats
) -> list[Pose]:
    """The poses above the ice under which known points fall where they were marked, best first.

    A plane seen by a pinhole allows two poses that fit almost equally well; both are refined.

    Parameters
    ----------
    sheet_points : (n, 2) sheet frame [m]
    points_px : (n, 2) raw image [px]
    matrix : (3, 3) camera matrix [px]
    distortion : (5,) OpenCV's k1 k2 p1 p2 k3

    Returns
    -------
    None, one or two poses that stand above the ice with all points before the camera.

    Source
    ------
    Collins and Bartoli, Infinitesimal plane-based pose estimation, IJCV 109 (2014): both poses.
    """
    world = np.column_stack([sheet_points, np.zeros(len(sheet_points))])
    pixels = np.ascontiguousarray(points_px, dtype=np.float64)
    try:
        count, rotations, translations, *_ = cv2.solvePnPGeneric(
            world, pixels, matrix, distortion, flags=cv2.SOLVEPNP_IPPE
        )
    except cv2.error:
        return []
    poses: list[Pose] = []
    for rvec, tvec in zip(rotations[:count], translations[:count], strict=True):
        rvec, tvec = cv2.solvePnPRefineLM(world, pixels, matrix, distortion, rvec, tvec)
        rotation = np.asarray(cv2.Rodrigues(rvec)[0], dtype=np.float64)
        translation = np.asarray(tvec, dtype=np.float64).ravel()
        above = (-rotation.T @ translation)[2] > 0
        before = (world @ rotation.T + translation)[:, 2].min() > 0
        if not (above and before):
            continue
        seen = cv2.projectPoints(world, rvec, tvec, matrix, distortion)[0].reshape(-1, 2)
        rms = float(np.sqrt(np.mean(np.sum((seen - pixels) ** 2, axis=1))))
        poses.append(Pose(rotation=rotation, translation=translation, rms_px=rms))
    return sorted(poses, key=lambda pose: pose.rms_px)


def pose_from_points(
    sheet_points: Floats, points_px: Floats, matrix: Floats, distortion: Floats
) -> Pose | None:
    """The best of `poses_from_points`; None where there is none."""
    return next(iter(poses_from_points(sheet_points, points_px, matrix, distortion)), None)


def solve_focal_px(
    sheet_points: Floats, points_px: Floats, size: tuple[int, int], distortion: Floats
) -> float:
    """Focal length for square pixels and a principal point at the image's centre [px].

    Chosen by how well the best pose fits, with a weak prior where the points cannot tell.
    """
    side = max(size)

    def cost(log_ratio: float) -> float:
        focal = float(np.exp(log_ratio)) * side
        matrix = np.array([[focal, 0, size[0] / 2], [0, focal, size[1] / 2], [0, 0, 1.0]])
        pose = pose_from_points(sheet_points, points_px, matrix, distortion)
        misfit = 1e6 if pose is None else len(points_px) * pose.rms_px**2
        return misfit + ((log_ratio - np.log(FOCAL_PRIOR[0])) / FOCAL_PRIOR[1]) ** 2

    tried = np.linspace(np.log(FOCAL_RANGE[0]), np.log(FOCAL_RANGE[1]), 61)
    costs = [cost(x) for x in tried]
    best = int(np.argmin(costs))
    low, high = tried[max(best - 1, 0)], tried[min(best + 1, len(tried) - 1)]
    found = minimize_scalar(cost, bounds=(low, high), method="bounded", options={"xatol": 1e-6})
    return float(np.exp(found.x)) * side


def solve_bent_lens(
    sheet_points: Floats, points_px: Floats, matrix: Floats | None, size: tuple[int, int]
) -> tuple[Floats, Floats, Pose] | None:
    """The lens among several of `FOCALS` and `BENDS`, and its pose, that puts the points best.

    Parameters
    ----------
    matrix : (3, 3) where it is known, None where not

    Returns
    -------
    camera matrix (3, 3), distortion (5,) and pose; None where none has a pose
    """
    side = max(size)
    focals = [share * side for share in FOCALS] if matrix is None else [matrix[0, 0]]
    found: list[tuple[Floats, Floats, Pose]] = []
    for focal in focals:
        tried = matrix
        if tried is None:
            tried = np.array([[focal, 0, size[0] / 2], [0, focal, size[1] / 2], [0, 0, 1.0]])
        for bend in BENDS:
            distortion = np.array([bend * (2 * focal / side) ** 2, 0.0, 0.0, 0.0, 0.0])
            pose = pose_from_points(sheet_points, points_px, tried, distortion)
            if pose is not None:
                found.append((tried, distortion, pose))
    return min(found, key=lambda one: one[2].rms_px, default=None)
