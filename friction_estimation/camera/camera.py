"""A camera before the sheet: a lens at a place, and the way back from a pixel to the ice.

Pixels are those of the raw image; its upper left pixel's centre is (0, 0). Points are undistorted,
never frames: a point costs microseconds, a frame milliseconds and an interpolation.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import ArrayLike

from curling_env.errors import InputError
from curling_env.typing import Flags, Floats
from friction_estimation.camera.lens import NO_DISTORTION, FreeLens, Lens
from friction_estimation.camera.lens_formula import bounds_of_circles, rays_of_pixels
from friction_estimation.camera.pose import pose_from_points, solve_bent_lens, solve_focal
from friction_estimation.camera.scene import MIN_POINTS, Scene

MAX_AXIS_OFFSET = 0.2
"""Share of the image by which no lens is off its middle, unless the image was cut."""
MAX_MISFIT = 0.02
"""Points that are missed by more than this share of the image's diagonal contradict each other."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Camera:
    """A calibrated camera that does not move.

    Parameters
    ----------
    lens : the lens and the size of the image
    rotation : (3, 3) from the sheet frame (z up) to the camera's (x right, y down, z forward)
    translation : (3,) the sheet's origin in the camera's frame [m]
    """

    lens: Lens
    rotation: Floats
    translation: Floats

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

        The axis of the lens meets the image's middle, (width/2, height/2).
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
            lens=Lens.centred(focal_px, size, distortion),
            rotation=rotation,
            translation=-rotation @ position,
        )

    @classmethod
    def from_scene(cls, scene: Scene, size: tuple[int, int]) -> Camera:
        """The camera that sees the scene's points where they were marked.

        Without a camera matrix the focal length is solved with the pose, for square pixels and a
        principal point at the image's centre. Where no distortion is given, the lens counts as free
        of it unless the points contradict that (`refinement.refine` then measures it).

        Raises
        ------
        InputError : points outside the image, or points that no camera above the ice sees so
        """
        scene.check_inside(size)
        distortion = NO_DISTORTION if scene.distortion is None else scene.distortion
        matrix = _matrix_for(scene, size)
        points = scene.sheet_points, scene.points_px
        if matrix is None:
            lens = solve_focal(*points, Lens.centred(1.0, size, distortion))
        else:
            lens = Lens(matrix=matrix, distortion=distortion, size=size)
        pose = pose_from_points(*points, lens)
        limit_px = MAX_MISFIT * float(np.hypot(*size))
        if scene.distortion is None and (pose is None or pose.rms_px > limit_px):
            bent = solve_bent_lens(*points, lens, free_focal=scene.camera_matrix is None)
            lens, pose = bent or (lens, pose)
        if pose is None or pose.rms_px > limit_px:
            raise InputError(
                "no camera above the ice sees these points so; " + _suspect(scene, lens, limit_px),
                source=scene.source,
                where="corners_px" if scene.has_corners else "points",
            )
        return cls(lens=lens, rotation=pose.rotation, translation=pose.translation)

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the image [px]."""
        return self.lens.size

    @property
    def position(self) -> Floats:
        """(3,) the camera's place in the sheet frame [m]."""
        return -self.rotation.T @ self.translation

    def project(self, points: ArrayLike) -> Floats:
        """Points (n, 3) of the sheet frame [m] to the raw image, (n, 2) [px].

        Points behind the camera give NaN.
        """
        return self.lens.project(self.local(points))

    def local(self, points: ArrayLike) -> Floats:
        """Points (n, 3) of the sheet frame in the camera's frame [m]."""
        return np.asarray(points, dtype=np.float64) @ self.rotation.T + self.translation

    def rays(self, px: ArrayLike) -> Floats:
        """Directions (n, 3) in the sheet frame, not normalised, through raw pixels (n, 2)."""
        return self.lens.rays(px) @ self.rotation

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

    def sees(self, points: ArrayLike, margin_px: float = 0.0) -> Flags:
        """Whether each point (n, 3) of the sheet frame falls into the image."""
        u, v = self.project(points).T
        width, height = self.size
        return (
            (u >= margin_px)
            & (u <= width - 1 - margin_px)
            & (v >= margin_px)
            & (v <= height - 1 - margin_px)
        )

    def bounds_of_circles(self, xy: ArrayLike, circles: Floats) -> Floats:
        """The rectangle of pixels that level circles about an upright axis reach, (2, 2) [px].

        Parameters
        ----------
        xy : (2,) the axis, sheet frame [m]
        circles : (n, 2) radius and height of each [m]

        Returns
        -------
        lowest and highest column and row; NaN where a circle is behind the camera
        """
        bounds = np.empty((2, 2))
        x, y = np.asarray(xy, dtype=np.float64).tolist()
        lens = self.lens
        bounds_of_circles(
            x, y, circles, lens.matrix, lens.terms, self.rotation, self.translation, bounds
        )
        return bounds

    def rays_of_pixels(self, left: int, top: int, shape: tuple[int, int]) -> tuple[Floats, Floats]:
        """The rays through a rectangle of pixels, row by row.

        Parameters
        ----------
        left, top : column and row of its upper left pixel
        shape : rows and columns

        Returns
        -------
        (n, 2) where each ray meets the ice [m]; (n, 2) how far it moves sideways per metre of
        height
        """
        count = shape[0] * shape[1]
        xy, slope = np.empty((count, 2)), np.empty((count, 2))
        lens = self.lens
        rays_of_pixels(
            left, top, shape, lens.matrix, lens.terms, self.rotation, self.position, xy, slope
        )
        return xy, slope

    def with_pose(self, rotation: Floats, translation: Floats) -> Camera:
        """The same lens at another place."""
        return replace(self, rotation=rotation, translation=translation)

    def moved(self, step: Floats, free: FreeLens) -> Camera:
        """The camera after a step of a fit.

        Parameters
        ----------
        step : turn about the camera's axes [rad], shift in its frame [m], and the parameters of
            the lens that are free; a step of six moves the camera only
        free : which these are
        """
        lens, translation = self.lens, self.translation
        if len(step) > 6:
            change = free.change(step[6:])
            lens = lens.changed(change)
            # A longer lens farther away shows nearly the same.
            translation = translation + (np.exp(change.log_focal) - 1) * np.array(
                [0.0, 0.0, translation[2]]
            )
        return replace(
            self,
            lens=lens,
            rotation=np.asarray(cv2.Rodrigues(step[:3])[0] @ self.rotation, dtype=np.float64),
            translation=translation + step[3:6],
        )


def _matrix_for(scene: Scene, size: tuple[int, int]) -> Floats | None:
    """The scene's camera matrix for frames of `size`, which may be a resized picture."""
    matrix, own = scene.camera_matrix, scene.image_size
    if matrix is not None and own is None:
        off = np.abs(matrix[:2, 2] - np.array(size) / 2) / size
        if off.max() > MAX_AXIS_OFFSET:
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


def _suspect(scene: Scene, lens: Lens, limit_px: float) -> str:
    """Which point is the wrong one, as far as the others tell."""
    n = len(scene.points_px)
    if scene.has_corners:
        for turn in (1, 3):
            turned = np.roll(scene.points_px, turn, axis=0)
            pose = pose_from_points(scene.sheet_points, turned, lens)
            if pose is not None and pose.rms_px <= limit_px:
                return "each corner is marked where the next one around the sheet is"
    alone: list[int] = []
    for k in range(n) if n > MIN_POINTS else ():
        rest = np.arange(n) != k
        pose = pose_from_points(scene.sheet_points[rest], scene.points_px[rest], lens)
        if pose is not None and pose.rms_px <= limit_px:
            alone.append(k)
    if len(alone) == 1:
        x, y = scene.sheet_points[alone[0]]
        return f"point {alone[0] + 1}, of ({x:g}, {y:g}) m on the ice, contradicts all others"
    return "check that each is the right one"
