"""Options of the built-in tracker, and its results for a film."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from curling_env.trajectory import Trajectory
from curling_env.typing import Floats, Integers
from friction_estimation.appearance import Appearance
from friction_estimation.camera.camera import Camera
from friction_estimation.camera.refined import RefinedCamera
from friction_estimation.film.stabilisation import Stabiliser
from friction_estimation.tracking import tuning

HANDLE = 4
"""Row of the handle among the colours of an appearance."""


@dataclass(frozen=True, kw_only=True)
class TrackingOptions:
    """Options of the built-in tracker.

    Parameters
    ----------
    gate : largest distance of a measurement from its prediction [m]; two pixels are added to it
    min_visible : least share of the stone that must be seen, 0 to 1
    min_inside : least share of the stone's outline that must lie in the picture, 0 to 1
    refine : whether the paint on the ice corrects the points in the scene, and finds what is
        unknown of the lens
    slow : how many times slower than life the film plays; None goes by what the camera noted
    """

    gate: float = 0.25
    min_visible: float = 0.5
    min_inside: float = 0.98
    refine: bool = True
    slow: float | None = None


@dataclass(frozen=True, kw_only=True, eq=False)
class FilmTrack:
    """Track of one stone in a film, with intermediate results.

    Parameters
    ----------
    trajectory : the smoothed track, with one row for each frame in which the stone was seen
    frame : (n,) index of the frame of each row
    velocity : (n, 2) [m/s]
    spin : (n,) [rad/s]; NaN where the handle does not show it
    frame_count : number of frames in the film
    camera : the camera with which the film was measured
    appearance : what the stone looks like
    refined : the same camera, with how well the paint on the ice agrees with it
    contacts : times at which the stone hit or was hit [s]
    others : tracks of the other stones on the sheet, numbered from 1
    unexplained : what should be looked at in the film, in words: the track may be another stone's
    stabiliser : undoes the camera's sway in a frame; None where the camera stood still
    moved_px : how far the camera has moved since it was solved for earlier films [px]; 0 where it
        stood still or is solved for this film first
    """

    trajectory: Trajectory
    frame: Integers
    velocity: Floats
    spin: Floats
    frame_count: int
    camera: Camera
    appearance: Appearance
    refined: RefinedCamera
    contacts: tuple[float, ...] = ()
    others: tuple[FilmTrack, ...] = ()
    unexplained: tuple[str, ...] = ()
    stabiliser: Stabiliser | None = None
    moved_px: float = 0.0

    @property
    def not_seen(self) -> str:
        """Times at which the stone slid unseen, in words; empty if it was seen all the way."""
        t, velocity = self.trajectory.t, self.velocity[-1]
        long = np.flatnonzero(np.diff(t) > tuning.LONG)
        parts = [f"from {t[k]:.1f} to {t[k + 1]:.1f} s" for k in long]
        a_second = (self.frame[-1] - self.frame[0]) / max(t[-1] - t[0], 1e-9)
        ahead = np.array([[*(self.trajectory.xy[-1] + tuning.LONG * velocity), 0.0]])
        filmed_on = self.frame_count - self.frame[-1] > tuning.LONG * a_second
        if filmed_on and np.hypot(*velocity) > tuning.STANDING and self.camera.sees(ahead)[0]:
            parts.append(f"from {t[-1]:.1f} s on, while it still moves")
        return " and ".join(parts)

    @property
    def handle_colour(self) -> Floats:
        """Colour of the handle, (3,): brightness and two colour differences, as films store it.

        NaN if no handle is seen.
        """
        seen = self.appearance.has_handle
        return self.appearance.colours[HANDLE].copy() if seen else np.full(3, np.nan)

    @property
    def trajectories(self) -> tuple[Trajectory, ...]:
        """Return the tracks of all stones for a tracks file, the thrown stone first."""
        return (self.trajectory, *(other.trajectory for other in self.others))

    def numbered(self, throw: int) -> FilmTrack:
        """Return the same tracks with the number of a throw."""
        return replace(
            self,
            trajectory=replace(self.trajectory, throw=throw),
            others=tuple(other.numbered(throw) for other in self.others),
        )
