"""Solved camera and its uncertainty."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from curling_env.typing import Floats
from friction_estimation.camera.camera import Camera
from friction_estimation.camera.lens import KNOWN_LENS, FreeLens
from friction_estimation.camera.markings import apparent_depth
from friction_estimation.camera.tuning import (
    CAMERA_HEIGHT_PRIOR,
    FOCAL_PRIOR,
    MEASURED_HEIGHT_SIGMA,
    TOLERANCE_PX,
)


@dataclass(frozen=True, kw_only=True, eq=False)
class RefinedCamera:
    """Camera and its agreement with the paint on the ice.

    Parameters
    ----------
    camera : after the fit
    measured : number of points of painted lines that it was fitted to
    rms_px : root mean square residual of these points [px]
    covariance : (m, m) covariance of the free parameters, see `Camera.moved`
    lens : the parts of the lens that were fitted
    misfit : misfit to the paint and to prior knowledge [squared standard errors], on one scale
        for all cameras
    farther : a camera that the paint agrees with as well, a standard error of its height away;
        only where the height comes from something other than the paint
    misses_px : by name of a ring or line that is seen near where the camera puts it, root mean
        square distance from there [px]
    depth_sigma : standard error of the thickness of the ice above the paint [m]
    disagreeing : names of rings and lines that are not where it puts them; only where none is
        measured
    """

    camera: Camera
    measured: int = 0
    rms_px: float = np.nan
    covariance: Floats
    lens: FreeLens = KNOWN_LENS
    misfit: float = 0.0
    farther: Camera | None = None
    misses_px: Mapping[str, float] = field(default_factory=dict[str, float])
    depth_sigma: float = 0.0
    disagreeing: tuple[str, ...] = ()

    @property
    def log_focal_sigma(self) -> float:
        """Standard error of the logarithm of the focal length; 0 where it was given."""
        return float(np.sqrt(self.covariance[6, 6])) if self.lens.focal else 0.0

    @property
    def missed(self) -> list[str]:
        """Names of the curves that the camera misses by more than 2 px of the whole picture.

        In a picture of many pixels the paint itself may be inexact.
        """
        return [name for name, miss in self.misses_px.items() if miss > TOLERANCE_PX]

    @property
    def height_uncertainty(self) -> float:
        """Standard error of the log height from pictures of stones; 0 without such a height."""
        if self.farther is None:
            return 0.0
        return abs(float(np.log(self.farther.position[2] / self.camera.position[2])))

    @property
    def height_range(self) -> tuple[float, float]:
        """95 % interval of the camera's height [m]."""
        height, spread = float(self.camera.position[2]), self.log_focal_sigma
        if spread == 0.0:
            return height, height
        drift = self.covariance[:, 6] / self.covariance[6, 6]
        step = min(spread, 0.05)
        moved = self.camera.moved(drift * step, self.lens)
        per_focal = abs(np.log(float(moved.position[2]) / height)) / step
        factor = float(np.exp(2 * spread * per_focal))
        return height / factor, height * factor

    def place_variance(self, xy: Floats, z: float = 0.0) -> Floats:
        """Variances of both coordinates due to the camera's pose and lens, (n, 2) [m²].

        Parameters
        ----------
        xy : (n, 2) places [m]
        z : their height above the ice [m]
        """
        px = self.camera.project(np.column_stack([xy, np.full(len(xy), z)]))
        step, count = 1e-5, len(self.covariance)
        beside = [self.camera.moved(one, self.lens) for one in step * np.eye(count)]
        moved = np.stack([camera.on_plane(px, z) - xy for camera in beside], axis=2) / step
        variance = np.einsum("nip,pq,niq->ni", moved, self.covariance, moved)
        if self.farther is not None:
            variance += (self.farther.on_plane(px, z) - xy) ** 2
        # The paint lies below the ice, but its places count as places on the ice.
        sight = (xy - self.camera.position[:2]) / self.camera.position[2]
        sight *= apparent_depth(np.linalg.norm(sight, axis=1))[:, None]
        variance += (self.depth_sigma * sight) ** 2
        return variance

    def place_sigma(self, xy: Floats, z: float = 0.0) -> Floats:
        """Standard error of each coordinate due to the camera, (n,) [m]; see `place_variance`."""
        return np.sqrt(self.place_variance(xy, z).mean(axis=1))

    def resized(self, scale: Floats, size: tuple[int, int]) -> RefinedCamera:
        """Return the same for pictures enlarged along both sides (2,); see `Lens.resized`.

        The free parameters do not depend on the size of the picture.
        """
        factor = float(np.mean(scale))
        return replace(
            self,
            camera=self.camera.resized(scale, size),
            rms_px=factor * self.rms_px,
            misses_px={name: factor * miss for name, miss in self.misses_px.items()},
            farther=None if self.farther is None else self.farther.resized(scale, size),
        )


def unrefined(camera: Camera, disagreeing: tuple[str, ...] = ()) -> RefinedCamera:
    """Return a camera that was not compared with the paint, or does not agree with it."""
    return RefinedCamera(camera=camera, covariance=np.zeros((6, 6)), disagreeing=disagreeing)


def height_prior(measured: float | None) -> tuple[float, float]:
    """Prior median of a camera's height [m] and its spread in log; narrow if it was measured."""
    return CAMERA_HEIGHT_PRIOR if measured is None else (measured, MEASURED_HEIGHT_SIGMA)


def prior_residuals(camera: Camera, height: tuple[float, float]) -> Floats:
    """Deviations of a camera's height and focal length from usual ones, (2,) [standard deviations].

    Parameters
    ----------
    height : see `height_prior`
    """
    middle, spread = height
    usual, focal_spread = FOCAL_PRIOR
    focal = camera.lens.focal_px / (0.5 * np.hypot(*camera.size))
    rise = max(camera.position[2], 1e-3) / middle
    return np.array([np.log(rise) / spread, np.log(focal / usual) / focal_spread])


def log_height_prior(camera: Camera, measured: float | None = None) -> float:
    """Return the prior cost of a camera's height and focal length [squared standard deviations]."""
    return float(np.sum(prior_residuals(camera, height_prior(measured)) ** 2))
