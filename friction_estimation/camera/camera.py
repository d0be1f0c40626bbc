"""A camera at the sheet: a lens with a pose, and the projection from a pixel back to the ice.

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

_BESIDE = np.array([[-1.0, 0.0], [1.0, 0.0], [0.0, -1.0], [0.0, 1.0]])
"""Steps along x and y, backwards and forwards."""


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
        """Return a camera at a place, looking at a point; `up` is the direction that is up in the
        image.

        The optical axis meets the middle of the image, (width/2, height/2).
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
        """Return the intersections of rays through raw pixels (n, 2) with planes at height z [m],
        (n, 2) [m].

        NaN for a ray that never meets it.
        """
        rays, position = self.rays(px), self.position
        with np.errstate(divide="ignore", invalid="ignore"):
            along = (np.asarray(z) - position[2]) / rays[:, 2]
        along[~(along > 0)] = np.nan
        return position[:2] + along[:, None] * rays[:, :2]

    def px_per_metre(self, xy: ArrayLike, z: float = 0.0) -> Floats:
        """Image motion per motion on the plane, (…, 2, 2) d(u, v)/d(x, y) [px/m], at (…, 2)."""
        xy, step = np.asarray(xy, dtype=np.float64), 1e-3
        points = np.empty((*xy.shape[:-1], 4, 3))
        points[..., :2] = xy[..., None, :] + step * _BESIDE
        points[..., 2] = z
        at = self.project(points.reshape(-1, 3)).reshape(*points.shape[:-1], 2)
        motion = [at[..., 1, :] - at[..., 0, :], at[..., 3, :] - at[..., 2, :]]
        return np.stack(motion, axis=-1) / (2 * step)

    def scale(self, xy: Floats, z: float = 0.0) -> Floats:
        """Maximum number of pixels per metre on a plane at places (n, 2), (n,)."""
        return np.linalg.norm(self.px_per_metre(xy, z), 2, axis=(1, 2))

    def metres_per_px(self, xy: Floats, z: float = 0.0) -> Floats:
        """Maximum change of each coordinate on a plane per pixel at places (n, 2), (n, 2) [m]."""
        return np.linalg.norm(np.linalg.inv(self.px_per_metre(xy, z)), axis=2)

    def sees(self, points: ArrayLike, margin_px: float = 0.0) -> Flags:
        """Return whether each point (n, 3) of the sheet frame falls into the image."""
        local = self.local(points)
        u, v = self.lens.project(local).T
        width, height = self.size
        with np.errstate(divide="ignore", invalid="ignore"):
            angle = np.hypot(local[:, 0], local[:, 1]) / local[:, 2]
        return (
            (angle < self.lens.reach)
            & (u >= margin_px)
            & (u <= width - 1 - margin_px)
            & (v >= margin_px)
            & (v <= height - 1 - margin_px)
        )

    def resized(self, scale: Floats, size: tuple[int, int]) -> Camera:
        """Return the camera for pictures enlarged along both sides (2,); see `Lens.resized`."""
        return replace(self, lens=self.lens.resized(scale, size))

    def moved(self, step: Floats, free: FreeLens) -> Camera:
        """Return the camera after a step of a fit.

        Parameters
        ----------
        step : turn about the camera's axes [rad], shift in its frame [m], and changes of the
            lens's free parameters; a step of six numbers moves the camera only
        free : the parameters of the lens that are free
        """
        lens, translation = self.lens, self.translation
        if len(step) > 6:
            lens = lens.changed(step[6:], free)
            # A longer lens farther away shows nearly the same.
            longer = lens.focal_px / self.lens.focal_px
            translation = translation * np.array([1.0, 1.0, longer])
        return replace(
            self,
            lens=lens,
            rotation=np.asarray(cv2.Rodrigues(step[:3])[0] @ self.rotation, dtype=np.float64),
            translation=translation + step[3:6],
        )
