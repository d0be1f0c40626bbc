"""Distance, speed and acceleration of a tracked stone, and the part of a track that counts.

A film shows more than the free slide: the stone held or pushed by a player, the stone at rest,
frames in which the tracker followed something else. Only the free slide tells of the ice.

Distance is measured along the path, not along the sheet: curl turns a stone without slowing it,
so that speed along the path changes by friction alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter

from curling_env.errors import TrackTooShortError
from curling_env.sheet import HOG_LINE_Y
from curling_env.trajectory import Trajectory
from curling_env.typing import Flags, Floats

WILD = 6.0
"""Robust standard deviations from its neighbours beyond which a row is wild. Gaussian noise gets
there twice in 10⁹ rows; a wrong match is centimetres to metres away."""
LEAST_NOISE = 5e-4
"""No camera measures a stone better than this [m]; keeps noise-free tracks from looking wild."""
MOVING_SPEED = 0.05
"""A stone slower than this, averaged over half a second, is taken to be held or at rest [m/s]."""
MIN_TRAVEL = 1.0
"""Shortest free slide that is used [m]: less says nothing of friction (methods: 1 m, 100 %)."""
MIN_SAMPLES = 20
"""Fewest samples of a free slide that is used."""
STILL = 0.05
"""Two rows of a stone that nobody touched differ by less [m]."""
TOUCHING = 0.6
"""Two stones' centres are nearer than this in the frame after they met [m]: two radii, and what
the faster goes in a frame."""
CONTACT_PLAY = 0.07
"""How far a track's first row may lie from the contact that began it [s]: two frames."""
PUSHED = 0.5
"""Part of the free slide's deceleration below which a stone counts as still pushed. Ice varies by
some per cent, a hand takes the deceleration away altogether."""
SURE = 6.0
"""Standard errors that the end of a push must stand out."""


@dataclass(frozen=True, kw_only=True)
class Motion:
    """Smoothed motion of a stone along its path.

    Parameters
    ----------
    t : (n,) [s]
    distance : (n,) along the path since the first sample [m]
    speed : (n,) [m/s]
    acceleration : (n,) along the path, negative while friction slows the stone [m/s²]
    speed_sigma, acceleration_sigma : (n,) standard errors of the two
    """

    t: Floats
    distance: Floats
    speed: Floats
    acceleration: Floats
    speed_sigma: Floats
    acceleration_sigma: Floats


@dataclass(frozen=True, kw_only=True)
class FreeSlide:
    """The rows of a track on which friction alone acts.

    Parameters
    ----------
    track : all of it
    rows : (k,) indices into the track, in order of time, wild rows left out
    released_at : time of the first of them [s]
    rests : whether the stone came to rest by itself at the end of the track
    wild : rows of the track left out as wild
    noise : robust standard deviation of one coordinate [m]
    """

    track: Trajectory
    rows: NDArray[np.intp]
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
        """Between the first and the last row [s]."""
        return float(self.t[-1] - self.t[0])


def local_fit(t: Floats, values: Floats, window: float) -> tuple[Floats, Floats]:
    """Value and derivatives of a quadratic fitted around every sample.

    The Savitzky–Golay filter for times that need not be even: lost frames leave gaps.

    Parameters
    ----------
    t : (n,) increasing [s]
    values : (n,)
    window : full width of the fit [s]; widened where it holds fewer than 5 samples

    Returns
    -------
    derivatives : (3, n) value, first and second derivative at each sample
    gains : (3, n) standard error of each for independent samples of unit noise

    Raises
    ------
    TrackTooShortError : fewer than 5 samples
    """
    n, least = len(t), 5
    if n < least:
        raise TrackTooShortError(f"needs at least {least} samples, got {n}")
    first = np.searchsorted(t, t - window / 2 - 1e-9)
    last = np.searchsorted(t, t + window / 2 + 1e-9)
    few = last - first < least
    first = np.where(few, np.clip(np.arange(n) - least // 2, 0, n - least), first)
    last = np.where(few, first + least, last)
    # Moments about each sample, by sums over the samples at every place of the widest window.
    moments, weighted = np.zeros((5, n)), np.zeros((3, n))
    scale = np.maximum(t - t[first], t[last - 1] - t)
    for place in range(int((last - first).max())):
        index = np.minimum(first + place, n - 1)
        inside = first + place < last
        u = (t[index] - t) / scale
        power = inside.astype(np.float64)
        for order in range(5):
            moments[order] += power
            if order < 3:
                weighted[order] += power * values[index]
            power = power * u
    normal = moments[np.add.outer(np.arange(3), np.arange(3))].transpose(2, 0, 1)
    inverse = np.linalg.inv(normal)
    coefficients = np.einsum("nij,jn->in", inverse, weighted)
    size = np.sqrt(np.einsum("nii->in", inverse))
    units = np.stack([np.ones(n), 1.0 / scale, 2.0 / scale**2])
    return coefficients * units, size * units


def robust_deviation(values: Floats) -> float:
    """Standard deviation by the median of absolute deviations, of roughly Gaussian values."""
    return 1.4826 * float(np.median(np.abs(values - np.median(values)))) if len(values) else 0.0


def wild_rows(t: Floats, xy: Floats) -> tuple[Flags, float]:
    """Which rows do not lie where their neighbours say, and the noise of those that do.

    Every row is held against the parabola through the medians of its neighbourhood, so that single
    wrong rows and bursts shorter than half the neighbourhood stand out.

    Parameters
    ----------
    t : (n,) [s]
    xy : (n, 2) [m]

    Returns
    -------
    wild : (n,) flags
    noise : robust standard deviation of one coordinate [m]
    """
    n = len(t)
    # Ten rows to either side, of slow cameras those of a second: longer, and the stone's release
    # and rest are no longer at the edge of what is seen.
    half = int(np.clip(1.0 / float(np.median(np.diff(t))), 5, 10)) if n > 1 else 1
    if n < 2 * half + 1:
        half = max(1, (n - 1) // 2)
    size = 2 * half + 1
    wild = np.zeros(n, dtype=bool)
    scale = LEAST_NOISE
    # At either end the window stays inside: a wild last row counts once.
    inside = np.arange(half, n - half)
    nearest = np.clip(np.arange(n), half, n - half - 1)
    windows = nearest[:, None] + np.arange(-half, half + 1)
    lasting = np.maximum(t[inside + half] - t[inside - half], 1e-9)
    middle = median_filter(0.5 * (t[inside + half] + t[inside - half]), size, mode="mirror")
    middle = middle[nearest - half]
    ahead, behind = np.minimum(np.arange(n) + half, n - 1), np.maximum(np.arange(n) - half, 0)
    for axis in range(2):
        values = xy[:, axis]
        # Velocity by medians of differences half a window apart, what it changes by in the same
        # way, then the level left around the parabola of both: over the seconds that a window of
        # a slow camera or one with a gap lasts, friction bends the path by many cm.
        slope = (values[inside + half] - values[inside - half]) / lasting
        slope = median_filter(slope, size, mode="mirror")[nearest - half]
        change = (slope[ahead] - slope[behind]) / np.maximum(middle[ahead] - middle[behind], 1e-9)
        bend = median_filter(change, 2 * size + 1, mode="mirror")
        velocity = slope + bend * (t - middle)
        apart = t[windows] - t[:, None]
        path = velocity[:, None] * apart + 0.5 * bend[:, None] * apart**2
        level = np.median(values[windows] - path, axis=1)
        left = values - level
        spread = max(robust_deviation(left), LEAST_NOISE)
        # A stone bends its speed by some cm over the neighbourhood while it is pushed or stops.
        wild |= np.abs(left) > WILD * spread + 0.02
        scale = max(scale, robust_deviation(left[~wild]))
    return wild, scale


def smooth_motion(t: Floats, xy: Floats, *, window: float = 1.0, noise: float = 0.005) -> Motion:
    """Distance → speed → acceleration along the path.

    Parameters
    ----------
    t : (n,) [s]
    xy : (n, 2) measured positions, free of wild rows [m]
    window : width of the local quadratic fits [s]
    noise : standard deviation of one coordinate, for the standard errors [m]

    Raises
    ------
    TrackTooShortError : fewer than 5 samples

    Source
    ------
    The paper, section 3: speed and acceleration from the distance travelled. σ of a quadratic
    fit over T at f frames a second: σ_a = σ √(720/(fT))/T².
    """
    (x, vx, ax), gains = local_fit(t, xy[:, 0], window)
    (y, vy, ay), _ = local_fit(t, xy[:, 1], window)
    speed = np.hypot(vx, vy)
    still = np.maximum(speed, 1e-9)
    acceleration = (vx * ax + vy * ay) / still
    steps = np.hypot(np.diff(x), np.diff(y))
    return Motion(
        t=t,
        distance=np.concatenate([[0.0], np.cumsum(steps)]),
        speed=speed,
        acceleration=acceleration,
        speed_sigma=noise * gains[1],
        acceleration_sigma=noise * gains[2],
    )


def free_slide(track: Trajectory, contacts: Sequence[float] = ()) -> FreeSlide:
    """The part of a track after the stone left the hand and before it rests or is stopped.

    The end is where the stone has reached its last place, or where it is slowed or turned more
    than ice can. The beginning is found in three steps: the stone moves; the last moment at which
    a push ended, which shows as deceleration that sets in; and the delivery hog line, before
    which the rules want the stone released. What lies before that line is used only where it is
    long enough to show that nobody pushed. Of a stone that struck or was struck, the longest way
    between contacts is taken.

    Parameters
    ----------
    contacts : times at which it touched another stone [s]

    Raises
    ------
    TrackTooShortError : no free slide of a metre and 20 samples
    """
    if len(contacts):
        first, last = _longest_way(track, contacts)
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
    fast = motion.speed > max(MOVING_SPEED, 4 * float(np.median(motion.speed_sigma)))
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


def free_slides(tracks: list[Trajectory]) -> tuple[list[FreeSlide], list[str]]:
    """The free slides of all tracks that have one, and why the others have none.

    Raises
    ------
    TrackTooShortError : none has one
    """
    slides: list[FreeSlide] = []
    reasons: list[str] = []
    for track, contacts in zip(tracks, contacts_of(tracks), strict=True):
        if _only_lies(track) and len(tracks) > 1:
            continue  # a stone beside the thrown one, of which nothing was to be expected
        try:
            slides.append(free_slide(track, contacts))
        except TrackTooShortError as error:
            reasons.append(error.problem)
    if not slides:
        more = f" ({len(reasons) - 1} more like it)" if len(reasons) > 1 else ""
        reason = reasons[0] if reasons else "every stone lies still"
        raise TrackTooShortError(f"no throw slides freely: {reason}{more}")
    return slides, reasons


def contacts_of(tracks: Sequence[Trajectory]) -> list[list[float]]:
    """When each stone touched another, as the tracks of one throw tell together [s].

    The track of a stone that was struck begins with the contact; what was next to it then, struck
    it. A contact of which only one stone has a track is not seen.
    """
    found: list[list[float]] = [[] for _ in tracks]
    for struck in tracks:
        if len(struck) < 2 or _only_lies(struck):
            continue
        for k, other in enumerate(tracks):
            at = float(struck.t[0])
            alone = other.throw != struck.throw or other is struck
            if alone or len(other) < 2 or not other.t[0] < at <= other.t[-1]:
                continue
            there = [np.interp(at, other.t, other.xy[:, axis]) for axis in range(2)]
            if np.hypot(*(struck.xy[0] - there)) < TOUCHING:
                found[k].append(at)
    return [sorted(times) for times in found]


def _longest_way(track: Trajectory, contacts: Sequence[float]) -> tuple[int, int]:
    """First and past-last row of the longest way between contacts.

    The row at a contact and the one before it may lie on either side of it.
    """
    edges = [-np.inf, *sorted(contacts), np.inf]
    best, longest = (0, 0), -1.0
    for begin, end in pairwise(edges):
        inside = np.flatnonzero((track.t > begin + CONTACT_PLAY) & (track.t < end - CONTACT_PLAY))
        if len(inside) < 2:
            continue
        way = float(np.hypot(*(track.xy[inside[-1]] - track.xy[inside[0]])))
        if way > longest:
            best, longest = (int(inside[0]), int(inside[-1]) + 1), way
    return best


def _rows_of(track: Trajectory, first: int, last: int) -> Trajectory:
    columns = ("t", "xy", "theta", "swept", "sigma_xy", "sigma_theta")
    return replace(track, **{name: getattr(track, name)[first:last] for name in columns})


def _only_lies(track: Trajectory) -> bool:
    """Whether a track is that of an untouched stone: a row at the beginning and one at the end."""
    return len(track) == 2 and bool((np.ptp(track.xy, axis=0) < STILL).all())


def _longest_run(flags: Flags) -> tuple[int, int]:
    """First and past-last index of the longest run of true flags."""
    edges = np.diff(np.concatenate([[0], flags.astype(int), [0]]))
    starts, ends = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)
    k = int(np.argmax(ends - starts))
    return int(starts[k]), int(ends[k])


def _end_of_slide(t: Floats, motion: Motion, begin: int, end: int) -> tuple[int, bool]:
    """Past-last index of the free slide, and whether the stone came to rest by itself."""
    middle = motion.acceleration[begin:end]
    usual = max(-float(np.median(middle)), 0.01)
    sigma = np.maximum(motion.acceleration_sigma, 1e-9)
    # Ice slows by some hundredths of g; a board, a broom, another stone by much more.
    stopped = motion.acceleration < -5 * usual - SURE * sigma
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
        return end, bool(slowing[1] < MOVING_SPEED)
    # The last centimetres belong to the slide: they last speed/deceleration.
    until = t[end - 1] + 1.2 * motion.speed[end - 1] / usual
    return int(np.searchsorted(t, until, side="right")), True


def _release(t: Floats, xy: Floats, motion: Motion, begin: int, stop: int, noise: float) -> int:
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

    For each candidate time a quadratic is fitted to the second and a half before and four seconds
    after, with another acceleration before; the candidate at which the two differ most clearly,
    and by more than ice can, is the end of a push.
    """
    best: tuple[float, float] | None = None
    latest = t[begin] + 0.5 * (t[stop - 1] - t[begin])
    for when in np.arange(t[begin] + 0.25, latest, 0.05):
        low, high = np.searchsorted(t, [max(when - 1.5, t[begin]), when + 4.0])
        high = min(int(high), stop)
        u = t[low:high] - when
        if (u < 0).sum() < 6 or (u > 0).sum() < 15:
            continue
        basis = np.column_stack([np.ones_like(u), u, 0.5 * u**2, 0.5 * np.minimum(u, 0.0) ** 2])
        estimate, sigma = _least_squares(basis, distance[low:high], noise)
        after, change = estimate[2], estimate[3]
        certainty = change / sigma[3]
        a_push_ends = after < 0 and change > (1 - PUSHED) * -after and certainty > SURE
        if a_push_ends and (best is None or certainty > best[0]):
            best = (float(certainty), float(when))
    return None if best is None else best[1]


def _least_squares(basis: Floats, values: Floats, noise: float) -> tuple[Floats, Floats]:
    """Coefficients and standard errors, of no less than the given noise."""
    solution: Any = np.linalg.lstsq(basis, values, rcond=None)[0]
    left = values - basis @ solution
    scale = max(noise, float(np.sqrt((left**2).sum() / max(len(left) - basis.shape[1], 1))))
    return solution, scale * np.sqrt(np.diag(np.linalg.inv(basis.T @ basis)))
