"""Times of contacts, from the tracks of a throw together and from each separately.

Two stones that come within a diameter of each other touch. The track of a single stone shows a
contact too: its velocity changes suddenly, by more than ice can change it and by more than the
noise of the track.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import combinations, groupby, pairwise

import numpy as np

from curling_env.sheet import HOG_LINE_Y, Stone
from curling_env.trajectory import Trajectory
from curling_env.typing import Flags, Floats
from friction_estimation.tracks.local_changes import changes_about
from friction_estimation.tracks.outliers import wild_rows
from friction_estimation.tracks.smoothing import smooth_motion
from friction_estimation.tracks.tuning import (
    CLEAR_DEVIATIONS,
    CONTACT_TIME_MARGIN,
    HARD_HIT,
    JUMP_ROWS,
    JUMP_WINDOWS,
    MAX_JUMP_BY_ICE,
    MIN_CONTACT_SPEED,
    MIN_JUMP,
    MIN_NOISE,
    MIN_SAMPLES,
    MIN_THROWN_DISTANCE,
    TOUCHING_SLACK,
)

_DIAMETER = 2 * Stone().radius


def contacts_of(tracks: Sequence[Trajectory]) -> list[list[float]]:
    """Return the times at which each stone was touched, one list for each track [s].

    Parameters
    ----------
    tracks : tracks of a session; the stones of one throw share its number and are adjacent
    """
    found = [velocity_jumps(track) for track in tracks]
    for _, group in groupby(range(len(tracks)), key=lambda k: tracks[k].throw):
        for one, other in combinations(group, 2):
            for time in _meetings(tracks[one], tracks[other]):
                found[one].append(time)
                found[other].append(time)
    return [sorted(times) for times in found]


def stays_at_rest(track: Trajectory) -> bool:
    """Return whether a track is that of an untouched stone: two rows of one place."""
    return len(track) == 2 and bool((np.ptp(track.xy, axis=0) < 0.05).all())


def stretches(track: Trajectory, contacts: Sequence[float]) -> Iterator[tuple[int, int]]:
    """Return the first and past-last row of each stretch between contacts.

    Rows at a contact may be on either side of it, and are in neither.

    Parameters
    ----------
    track : track of one stone
    contacts : times at which it was touched [s]
    """
    for begin, end in pairwise([-np.inf, *sorted(contacts), np.inf]):
        first = int(np.searchsorted(track.t, begin + CONTACT_TIME_MARGIN, side="right"))
        last = int(np.searchsorted(track.t, end - CONTACT_TIME_MARGIN))
        if last > first:
            yield first, last


# --- two stones ----------------------------------------------------------------------------------


def _meetings(one: Trajectory, other: Trajectory) -> Iterator[float]:
    """Return the times at which two stones of a throw begin and cease to touch [s].

    A struck stone may be tracked from the first frame after the contact on. Between two frames a
    stone may have come nearer than seen, by a part of its path from frame to frame.
    """
    if len(one) < 2 or len(other) < 2 or (stays_at_rest(one) and stays_at_rest(other)):
        return
    frame = max(float(np.median(np.diff(track.t))) for track in (one, other) if len(track) > 2)
    begin = max(float(one.t[0]), float(other.t[0]))
    end = min(float(one.t[-1]), float(other.t[-1]))
    t = np.union1d(one.t, other.t)
    t = t[(t >= begin - 1.5 * frame) & (t <= end + 1e-9)]
    if len(t) < 2:
        return
    apart = one.at(t) - other.at(t)
    ways = np.hypot(*np.diff(apart, axis=0).T)
    near = np.maximum(np.append(ways, ways[-1]), np.append(ways[0], ways))
    slack = 0.0 if stays_at_rest(one) or stays_at_rest(other) else TOUCHING_SLACK + 0.6 * near
    touching = np.hypot(*apart.T) < _DIAMETER + np.minimum(slack, _DIAMETER)
    edges = np.flatnonzero(np.diff(np.concatenate([[0], touching.astype(int), [0]])))
    for first, past in zip(edges[::2], edges[1::2], strict=True):
        yield float(t[first])
        if t[past - 1] - t[first] > CONTACT_TIME_MARGIN:
            yield float(t[past - 1])


# --- one stone -----------------------------------------------------------------------------------


def velocity_jumps(track: Trajectory) -> list[float]:
    """Return the times of sudden changes of a stone's velocity, beyond the delivery hog line [s].

    Around every time, in windows of several lengths, a parabola is fitted with another velocity
    before than after. The change must exceed the noise of the whole track, and the effect of any
    change of friction within the window.

    Parameters
    ----------
    track : track of one stone
    """
    if len(track) < MIN_SAMPLES:
        return []
    wild, _ = wild_rows(track.t, track.xy)
    kept = ~wild & _beyond_delivery(track.xy)
    if kept.sum() < MIN_SAMPLES:
        return []
    return sorted(_Jumps(track.t[kept], track.xy[kept]).all())


def _beyond_delivery(xy: Floats) -> Flags:
    """Return the rows after the delivery by hand."""
    way = float(xy[-1, 1] - xy[0, 1])
    if abs(way) < MIN_THROWN_DISTANCE:
        return np.ones(len(xy), dtype=bool)
    return np.sign(way) * xy[:, 1] >= -HOG_LINE_Y


class _Jumps:
    """Search for jumps of the velocity in one track.

    Parameters
    ----------
    t, xy : rows without outliers
    """

    def __init__(self, t: Floats, xy: Floats) -> None:
        self._t, self._xy = t, xy
        motion = smooth_motion(t, xy)
        moving = motion.speed > MIN_CONTACT_SPEED
        self._speed = motion.speed
        shortest = max(JUMP_WINDOWS[0], JUMP_ROWS * float(np.median(np.diff(t))))
        self._windows = [shortest, *(w for w in JUMP_WINDOWS if w > shortest)]
        deceleration = float(np.median(-motion.acceleration[moving])) if moving.any() else 0.0
        self._usual = max(deceleration, 0.01)
        self._excess: list[Floats] = []
        for window in self._windows:
            times = np.arange(t[0], t[-1], window / 8)
            self._excess.append(_excess(self._changes(0, len(t), times, window)[1]))

    def all(self) -> Iterator[float]:
        """Return every jump, unordered [s]."""
        parts = [(0, len(self._t))]
        while parts:
            first, last = parts.pop()
            time = self._clearest(first, last)
            if time is None:
                continue
            yield time
            until, since = np.searchsorted(
                self._t, [time - CONTACT_TIME_MARGIN, time + CONTACT_TIME_MARGIN]
            )
            parts += [(first, max(int(until), first)), (min(int(since), last), last)]

    def _clearest(self, first: int, last: int) -> float | None:
        """Return the clearest jump within some rows, in the shortest window that shows one [s]."""
        t = self._t[first:last]
        for window, usual_excess in zip(self._windows, self._excess, strict=True):
            if len(t) < 6:
                break
            step = max(window / 8, float(np.median(np.diff(t))))
            times = np.arange(t[2] + 0.5 * step, t[-3], step)
            size, deviations = self._changes(first, last, times, window)
            by_ice = max(MIN_JUMP, MAX_JUMP_BY_ICE * self._usual * window)
            excess = np.minimum(usual_excess, _excess(deviations))
            threshold = CLEAR_DEVIATIONS * np.where(size > HARD_HIT * by_ice, *excess)
            is_clear = (deviations > threshold) & (size > by_ice) & self._moved(times)
            if is_clear.any():
                time = float(times[np.argmax(np.where(is_clear, deviations, 0.0))])
                return self._placed(first, last, time, window)
        return None

    def _placed(self, first: int, last: int, time: float, window: float) -> float:
        """Refine the time of a jump [s] if rows around it are outliers or lost."""
        t = self._t[first:last]
        low, high = np.searchsorted(t, [time - window, time + window])
        low, high = max(int(low) - 1, 0), min(int(high), len(t) - 1)
        widest = low + int(np.argmax(np.diff(t[low : high + 1])))
        gap = float(t[widest + 1] - t[widest])
        if gap < 1.5 * float(np.median(np.diff(t))):
            return time
        times = np.linspace(t[widest], t[widest + 1], 21)
        _, deviations = self._changes(first, last, times, gap + window)
        return float(times[np.argmax(deviations)]) if deviations.any() else time

    def _moved(self, times: Floats) -> Flags:
        """Return whether the stone moved shortly before some times: a stone at rest is not hit on
        its path.
        """
        before = [np.interp(times - shift, self._t, self._speed) for shift in (0.5, 0.75, 1.0)]
        return np.min(before, axis=0) > MIN_CONTACT_SPEED

    def _changes(
        self, first: int, last: int, times: Floats, window: float
    ) -> tuple[Floats, Floats]:
        """Return changes of the velocity at some times [m/s], and the same in standard errors."""
        found = [
            changes_about(
                times,
                self._t[first:last],
                self._xy[first:last, axis],
                span=(window, window),
                order=1,
                least_rows=(3, 3),
            )
            for axis in (0, 1)
        ]
        size = np.hypot(*(one.change for one in found))
        known = np.isfinite(found[0].gain)
        if not known.any():
            return size, np.zeros(len(times))
        usual = [max(float(np.median(one.spread[known])), MIN_NOISE) for one in found]
        return size, np.hypot(
            *(one.deviations(noise) for one, noise in zip(found, usual, strict=True))
        )


def _excess(deviations: Floats) -> Floats:
    """Return the usual change of the velocity over that of rows with independent noise, (2,).

    The first is by the lowest quarter of the changes, which hard hits do not affect even in a short
    track; the second by the lower half, which is more accurate.
    """
    squares = deviations[deviations > 0] ** 2
    if not len(squares):
        return np.ones(2)
    low = np.quantile(squares, [0.25, 0.5])
    # Quantiles of the sum of two squares of normal deviates.
    return np.maximum.accumulate(np.maximum(1.0, np.sqrt(low / (2 * np.log([4 / 3, 2.0])))))
