"""Coarse path of a stone from the sampled frames, to predict its position in every frame."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from curling_env.typing import Flags, Floats, Integers
from friction_estimation.appearance import StoneModel
from friction_estimation.camera.camera import Camera
from friction_estimation.tracking.association.paths import CARRIED, RESTING, Path
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
    t, xy, likeness : (n,) times [s], (n, 2) places [m] and (n,) likeness of its detections
    alone : (n,) whether nothing that moves touches it there
    mode : (n,) mode at each of them
    smooth : the path through them, on a grid of times
    released : when the thrower lets go, at the latest [s]; -inf if it slides from the beginning
    contacts : about when it is hit or hits [s]
    odds : log odds of a stone against clutter
    """

    t: Floats
    xy: Floats
    likeness: Floats
    alone: Flags
    mode: Integers
    smooth: SmoothPath
    released: float
    contacts: tuple[float, ...]
    odds: float

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

    @property
    def left(self) -> float:
        """Time of the last detection at its first resting place [s]; -inf without one."""
        if self.mode[0] != RESTING:
            return -np.inf
        moves = np.flatnonzero(self.mode != RESTING)
        return float(self.t[moves[0] - 1]) if len(moves) else np.inf

    @property
    def way(self) -> float:
        """Distance between the first and the last position [m]."""
        return float(np.hypot(*(self.xy[-1] - self.xy[0])))


def coarse_path(
    path: Path, seen: Detections, last: float, contacts: Sequence[float] = ()
) -> CoarsePath:
    """Fit a smooth path to the detections of one stone.

    Parameters
    ----------
    path : its detections and modes
    last : when the film ends [s]
    contacts : about when it hits or is hit [s]
    """
    t, xy, sigma = seen.t[path.at], seen.xy[path.at], seen.sigma[path.at]
    carried = np.flatnonzero(path.mode == CARRIED)
    released = float(t[carried[-1]]) if len(carried) else -np.inf
    grid = np.union1d(np.arange(0.0, last + _GRID, _GRID), t)
    at = np.searchsorted(grid, t)
    measured, error = np.full((2, len(grid), 2), np.nan)
    measured[at], error[at] = xy, sigma

    def smoothed(*jumps: float) -> SmoothPath:
        return smooth_path(
            grid, measured, error, released=released, contacts=(*contacts, *jumps), scaled=False
        )

    smooth, _ = smoothed_with_jump(smoothed, released)
    return CoarsePath(
        t=t,
        xy=xy,
        likeness=seen.likeness[path.at],
        alone=seen.alone[path.at],
        mode=path.mode,
        smooth=smooth,
        released=released,
        contacts=tuple(contacts),
        odds=path.odds,
    )
