"""The camera: one pinhole with a distorting lens, and the way back from a pixel to the ice.

Pixels are those of the raw image; its upper left pixel's centre is (0, 0). Points are undistorted,
never frames: a point costs microseconds, a frame milliseconds and an interpolation.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

from curling_env.errors import InputError
from curling_env.typing import Floats
from friction_estimation.camera.pose import pose_from_points, solve_bent_lens, solve_focal_px
from friction_estimation.camera.scene import MIN_POINTS, Scene

NO_DISTORTION = np.zeros(5)
FAR_FROM_MIDDLE = 0.2
"""Share of the image by which no lens is off its middle, unless the image was cut."""
_UNDISTORT_UNTIL = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 60, 1e-10)


@dataclass(frozen=True, kw_only=True, eq=False)
class Camera:
    """A calibrated camera that does not move.

    Parameters
    ----------
    matrix : (3, 3) focal lengths and principal point [px]
    distortion : (5,) OpenCV's k1 k2 p1 p2 k3
    rotation : (3, 3) from the sheet frame (z up) to the camera's (x right, y down, z forward)
    translation : (3,) the sheet's origin in the camera's frame [m]
    size : width and height of the image [px]
    """

    matrix: Floats
    distortion: Floats
    rotation: Floats
    translation: Floats
    size: tuple[int, int]

    @classmethod
    def looking_at(
        cls,
        *,
        position: ArrayLike,
        target: ArrayLike,
        up: ArrayLike = (0.0, 0.0, 1.0),
        focal_px: float,
        size: tuple[int, int],
        distortion: ArrayLike = NO_DISTORTION,
    ) -> Camera:
        """A camera at a place, looking at a point; `up` is the direction that is up in the image.

        The principal point is the image's centre, (width/2, height/2).
        """
        position = np.asarray(position, dtype=np.float64)
        forward = np.asarray(target, dtype=np.float64) - position
        forward /= np.linalg.norm(forward)
        right = np.cross(forward, np.asarray(up, dtype=np.float64))
        if np.linalg.norm(right) < 1e-9:
            raise InputError("up must not be along the line of sight")
        right /= np.linalg.norm(right)
        rotation = np.stack([right, np.cross(forward, right), forward])
        return cls(
            matrix=intrinsics(focal_px, size),
            distortion=np.asarray(distortion, dtype=np.float64),
            rotation=rotation,
            translation=-rotation @ position,
            size=size,
        )

    @classmethod
    def from_scene(cls, scene: Scene, size: tuple[int, int]) -> Camera:
        """The camera that sees the scene's points where they were marked.

        Without a camera matrix the focal length is solved with the pose, for square pixels and a
        principal point at the image's centre. Where no distortion is given the lens counts as free
        of it, or as bent no more than the points ask for (`refinement.refine` improves on that).

        Raises
        ------
        InputError : points outside the image, or that no camera above the ice can see so
        """
        scene.check_inside(size)
        distortion = NO_DISTORTION if scene.distortion is None else scene.distortion
        matrix = _matrix_for(scene, size)
        if matrix is None:
            focal_px = solve_focal_px(scene.sheet_points, scene.points_px, size, distortion)
            matrix = intrinsics(focal_px, size)
        pose = pose_from_points(scene.sheet_points, scene.points_px, matrix, distortion)
        limit_px = 0.02 * float(np.hypot(*size))
        if scene.distortion is None and (pose is None or pose.rms_px > limit_px):
            known = None if scene.camera_matrix is None else matrix
            bent = solve_bent_lens(scene.sheet_points, scene.points_px, known, size)
            matrix, distortion, pose = bent or (matrix, distortion, pose)
        if pose is None or pose.rms_px > limit_px:
            raise InputError(
                "no camera above the ice sees these points so; "
                + _suspect(scene, matrix, distortion, limit_px),
                source=scene.source,
                where="corners_px" if scene.has_corners else "points",
            )
        return cls(
            matrix=matrix,
            distortion=distortion,
            rotation=pose.rotation,
            translation=pose.translation,
            size=size,
        )

    @property
    def position(self) -> Floats:
        """(3,) the camera's place in the sheet frame [m]."""
        return -self.rotation.T @ self.translation

    def project(self, points: ArrayLike) -> Floats:
        """Points (n, 3) of the sheet frame [m] to the raw image, (n, 2) [px].

        Points behind the camera give NaN.
        """
        local = np.asarray(points, dtype=np.float64) @ self.rotation.T + self.translation
        depth = local[:, 2]
        with np.errstate(divide="ignore", invalid="ignore"):
            x, y = local[:, 0] / depth, local[:, 1] / depth
        k1, k2, p1, p2, k3 = self.distortion
        r2 = x * x + y * y
        radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
        xd = x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x)
        yd = y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y
        (fx, skew, cx), (_, fy, cy) = self.matrix[0], self.matrix[1]
        px = np.stack([fx * xd + skew * yd + cx, fy * yd + cy], axis=1)
        px[depth <= 0] = np.nan
        return px

    def rays(self, px: ArrayLike) -> Floats:
        """Directions (n, 3) in the sheet frame, not normalised, through raw pixels (n, 2)."""
        points = np.asarray(px, dtype=np.float64).reshape(-1, 1, 2)
        if len(points) == 0:
            return np.empty((0, 3))
        flat = cv2.undistortPoints(
            points, self.matrix, self.distortion, criteria=_UNDISTORT_UNTIL
        ).reshape(-1, 2)
        return np.column_stack([flat, np.ones(len(flat))]) @ self.rotation

    def on_plane(self, px: ArrayLike, z: ArrayLike = 0.0) -> Floats:
        """Where the rays through raw pixels (n, 2) meet planes at height z [m], (n, 2) [m].

        NaN for a ray that never comes down to it.
        """
        rays, position = self.rays(px), self.position
        with np.errstate(divide="ignore", invalid="ignore"):
            along = (np.asarray(z) - position[2]) / rays[:, 2]
        along[~(along > 0)] = np.nan
        return position[:2] + along[:, None] * rays[:, :2]

    def px_per_metre(self, xy: ArrayLike, z: float = 0.0) -> Floats:
        """Image motion per motion on the plane, (2, 2) d(u, v)/d(x, y) [px/m] at one point (2,)."""
        x, y = np.asarray(xy, dtype=np.float64)
        step = 1e-3
        at = self.project([[x - step, y, z], [x + step, y, z], [x, y - step, z], [x, y + step, z]])
        return np.stack([at[1] - at[0], at[3] - at[2]], axis=1) / (2 * step)

    def sees(self, points: ArrayLike, margin_px: float = 0.0) -> NDArray[np.bool_]:
        """Whether each point (n, 3) of the sheet frame falls into the image."""
        u, v = self.project(points).T
        width, height = self.size
        return (
            (u >= margin_px)
            & (u <= width - 1 - margin_px)
            & (v >= margin_px)
            & (v <= height - 1 - margin_px)
        )

    def with_pose(self, rotation: Floats, translation: Floats) -> Camera:
        """The same lens at another place."""
        return replace(self, rotation=rotation, translation=translation)


def _matrix_for(scene: Scene, size: tuple[int, int]) -> Floats | None:
    """The scene's camera matrix for frames of `size`, which may be a resized picture."""
    matrix, own = scene.camera_matrix, scene.image_size
    if matrix is not None and own is None:
        off = np.abs(matrix[:2, 2] - np.array(size) / 2) / size
        if off.max() > FAR_FROM_MIDDLE:
            raise InputError(
                f"the principal point ({matrix[0, 2]:g}, {matrix[1, 2]:g}) px is far from the "
                f"middle of a film of {size[0]} × {size[1]} px: intrinsics of another resolution? "
                "image_size tells which they belong to",
                source=scene.source,
                where="camera_matrix",
            )
    if matrix is None or own is None or own == size:
        return matrix
    scale = size[0] / own[0]
    if abs(size[1] - scale * own[1]) > 1.0:
        raise InputError(
            f"the camera was calibrated on {own[0]} × {own[1]} px and the film has "
            f"{size[0]} × {size[1]} px; calibrate it as it films",
            source=scene.source,
            where="image_size",
        )
    resized = matrix.copy()
    resized[:2] *= scale
    resized[:2, 2] += (scale - 1) / 2  # pixels are counted from the first one's centre
    return resized


def _suspect(scene: Scene, matrix: Floats, distortion: Floats, limit_px: float) -> str:
    """Which point is the wrong one, as far as the others tell."""
    n = len(scene.points_px)
    if scene.has_corners:
        for turn in (1, 3):
            turned = np.roll(scene.points_px, turn, axis=0)
            pose = pose_from_points(scene.sheet_points, turned, matrix, distortion)
            if pose is not None and pose.rms_px <= limit_px:
                return "each corner is marked where the next one around the sheet is"
    alone: list[int] = []
    for k in range(n) if n > MIN_POINTS else ():
        rest = np.arange(n) != k
        pose = pose_from_points(scene.sheet_points[rest], scene.points_px[rest], matrix, distortion)
        if pose is not None and pose.rms_px <= limit_px:
            alone.append(k)
    if len(alone) == 1:
        x, y = scene.sheet_points[alone[0]]
        return f"point {alone[0] + 1}, of ({x:g}, {y:g}) m on the ice, contradicts all others"
    return "check that each is the right one"


def intrinsics(focal_px: float, size: tuple[int, int]) -> Floats:
    """Camera matrix with square pixels and the principal point at the image's centre, (3, 3)."""
    return np.array([[focal_px, 0, size[0] / 2], [0, focal_px, size[1] / 2], [0, 0, 1.0]])
