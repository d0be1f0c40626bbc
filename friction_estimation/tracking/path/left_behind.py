"""Where a track slows down more than ice slows a stone: it may have stayed behind.

On dark paint a codec may leave an old picture of the stone, which the track keeps to while the
stone slides on. Whatever it is that a track keeps to, no stone stops as fast.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from curling_env.typing import Floats
from friction_estimation.appearance import StoneFit
from friction_estimation.camera.camera import Camera
from friction_estimation.tracking import tuning
from friction_estimation.tracking.path.scatter import Scattered, metres_per_px


@dataclass(frozen=True, kw_only=True, eq=False)
class LeftBehind:
    """A track that slows down more than ice slows a stone.

    Parameters
    ----------
    since : from when on [s]
    place, velocity : (2,) of the stone then [m] and [m/s]
    """

    since: float
    place: Floats
    velocity: Floats

    def by(self, t: Floats, xy: Floats) -> Floats:
        """How far from places (n, 2) the stone may have slid on at times (n,) [s], (n,) [m]."""
        pace = float(np.hypot(*self.velocity))
        slides = np.clip(t - self.since, 0.0, pace / tuning.HIDDEN_DECELERATION)
        way = slides - 0.5 * tuning.HIDDEN_DECELERATION * slides**2 / pace
        there = self.place + way[:, None] * self.velocity
        return np.where(t > self.since, np.linalg.norm(there - xy, axis=1), 0.0)


def left_behind(
    t: Floats,
    fits: Sequence[StoneFit | None],
    camera: Camera,
    height: float,
    stretches: Sequence[Scattered],
) -> LeftBehind | None:
    """Where a thrown stone seems to stop faster than on ice; None where it does not.

    Parameters
    ----------
    t, fits : (n,) times [s] and measurements; None where the stone was not seen
    height : at which the stone is seen, above the ice [m]
    stretches : where its places scatter; they tell no speed
    """
    seen = [k for k, fit in enumerate(fits) if fit is not None]
    if len(seen) < 4 * tuning.LEAST_BESIDE:
        return None
    moments = np.asarray(t)[seen]
    xy = np.array([fit.xy for fit in fits if fit is not None])
    around = tuning.STOPS_WITHIN
    for k in np.flatnonzero(np.abs(xy[:, 1] - xy[0, 1]) > tuning.OUT_OF_HAND).tolist():
        before = (moments < moments[k]) & (moments > moments[k] - around)
        after = (moments >= moments[k]) & (moments < moments[k] + around)
        if min(before.sum(), after.sum()) < tuning.LEAST_BESIDE:
            continue
        if any(one.first < moments[k] < one.last + around for one in stretches):
            continue
        (v0, s0), (v1, s1) = (velocity_of(moments[one], xy[one]) for one in (before, after))
        between = moments[after].mean() - moments[before].mean()
        slowing = (np.hypot(*v0) - np.hypot(*v1)) / between
        doubt = float(np.hypot(*np.hypot(s0, s1))) / between
        if slowing - tuning.SURELY_SLOWS * doubt < tuning.MOST_SLOWING:
            continue
        last = int(np.flatnonzero(before)[-1])
        found = LeftBehind(since=float(moments[last]), place=xy[last], velocity=v0)
        later = np.flatnonzero(after)[-tuning.LEAST_BESIDE :]
        lag = float(np.median(found.by(moments[later], xy[later])))
        if lag > tuning.LEFT_PX * metres_per_px(camera, xy[k : k + 1], height)[0]:
            return found
    return None


def velocity_of(t: Floats, xy: Floats) -> tuple[Floats, Floats]:
    """Velocity (2,) along a straight line through places (n, 2), and its standard error [m/s]."""
    since = t - t.mean()
    spread = float(since @ since)
    velocity = since @ xy / spread
    left = xy - xy.mean(axis=0) - since[:, None] * velocity
    return velocity, np.sqrt((left**2).sum(axis=0) / max(len(t) - 2, 1) / spread) + 1e-6
