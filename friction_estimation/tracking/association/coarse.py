"""Coarse path of a stone from the sampled frames, to predict its position in every frame."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from curling_env.typing import Flags, Floats, Integers
from friction_estimation.appearance import StoneModel
from friction_estimation.camera.camera import Camera
from friction_estimation.tracking.association.paths import CARRIED
from friction_estimation.tracking.detection.detections import Detections
from friction_estimation.tracking.smoothing.misfits import smoothed_with_jump
from friction_estimation.tracking.smoothing.smoother import SmoothPath, smooth_path

_GRID = 0.1
"""Time step of a path [s]."""


@dataclass(frozen=True, kw_only=True, eq=False)
class CoarsePath:
    """Position of a stone at any time, with its standard error.

    Parameters
    ----------
    t, xy, sigma : (n,) times [s], (n, 2) places and their standard errors [m] of its detections
    likeness : (n,) their likeness
    alone : (n,) whether nothing that moves touches it there
    smooth : the path through them, on a grid of times
    released : when the thrower lets go, at the latest [s]; -inf if it slides from the beginning
    contacts : about when it is hit or hits [s]
    """

    t: Floats
    xy: Floats
    sigma: Floats
    likeness: Floats
    alone: Flags
    smooth: SmoothPath
    released: float
    contacts: tuple[float, ...]

    def at(self, t: float) -> tuple[Floats, Floats, Floats]:
        """Place [m], velocity [m/s] and standard error [m] at a time, each (2,)."""
        times = self.smooth.t
        after = min(max(int(np.searchsorted(times, t)), 1), len(times) - 1)
        share = (t - times[after - 1]) / (times[after] - times[after - 1])
        before = self._motion[after - 1]
        now = before + min(max(share, 0.0), 1.0) * (self._motion[after] - before)
        return now[:2], now[2:4], now[4:]

    @cached_property
    def _motion(self) -> Floats:
        """Place, velocity and standard error at the times of the path, (n, 6)."""
        return np.hstack([self.smooth.place, self.smooth.velocity, self.smooth.sigma])

    def seen_by(self, found_by: Camera, camera: Camera, model: StoneModel) -> CoarsePath:
        """Convert the positions to those of the same pixels in another camera."""
        if camera is found_by:
            return self
        height = model.height / 2

        def moved(xy: Floats) -> Floats:
            px = found_by.project(np.column_stack([xy, np.full(len(xy), height)]))
            return camera.on_plane(px, height)

        smooth = replace(self.smooth, place=moved(self.smooth.place))
        return replace(self, xy=moved(self.xy), smooth=smooth)

    def through(self, places: Floats) -> CoarsePath:
        """Return the path through fitted places instead of some of the detected ones.

        Their standard errors stay those of detections, or a hit whose time is known to a tenth of
        a second would put the path beside the places around it.

        Parameters
        ----------
        places : (n, 2) fitted place at each detection [m]; NaN where none was fitted
        """
        xy = np.where(np.isfinite(places), places, self.xy)
        last = float(self.smooth.t[-1])
        smooth = _smoothed(self.t, xy, self.sigma, last, self.released, self.contacts)
        return replace(self, xy=xy, smooth=smooth)


def coarse_path(
    at: Integers, mode: Integers, seen: Detections, last: float, contacts: Sequence[float] = ()
) -> CoarsePath:
    """Fit a smooth path to the detections of one stone.

    Parameters
    ----------
    at, mode : (n,) indices of its detections, and its mode at each
    last : when the film ends [s]
    contacts : about when it hits or is hit [s]
    """
    t, xy, sigma = seen.t[at], seen.xy[at], seen.sigma[at]
    carried = np.flatnonzero(mode == CARRIED)
    released = float(t[carried[-1]]) if len(carried) else -np.inf
    return CoarsePath(
        t=t,
        xy=xy,
        sigma=sigma,
        likeness=seen.likeness[at],
        alone=seen.alone[at],
        smooth=_smoothed(t, xy, sigma, last, released, contacts),
        released=released,
        contacts=tuple(contacts),
    )


def _smoothed(
    t: Floats, xy: Floats, sigma: Floats, last: float, released: float, contacts: Sequence[float]
) -> SmoothPath:
    """Return the smooth path through places; see `CoarsePath` and `coarse_path`."""
    grid = np.union1d(np.arange(0.0, last + _GRID, _GRID), t)
    row = np.searchsorted(grid, t)
    measured, error = np.full((2, len(grid), 2), np.nan)
    measured[row], error[row] = xy, sigma

    def smoothed(*jumps: float) -> SmoothPath:
        return smooth_path(
            grid, measured, error, released=released, contacts=(*contacts, *jumps), scaled=False
        )

    return smoothed_with_jump(smoothed, released)[0]
