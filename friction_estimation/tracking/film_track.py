"""What a user may choose when a film is tracked, and what comes of it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from curling_env.trajectory import Trajectory
from curling_env.typing import Floats
from friction_estimation.appearance import Appearance
from friction_estimation.camera.camera import Camera
from friction_estimation.camera.refinement import RefinedCamera
from friction_estimation.film.stabilisation import Stabiliser
from friction_estimation.tracking.optical_flow import Flow


@dataclass(frozen=True, kw_only=True)
class TrackingOptions:
    """What a user may choose.

    Parameters
    ----------
    flow : Lucas-Kanade in one scale or in a pyramid
    gate : largest distance of a fit from its prediction [m], beside what the picture's scale asks
    min_visible : least share of the stone that must be seen, 0 to 1
    min_inside : least share of the stone's outline that must lie in the image, 0 to 1
    refine : let the paint on the ice correct the points that were marked, and find what is not
        known of the lens
    """

    flow: Flow = "pyramidal"
    gate: float = 0.25
    min_visible: float = 0.5
    min_inside: float = 0.98
    refine: bool = True


@dataclass(frozen=True, kw_only=True, eq=False)
class FilmTrack:
    """What one film gave.

    Parameters
    ----------
    trajectory : the smoothed track; rows only where the stone was seen
    frame : (n,) index of the frame of each row
    velocity : (n, 2) [m/s]
    spin : (n,) [rad/s], NaN without a handle
    frame_count : frames of the film
    camera, look : what the film was read with
    landmarks : how well the paint on the ice agrees with the camera
    contacts : moments at which it struck or was struck [s]
    others : tracks of the other stones on the sheet, numbered from 1
    stabiliser : puts the frames back where the camera swayed; None where it stood still
    """

    trajectory: Trajectory
    frame: NDArray[np.int64]
    velocity: Floats
    spin: Floats
    frame_count: int
    camera: Camera
    look: Appearance
    landmarks: RefinedCamera
    contacts: tuple[float, ...] = ()
    others: tuple[FilmTrack, ...] = ()
    stabiliser: Stabiliser | None = None

    @property
    def trajectories(self) -> tuple[Trajectory, ...]:
        """Of all stones, the thrown one first, as they stand in a tracks file."""
        return (self.trajectory, *(other.trajectory for other in self.others))
