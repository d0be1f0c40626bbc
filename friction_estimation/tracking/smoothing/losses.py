"""Losses of more speed than ice takes from a stone: in a hit, or because the track stays behind.

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
from friction_estimation.tracking import numbers
from friction_estimation.tracking.smoothing.scatter import Scattered, metres_per_px


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
        """Return how far from places (n, 2) it may have slid on at times (n,) [s], (n,) [m]."""
        pace = float(np.hypot(*self.velocity))
        slides = np.clip(t - self.since, 0.0, pace / numbers.HIDDEN_DECELERATION)
        way = slides - 0.5 * numbers.HIDDEN_DECELERATION * slides**2 / pace
        there = self.place + way[:, None] * self.velocity
        return np.where(t > self.since, np.linalg.norm(there - xy, axis=1), 0.0)


def left_behind(
    t: Floats,
    fits: Sequence[StoneFit | None],
    camera: Camera,
    height: float,
    stretches: Sequence[Scattered],
) -> LeftBehind | None:
    """Find where a thrown stone seems to stop faster than on ice; None if not, or if it was hit.

    Parameters
    ----------
    t, fits : (n,) times [s] and measurements; None where the stone was not seen
    height : at which the stone is seen, above the ice [m]
    stretches : where its places scatter; they tell no speed
    """
    moments, xy = _seen(t, fits)
    if len(moments) < 4 * numbers.LEAST_BESIDE:
        return None
    if sudden_loss(t, fits, camera, height) is not None:
        return None
    around = numbers.STOPS_WITHIN
    for k in np.flatnonzero(np.abs(xy[:, 1] - xy[0, 1]) > numbers.OUT_OF_HAND).tolist():
        before = (moments < moments[k]) & (moments > moments[k] - around)
        after = (moments >= moments[k]) & (moments < moments[k] + around)
        if min(before.sum(), after.sum()) < numbers.LEAST_BESIDE:
            continue
        if any(one.first < moments[k] < one.last + around for one in stretches):
            continue
        (v0, s0), (v1, s1) = (_velocity(moments[one], xy[one]) for one in (before, after))
        between = moments[after].mean() - moments[before].mean()
        slowing = (np.hypot(*v0) - np.hypot(*v1)) / between
        doubt = float(np.hypot(*np.hypot(s0, s1))) / between
        if slowing - numbers.SURELY_SLOWS * doubt < numbers.MOST_SLOWING:
            continue
        last = int(np.flatnonzero(before)[-1])
        found = LeftBehind(since=float(moments[last]), place=xy[last], velocity=v0)
        later = np.flatnonzero(after)[-numbers.LEAST_BESIDE :]
        lag = float(np.median(found.by(moments[later], xy[later])))
        if lag > numbers.LEFT_PX * metres_per_px(camera, xy[k : k + 1], height)[0]:
            return found
    return None


def sudden_loss(
    t: Floats,
    fits: Sequence[StoneFit | None],
    camera: Camera,
    height: float,
    contacts: Sequence[float] = (),
) -> float | None:
    """Return when a thrown stone lost more speed at once than ice takes [s]; None if it did not.

    Parameters
    ----------
    t, fits : (n,) times [s] and measurements; None where the stone was not seen
    camera, height : that filmed, and at which the stone is seen above the ice [m]: what is less
        than a pixel may be seen wrongly
    contacts : when it is known to have touched others [s]
    """
    t, xy = _seen(t, fits)
    if len(t) < 4 * numbers.LEAST_BESIDE:
        return None
    worst, when = numbers.SUDDEN_LOSS, None
    for k in np.flatnonzero(np.abs(xy[:, 1] - xy[0, 1]) > numbers.OUT_OF_HAND):
        at = (t[k - 1] + t[k]) / 2
        if any(abs(at - c) < 2 * numbers.BESIDE_SECONDS for c in contacts):
            continue
        before = (t < at) & (t > at - numbers.BESIDE_SECONDS)
        after = (t > at) & (t < at + numbers.BESIDE_SECONDS)
        if min(before.sum(), after.sum()) < numbers.LEAST_BESIDE:
            continue
        (v0, s0), (v1, s1) = (_velocity(t[part], xy[part]) for part in (before, after))
        change = v0 - v1
        sure = np.abs(change) > numbers.SURE_LOSS * np.hypot(s0, s1)
        loss = float(np.hypot(*np.where(sure, change, 0.0)))
        if loss < worst:
            continue
        pixel = metres_per_px(camera, xy[k : k + 1], height)[0]
        lasts = _missed_by(t, xy, int(k)) > numbers.SUDDEN_LOSS_PX * pixel
        if lasts and np.hypot(*v1) < np.hypot(*v0):
            worst, when = loss, float(at)
    return when


def _missed_by(t: Floats, xy: Floats, k: int) -> float:
    """Return the later distance of a stone from its extrapolated motion before place k [m].

    For a moment a place may be wrong by part of a pixel; what is lost in a hit stays lost.
    """
    before = (t < t[k]) & (t >= t[k] - numbers.LOST_FOR)
    later = np.flatnonzero((t >= t[k]) & (t <= t[k] + numbers.LOST_FOR))[-numbers.LEAST_BESIDE :]
    velocity, _ = _velocity(t[before], xy[before])
    since = t[later].mean() - t[before].mean()
    pace = max(float(np.hypot(*velocity)), 1e-6)
    since = min(since, pace / numbers.DECELERATION)
    way = (since - 0.5 * numbers.DECELERATION * since**2 / pace) * velocity
    return float(np.hypot(*(xy[later].mean(axis=0) - xy[before].mean(axis=0) - way)))


def _seen(t: Floats, fits: Sequence[StoneFit | None]) -> tuple[Floats, Floats]:
    """Times [s] and places (n, 2) [m] in which the stone was seen."""
    seen = [k for k, fit in enumerate(fits) if fit is not None]
    xy = np.array([fit.xy for fit in fits if fit is not None]).reshape(-1, 2)
    return np.asarray(t, dtype=np.float64)[seen], xy


def _velocity(t: Floats, xy: Floats) -> tuple[Floats, Floats]:
    """Velocity (2,) along a straight line through places (n, 2), and its standard error [m/s]."""
    since = t - t.mean()
    spread = float(since @ since)
    velocity = since @ xy / spread
    left = xy - xy.mean(axis=0) - since[:, None] * velocity
    return velocity, np.sqrt((left**2).sum(axis=0) / max(len(t) - 2, 1) / spread) + 1e-6
