"""The free slide: the part of a track on which friction alone acts.

A film shows more than the free slide: the stone held or pushed by a player, the stone at rest,
frames in which the tracker followed something else. Only the free slide tells about the ice.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from curling_env.errors import TrackTooShortError
from curling_env.physics.compiled import compiled
from curling_env.sheet import HOG_LINE_Y
from curling_env.trajectory import Trajectory
from curling_env.typing import Flags, Floats, Indices
from friction_estimation.tracks.contacts import contacts_of, longest_stretch, stays_at_rest
from friction_estimation.tracks.outliers import wild_rows
from friction_estimation.tracks.smoothing import SmoothedMotion, smooth_motion
from friction_estimation.tracks.tuning import (
    AFTER_PUSH_ENDS,
    BEFORE_PUSH_ENDS,
    CLEAR_DEVIATIONS,
    MIN_MOVING_SPEED,
    MIN_SAMPLES,
    MIN_TRAVEL,
    PUSHED_DECELERATION,
)


@dataclass(frozen=True, kw_only=True)
class FreeSlide:
    """The rows of a track on which friction alone acts.

    Parameters
    ----------
    track : the whole track
    rows : (k,) indices into the track, in order of time, without wild rows
    released_at : time of the first of them [s]
    rests : whether the stone came to rest by itself at the end of the track
    wild : number of rows of the track left out as wild
    noise : robust standard deviation of one coordinate [m]
    """

    track: Trajectory
    rows: Indices
    released_at: float
    rests: bool
    wild: int
    noise: float

    @property
    def t(self) -> Floats:
        """Times of the rows [s]."""
        return self.track.t[self.rows]

    @property
    def xy(self) -> Floats:
        """Positions of the rows, (k, 2) [m]."""
        return self.track.xy[self.rows]

    @property
    def duration(self) -> float:
        """Time between the first and the last row [s]."""
        return float(self.t[-1] - self.t[0])


def free_slide(track: Trajectory, contacts: Sequence[float] = ()) -> FreeSlide:
    """The part of a track after the stone left the hand and before it rests or is stopped.

    The end is where the stone has reached its last place, or where it is slowed or turned more than
    ice can. The beginning is found in three steps: the stone moves; the last moment at which a push
    ended, which shows as deceleration that sets in; and the delivery hog line, before which the
    rules want the stone released. Rows before that line are used only where there are enough of
    them to show that nobody pushed. Of a stone that struck or was struck, the longest way between
    contacts is taken.

    Parameters
    ----------
    track : track of one stone
    contacts : times at which it touched another stone [s]

    Raises
    ------
    TrackTooShortError : no free slide of a metre and 20 samples
    """
    if len(contacts):
        first, last = longest_stretch(track, contacts)
        part = free_slide(_rows_of(track, first, last))
        return replace(part, track=track, rows=part.rows + first)
    name = f"throw {track.throw}"
    if len(track) < MIN_SAMPLES:
        raise TrackTooShortError(f"{name} has {len(track)} samples, needs {MIN_SAMPLES}")
    wild, noise = wild_rows(track.t, track.xy)
    rows = np.flatnonzero(~wild)
    if len(rows) < MIN_SAMPLES:
        raise TrackTooShortError(f"{name}: {int(wild.sum())} of {len(track)} rows are wild")
    t, xy = track.t[rows], track.xy[rows]
    motion = smooth_motion(t, xy, window=0.6, noise=noise)
    fast = motion.speed > max(MIN_MOVING_SPEED, 4 * float(np.median(motion.speed_sigma)))
    if not fast.any():
        raise TrackTooShortError(f"{name}: the stone does not move")
    begin, end = _longest_run(fast)
    begin += int(np.argmax(motion.speed[begin:end] > 0.6 * motion.speed[begin:end].max()))
    stop, rests = _end_of_slide(t, motion, begin, end)
    start = _release(t, xy, motion, begin, stop, noise)
    kept = rows[start:stop]
    travel = float(np.hypot(*(track.xy[kept[-1]] - track.xy[kept[0]]))) if len(kept) else 0.0
    if len(kept) < MIN_SAMPLES or travel < MIN_TRAVEL:
        raise TrackTooShortError(
            f"{name}: only {travel:.2f} m and {len(kept)} samples of free sliding, "
            f"needs {MIN_TRAVEL:g} m and {MIN_SAMPLES}"
        )
    return FreeSlide(
        track=track,
        rows=kept,
        released_at=float(track.t[kept[0]]),
        rests=rests,
        wild=int(wild.sum()),
        noise=noise,
    )


def free_slides(tracks: Sequence[Trajectory]) -> tuple[list[FreeSlide], list[str]]:
    """The free slides of all tracks that have one, and the reasons why others have none.

    Parameters
    ----------
    tracks : tracks of one session; the stones of one throw share its number

    Raises
    ------
    TrackTooShortError : no track has a free slide
    """
    slides: list[FreeSlide] = []
    reasons: list[str] = []
    for track, contacts in zip(tracks, contacts_of(tracks), strict=True):
        if stays_at_rest(track) and len(tracks) > 1:
            continue  # a resting stone beside the thrown one
        try:
            slides.append(free_slide(track, contacts))
        except TrackTooShortError as error:
            reasons.append(error.problem)
    if not slides:
        more = f" ({len(reasons) - 1} more like it)" if len(reasons) > 1 else ""
        reason = reasons[0] if reasons else "every stone lies still"
        raise TrackTooShortError(f"no throw slides freely: {reason}{more}")
    return slides, reasons


def _rows_of(track: Trajectory, first: int, last: int) -> Trajectory:
    columns = ("t", "xy", "theta", "swept", "sigma_xy", "sigma_theta")
    return replace(track, **{name: getattr(track, name)[first:last] for name in columns})


def _longest_run(flags: Flags) -> tuple[int, int]:
    """First and past-last index of the longest run of true flags."""
    edges = np.diff(np.concatenate([[0], flags.astype(int), [0]]))
    starts, ends = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)
    k = int(np.argmax(ends - starts))
    return int(starts[k]), int(ends[k])


def _end_of_slide(t: Floats, motion: SmoothedMotion, begin: int, end: int) -> tuple[int, bool]:
    """Past-last index of the free slide, and whether the stone came to rest by itself."""
    middle = motion.acceleration[begin:end]
    usual = max(-float(np.median(middle)), 0.01)
    sigma = np.maximum(motion.acceleration_sigma, 1e-9)
    # Ice decelerates by some hundredths of g; a board, a broom or another stone by much more.
    stopped = motion.acceleration < -5 * usual - CLEAR_DEVIATIONS * sigma
    stopped[: begin + 5] = False
    hit = np.flatnonzero(stopped[:end])
    if hit.size:
        until = t[hit[0]] - 0.4
        return max(int(np.searchsorted(t, until)), begin), False
    if end == len(t):
        # The track ends with the slide: at rest if the last two seconds lead to a standstill.
        last = t >= t[-1] - 2.0
        if last.sum() < 8:
            return end, False
        slowing = np.polynomial.polynomial.polyfit(t[last] - t[-1], motion.distance[last], 2)
        return end, bool(slowing[1] < MIN_MOVING_SPEED)
    # The last centimetres belong to the slide; they take speed/deceleration.
    until = t[end - 1] + 1.2 * motion.speed[end - 1] / usual
    return int(np.searchsorted(t, until, side="right")), True


def _release(
    t: Floats, xy: Floats, motion: SmoothedMotion, begin: int, stop: int, noise: float
) -> int:
    """Index of the first row after the release."""
    forward = 1.0 if xy[stop - 1, 1] >= xy[begin, 1] else -1.0
    pushed_until = _end_of_push(t, motion.distance, begin, stop, noise)
    released = int(np.searchsorted(t, pushed_until + 0.1)) if pushed_until is not None else begin
    at_line = -HOG_LINE_Y - 4 * noise
    crossing = begin + int(np.argmax(forward * xy[begin:stop, 1] >= at_line))
    lead = t[crossing] - t[released]
    if crossing > released and (pushed_until is None and lead < 1.5):
        return crossing
    return released


def _end_of_push(t: Floats, distance: Floats, begin: int, stop: int, noise: float) -> float | None:
    """Last time at which a push ended, or None if none is seen [s].

    For each candidate time a quadratic is fitted to the rows shortly before and after it, with
    another acceleration before. The candidate at which the two accelerations differ most clearly,
    and by more than ice can explain, is the end of a push.
    """
    latest = t[begin] + 0.5 * (t[stop - 1] - t[begin])
    times = np.arange(t[begin] + 0.25, latest, 0.05)
    if not len(times):
        return None
    after, change, sigma = _accelerations_about(times, t[begin:stop], distance[begin:stop], noise)
    certainty = change / sigma
    a_push_ends = (
        (after < 0) & (change > (1 - PUSHED_DECELERATION) * -after) & (certainty > CLEAR_DEVIATIONS)
    )
    if not a_push_ends.any():
        return None
    return float(times[np.argmax(np.where(a_push_ends, certainty, 0.0))])


def _accelerations_about(
    times: Floats, t: Floats, distance: Floats, noise: float
) -> tuple[Floats, Floats, Floats]:
    """Acceleration after each time, how much more there was before it, and the error of that.

    Parameters
    ----------
    times : (m,) times [s]
    t : (n,) times of the rows [s]
    distance : (n,) distance along the path [m]
    noise : least standard deviation of the distances [m]

    Returns
    -------
    three arrays (m,) [m/s²]; the error is infinite where there are too few rows
    """
    grams, counts = np.zeros((len(times), 5, 5)), np.zeros((len(times), 2))
    _sum_products(times, t, distance, np.empty(5), grams, counts)
    known = np.flatnonzero((counts[:, 0] >= 6) & (counts[:, 1] >= 15))
    after, change, sigma = np.zeros(len(times)), np.zeros(len(times)), np.full(len(times), np.inf)
    inverse, right = np.linalg.inv(grams[known, :4, :4]), grams[known, :4, 4]
    solution = np.einsum("kij,kj->ki", inverse, right)
    left = np.maximum(grams[known, 4, 4] - np.einsum("ki,ki->k", solution, right), 0.0)
    spread = np.sqrt(left / np.maximum(counts[known].sum(axis=1) - 4, 1))
    after[known], change[known] = solution[:, 2], solution[:, 3]
    sigma[known] = np.maximum(noise, spread) * np.sqrt(inverse[:, 3, 3])
    return after, change, sigma


@compiled
def _sum_products(
    times: Floats, t: Floats, distance: Floats, row: Floats, grams: Floats, counts: Floats
) -> None:
    """Sums of products of a fit's columns, and the distance, about each time.

    Parameters
    ----------
    times : (m,) times [s]
    t, distance : (n,) times of the rows [s] and distances [m]
    row : (5,) room for a row of the fit: 1, u, u²/2, the same before the time only, distance
    grams : (m, 5, 5) zeros, that the sums are added to
    counts : (m, 2) zeros, that the numbers of rows before and after are added to
    """
    for k in range(len(times)):
        for i in range(len(t)):
            u = t[i] - times[k]
            if u < -BEFORE_PUSH_ENDS or u >= AFTER_PUSH_ENDS:
                continue
            if u < 0:
                counts[k, 0] += 1
            elif u > 0:
                counts[k, 1] += 1
            row[0], row[1], row[2], row[3] = 1.0, u, 0.5 * u**2, 0.5 * min(u, 0.0) ** 2
            row[4] = distance[i] - distance[0]
            for p in range(5):
                for q in range(5):
                    grams[k, p, q] += row[p] * row[q]
