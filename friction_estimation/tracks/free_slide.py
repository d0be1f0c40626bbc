"""Free slide: the part of a track on which friction alone acts.

A film shows more than the free slide: the stone held or pushed by a player, the stone at rest,
frames in which the tracker followed something else. Only the free slide is evidence on the ice.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from curling_env.errors import TrackTooShortError
from curling_env.sheet import HOG_LINE_Y
from curling_env.trajectory import Trajectory
from curling_env.typing import Flags, Floats, Indices
from friction_estimation.tracks.contacts import contacts_of, stays_at_rest, stretches
from friction_estimation.tracks.local_changes import changes_about
from friction_estimation.tracks.outliers import wild_rows
from friction_estimation.tracks.smoothing import SmoothedMotion, smooth_motion
from friction_estimation.tracks.tuning import (
    AFTER_PUSH_ENDS,
    BEFORE_PUSH_ENDS,
    CLEAR_DEVIATIONS,
    DECELERATION_RANGE,
    MIN_MOVING_SPEED,
    MIN_SAMPLES,
    MIN_TRAVEL,
    PUSHED_DECELERATION,
)


@dataclass(frozen=True, kw_only=True)
class FreeSlide:
    """Rows of a track on which friction alone acts.

    Parameters
    ----------
    track : the whole track
    rows : (k,) indices into the track, in order of time, without outliers
    stretch : first and past-last row of the track between the contacts before and after
    rests : true if the stone came to rest undisturbed at the end of the stretch
    wild : number of rows of the stretch dropped as outliers
    noise : robust standard deviation of one coordinate [m]
    """

    track: Trajectory
    rows: Indices
    stretch: tuple[int, int]
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
    def released_at(self) -> float:
        """Time of the first row [s]."""
        return float(self.track.t[self.rows[0]])

    @property
    def travel(self) -> float:
        """Distance from the first to the last row [m]."""
        return float(np.hypot(*(self.xy[-1] - self.xy[0]))) if len(self.rows) else 0.0

    @property
    def duration(self) -> float:
        """Time between the first and the last row [s]."""
        return float(self.t[-1] - self.t[0])


def free_slide(track: Trajectory, contacts: Sequence[float] | None = None) -> FreeSlide:
    """Return the longest free slide of a track.

    Parameters
    ----------
    track : track of one stone
    contacts : times at which it was touched [s]; by default those in the track itself

    Raises
    ------
    TrackTooShortError : no free slide of a metre and 20 samples
    """
    slides = _slides_of(track, contacts_of([track])[0] if contacts is None else contacts)
    return max(slides, key=lambda slide: slide.travel)


def free_slides(
    tracks: Sequence[Trajectory], contacts: Sequence[Sequence[float]] | None = None
) -> tuple[list[FreeSlide], list[str]]:
    """Return the free slides of all tracks, and the reasons why some tracks have none.

    A stone slides freely before a contact and again after it: these are two slides.

    Parameters
    ----------
    tracks : tracks of one session; the stones of one throw share its number
    contacts : times at which each stone was touched [s]; see `contacts_of`

    Raises
    ------
    TrackTooShortError : no track has a free slide
    """
    slides: list[FreeSlide] = []
    reasons: list[str] = []
    found = contacts_of(tracks) if contacts is None else contacts
    for track, times in zip(tracks, found, strict=True):
        if stays_at_rest(track) and len(tracks) > 1:
            continue  # a resting stone beside the thrown one
        try:
            slides += _slides_of(track, times)
        except TrackTooShortError as error:
            reasons.append(error.problem)
    if not slides:
        more = f" ({len(reasons) - 1} more like this)" if len(reasons) > 1 else ""
        reason = reasons[0] if reasons else "every stone is at rest"
        raise TrackTooShortError(f"no throw slides freely: {reason}{more}")
    return slides, reasons


def _slides_of(track: Trajectory, contacts: Sequence[float]) -> list[FreeSlide]:
    """Return the free slides of a track, one for each stretch between contacts that has one.

    Raises
    ------
    TrackTooShortError : none has a free slide of a metre and 20 samples
    """
    if track.by_gates:
        raise TrackTooShortError(
            f"throw {track.throw} was timed by light gates, which measure no path"
        )
    found: list[FreeSlide] = []
    problem: TrackTooShortError | None = None
    for first, last in stretches(track, contacts):
        try:
            part = _slide_of_stretch(track.only(slice(first, last)))
        except TrackTooShortError as error:
            problem = problem or error
            continue
        found.append(replace(part, track=track, rows=part.rows + first, stretch=(first, last)))
        if part.rests:
            break  # it may be moved by hand now
    if not found:
        count = len(track)
        raise problem or TrackTooShortError(
            f"throw {track.throw} has {count} samples; expected at least {MIN_SAMPLES}"
        )
    return _same_deceleration(found)


def _same_deceleration(slides: list[FreeSlide]) -> list[FreeSlide]:
    """Return the slides of one stone with the deceleration of its longest one: no hand moves it."""
    if len(slides) == 1:
        return slides
    usual = max(slides, key=lambda slide: slide.travel)
    least, most = DECELERATION_RANGE
    mean, error = _deceleration(usual)
    kept: list[FreeSlide] = []
    for slide in slides:
        own, sigma = _deceleration(slide)
        slack = CLEAR_DEVIATIONS * float(np.hypot(sigma, error))
        if least * mean - slack < own < most * mean + slack:
            kept.append(slide)
    return kept or [usual]


def _deceleration(slide: FreeSlide) -> tuple[float, float]:
    """Return the mean deceleration of a slide, and its standard error [m/s²]."""
    way = slide.xy[-1] - slide.xy[0]
    u = slide.t - slide.t.mean()
    basis = np.column_stack([np.ones_like(u), u, -0.5 * u**2])
    inverse = np.linalg.inv(basis.T @ basis)
    along = slide.xy @ (way / np.hypot(*way))
    found = inverse @ (basis.T @ along)
    return float(found[2]), float(slide.noise * np.sqrt(inverse[2, 2]))


def _slide_of_stretch(track: Trajectory) -> FreeSlide:
    """Return the undisturbed part of a track after the stone left the hand and before it rests.

    The beginning is found in three steps: the stone moves; the last end of a push, at which
    deceleration sets in; and the delivery hog line, before which the rules require the release.
    Rows before that line are used only if there are enough of them to rule out a push.

    Raises
    ------
    TrackTooShortError : no free slide of a metre and 20 samples
    """
    name = f"throw {track.throw}"
    if len(track) < MIN_SAMPLES:
        raise TrackTooShortError(
            f"{name} has {len(track)} samples; expected at least {MIN_SAMPLES}"
        )
    wild, noise = wild_rows(track.t, track.xy)
    rows = np.flatnonzero(~wild)
    if len(rows) < MIN_SAMPLES:
        raise TrackTooShortError(f"{name}: {int(wild.sum())} of {len(track)} rows are outliers")
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
    slide = FreeSlide(
        track=track,
        rows=kept,
        stretch=(0, len(track)),
        rests=rests,
        wild=int(wild.sum()),
        noise=noise,
    )
    if len(kept) < MIN_SAMPLES or slide.travel < MIN_TRAVEL:
        raise TrackTooShortError(
            f"{name}: only {slide.travel:.2f} m and {len(kept)} samples of free sliding; expected "
            f"at least {MIN_TRAVEL:g} m and {MIN_SAMPLES}"
        )
    return slide


def _longest_run(flags: Flags) -> tuple[int, int]:
    """Return the first and past-last index of the longest run of true flags."""
    edges = np.diff(np.concatenate([[0], flags.astype(int), [0]]))
    starts, ends = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)
    k = int(np.argmax(ends - starts))
    return int(starts[k]), int(ends[k])


def _end_of_slide(t: Floats, motion: SmoothedMotion, begin: int, end: int) -> tuple[int, bool]:
    """Return the past-last index of the free slide, and whether the stone came to rest
    undisturbed.
    """
    middle = motion.acceleration[begin:end]
    usual = max(-float(np.median(middle)), 0.01)
    if end == len(t):
        # The track ends with the slide: at rest if the last two seconds lead to a standstill.
        last = t >= t[-1] - 2.0
        if last.sum() < 8:
            return end, False
        slide = np.polynomial.polynomial.polyfit(t[last] - t[-1], motion.distance[last], 2)
        return end, bool(slide[1] < MIN_MOVING_SPEED)
    # The last centimetres belong to the slide; they take speed/deceleration.
    until = t[end - 1] + 1.2 * motion.speed[end - 1] / usual
    return int(np.searchsorted(t, until, side="right")), True


def _release(
    t: Floats, xy: Floats, motion: SmoothedMotion, begin: int, stop: int, noise: float
) -> int:
    """Return the index of the first row after the release."""
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
    """Return the last time at which a push ended, or None if none is seen [s].

    For each candidate time a quadratic is fitted to the rows shortly before and after it, with
    another acceleration before. The candidate at which the two accelerations differ most clearly,
    and by more than ice can explain, is the end of a push.
    """
    latest = t[begin] + 0.5 * (t[stop - 1] - t[begin])
    times = np.arange(t[begin] + 0.25, latest, 0.05)
    if not len(times):
        return None
    found = changes_about(
        times,
        t[begin:stop],
        distance[begin:stop],
        span=(BEFORE_PUSH_ENDS, AFTER_PUSH_ENDS),
        order=2,
        least_rows=(6, 15),
    )
    certainty = found.deviations(noise)
    a_push_ends = (
        (found.after < 0)
        & (found.change > (1 - PUSHED_DECELERATION) * -found.after)
        & (certainty > CLEAR_DEVIATIONS)
    )
    if not a_push_ends.any():
        return None
    return float(times[np.argmax(np.where(a_push_ends, certainty, 0.0))])
