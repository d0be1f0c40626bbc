"""Finding the thrown stone without a click: a blob of a stone's size that travels along the ice."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.interpolate import PchipInterpolator

from curling_env.sheet import Sheet
from curling_env.typing import Floats, Image
from friction_estimation.appearance import StoneModel
from friction_estimation.camera.camera import Camera
from friction_estimation.film.frame import Frame
from friction_estimation.tracking import tuning
from friction_estimation.tracking.background import Background, Blob, moving_blobs
from friction_estimation.tracking.joint.sightings import Sighting as Sighting
from friction_estimation.tracking.joint.sightings import sighting_of


@dataclass(frozen=True, kw_only=True, eq=False)
class RoughPath:
    """Roughly where a stone is at any time: sightings joined by a smooth monotone curve.

    Parameters
    ----------
    sightings : where it was seen, in order
    measured : whether its look was fitted there: then the path is nearer than optical flow
    """

    sightings: tuple[Sighting, ...]
    measured: bool = False

    def leads(self, t: float) -> bool:
        """Whether the path tells best where the stone is at a time [s]."""
        return self.measured and t <= self._t[-1]

    def at(self, t: float) -> Floats:
        """Place at a time [s], (2,) [m].

        Before the first sighting the stone comes at the speed that it had then; after the last one
        it goes on, and slows as it did.
        """
        times, places = self._t, self._xy
        if times[0] <= t <= times[-1]:
            return self._curve(t)
        if t < times[0]:
            span = min(3, len(times))
            speed = (places[span - 1] - places[0]) / (times[span - 1] - times[0])
            return places[0] + speed * (t - times[0])
        return places[-1] + self._slid_on(t)

    def doubt(self, t: float) -> float:
        """How far the stone may be from where it should be, because it is not seen any more [m]."""
        return tuning.SLID_ON_DOUBT * float(np.linalg.norm(self._slid_on(t)))

    def _slid_on(self, t: float) -> Floats:
        """How far it goes on after the last sighting, (2,) [m]."""
        velocity, slowing = self._last_motion
        return slid_on(velocity, max(t - self._t[-1], 0.0), slowing)

    @property
    def headings(self) -> tuple[Floats, Floats]:
        """Times [s] and headings, unwrapped [rad], each (n,), where headings were looked for."""
        seen = [s for s in self.sightings if np.isfinite(s.theta)]
        return np.array([s.t for s in seen]), np.unwrap([s.theta for s in seen])

    def until(self, t: float) -> RoughPath | None:
        """The same path up to a time [s], if its look was fitted there; None where that is short.

        Beside people it is nearer to the stone than any other that is found.
        """
        kept = tuple(s for s in self.sightings if s.t <= t)
        clear = sum(s.likeness >= tuning.MIN_LEARNING_LIKENESS for s in kept)
        if not self.measured or clear < tuning.MIN_SIGHTINGS:
            return None
        far = abs(kept[-1].xy[1] - kept[0].xy[1]) > tuning.LEAST_FOLLOWED
        return replace(self, sightings=kept) if far else None

    def agrees_with(self, other: RoughPath) -> bool:
        """Whether it goes where another path was seen, nearly always."""
        seen = other.sightings
        last = self._t[-1]
        away = [float(np.linalg.norm(self.at(min(s.t, last)) - s.xy)) for s in seen]
        near = sum(distance < tuning.SAME_PLACE for distance in away)
        return near >= tuning.AGREEING_SHARE * len(away)

    @cached_property
    def _last_motion(self) -> tuple[Floats, float]:
        """Velocity at the last sighting, (2,) [m/s], and deceleration until then [m/s²]."""
        slowing = tuning.HIDDEN_DECELERATION
        late = self._t >= self._t[-1] - tuning.LAST_SIGHTINGS
        late[-3:] = True
        times = self._t[late] - self._t[-1]
        velocity = np.polynomial.polynomial.polyfit(times, self._xy[late], 1)[1]
        pace = float(np.hypot(*velocity))
        # That is its velocity in the middle of these sightings; since then it has slowed.
        middle = self._t[-1] + times.mean()
        earlier = middle - tuning.SLOWING_SECONDS
        if earlier - 1.0 >= self._t[0]:
            before = np.linalg.norm(self._curve(earlier + 1.0) - self._curve(earlier - 1.0)) / 2.0
            slowing = float(np.clip((before - pace) / (middle - earlier), *tuning.SLOWINGS))
        slowed = max(pace + slowing * times.mean(), 0.0)
        return velocity * slowed / max(pace, 1e-9), slowing

    @cached_property
    def _t(self) -> Floats:
        return np.array([s.t for s in self.sightings])

    @cached_property
    def _xy(self) -> Floats:
        return np.array([s.xy for s in self.sightings])

    @cached_property
    def _curve(self) -> PchipInterpolator:
        return PchipInterpolator(self._t, self._xy)


def slid_on(velocity: Floats, since: float, slowing: float = tuning.HIDDEN_DECELERATION) -> Floats:
    """How far a stone has slid that is not seen, (2,) [m].

    Parameters
    ----------
    velocity : (2,) when it was seen last [m/s]
    since : for how long it has not been seen [s]
    slowing : its deceleration [m/s²]
    """
    pace = float(np.hypot(*velocity))
    ahead = min(since, pace / slowing)
    return (ahead - 0.5 * slowing * ahead**2 / max(pace, 1e-6)) * velocity


@dataclass(frozen=True, kw_only=True, eq=False)
class ThrownStone:
    """The thrown stone as it was found, before it is measured.

    Parameters
    ----------
    path : roughly where it is
    pictures : times [s] and frames; `Sighting.frame` is an index of these
    sightings : all of the frames that were looked through first
    """

    path: RoughPath
    pictures: Sequence[tuple[float, Frame]]
    sightings: tuple[Sighting, ...] = ()


def find_thrown_stone(
    sample: Sequence[tuple[float, Image]],
    background: Background,
    camera: Camera,
    model: StoneModel,
    sheet: Sheet,
    frames_between: Callable[[float, float, float], Iterable[tuple[float, Image]]],
) -> ThrownStone | None:
    """Find the thrown stone in a few frames, or in more where these hardly show it.

    A camera over one house sees a stone that is thrown from there for a second or two.

    Parameters
    ----------
    sample : times [s] and frames, spread over the whole film
    frames_between : the frames from one time to another, a step apart [s]

    Returns
    -------
    None where nothing travels like a stone
    """
    seen = tuple(_sightings(sample, background, camera, model, sheet))
    path = likeliest_path(seen)
    found = None if path is None else ThrownStone(path=path, pictures=sample, sightings=seen)
    if path is not None and len(path.sightings) >= tuning.ENOUGH_SIGHTINGS:
        return found
    step = (sample[-1][0] - sample[0][0]) / max(len(sample) - 1, 1)
    if step <= 2 * tuning.CLOSE_SAMPLE_STEP:
        return found
    low, high = sample[0][0], sample[-1][0]
    if path is not None:
        low = max(low, path.sightings[0].t - step)
        high = min(high, path.sightings[-1].t + step)
    span = low, high, tuning.CLOSE_SAMPLE_STEP
    closer = likeliest_path(_sightings(frames_between(*span), background, camera, model, sheet))
    if closer is None:
        return found
    # The frames are read twice rather than kept: all of them might not fit into memory.
    chosen = {
        round(s.t, 6): s for s in closer.sightings[:: -(-len(closer.sightings) // len(sample))]
    }
    pictures = [(t, frame) for t, frame in frames_between(*span) if round(t, 6) in chosen]
    sightings = (replace(chosen[round(t, 6)], frame=k) for k, (t, _) in enumerate(pictures))
    return ThrownStone(
        path=RoughPath(sightings=tuple(sightings)), pictures=pictures, sightings=seen
    )


def _sightings(
    frames: Iterable[tuple[float, Image]],
    background: Background,
    camera: Camera,
    model: StoneModel,
    sheet: Sheet,
) -> list[Sighting]:
    return [
        sighting
        for i, (t, frame) in enumerate(frames)
        for sighting in sightings_in(moving_blobs(frame, background), i, t, camera, model, sheet)
    ]


def sightings_in(
    blobs: Sequence[Blob], frame: int, t: float, camera: Camera, model: StoneModel, sheet: Sheet
) -> list[Sighting]:
    """The blobs of one frame that may be a stone.

    Parameters
    ----------
    frame, t : index and time [s] of the frame, for the sightings
    """
    found = (sighting_of(blob, camera, model, sheet) for blob in blobs if blob.darker)
    return [replace(sighting, frame=frame, t=t) for sighting in found if sighting is not None]


def likeliest_path(
    sightings: Sequence[Sighting], max_unseen: float = np.inf, max_gain: float = np.inf
) -> RoughPath | None:
    """The path that a thrown stone most likely took through the sightings.

    It is the chain of greatest likeness in which every link is the motion of a stone: along the
    sheet in one direction, never faster than any throw, hardly sideways. None where nothing travels
    like a stone.

    Parameters
    ----------
    max_unseen : longest time between two of its sightings [s]
    max_gain : most speed that it may seem to gain from one sighting to the next [m/s]
    """
    best: RoughPath | None = None
    best_score = 0.0
    for direction in (1.0, -1.0):
        chain, score = _best_chain(sightings, direction, max_unseen, max_gain)
        if len(chain) < tuning.MIN_SIGHTINGS or score <= best_score:
            continue
        if np.linalg.norm(chain[-1].xy - chain[0].xy) < tuning.MIN_TRAVEL:
            continue
        best, best_score = RoughPath(sightings=tuple(chain)), score
    return best


def _best_chain(
    sightings: Sequence[Sighting], direction: float, max_unseen: float, max_gain: float
) -> tuple[list[Sighting], float]:
    """The best chain in one direction along y (1 or -1), and its score, by dynamic programming."""
    ordered = sorted(sightings, key=lambda s: s.frame)
    score = [s.likeness for s in ordered]
    speed = [tuning.MAX_THROW_SPEED] * len(ordered)
    before = [-1] * len(ordered)
    earliest = 0
    for i, now in enumerate(ordered):
        while now.t - ordered[earliest].t > max_unseen:
            earliest += 1
        for j in range(earliest, i):
            earlier = ordered[j]
            gap = now.frame - earlier.frame
            dt = now.t - earlier.t
            if gap <= 0 or dt <= 0:
                continue
            step = now.xy - earlier.xy
            forward, aside = direction * step[1], abs(step[0])
            pace = forward / dt
            # Far from the camera the centre of a blob is uncertain by some 0.1 m.
            if (
                forward < -0.1
                or aside > 0.25 * abs(forward) + 0.15
                or pace > tuning.MAX_THROW_SPEED
            ):
                continue
            # A stone never gains speed once it is thrown; a person beside it may.
            gain = max(pace - speed[j] * 1.05 - 0.2 / dt, 0.0)
            if before[j] >= 0 and gain > min(max_gain, tuning.MAX_PUSH * dt):
                continue
            missed = tuning.MISSED_FRAME_COST * (gap - 1)
            value = score[j] + now.likeness - missed - min(gain, 2.0)
            if value > score[i]:
                score[i], before[i], speed[i] = value, j, pace
    if not ordered:
        return [], 0.0
    at = int(np.argmax(score))
    total = score[at]
    chain: list[Sighting] = []
    while at >= 0:
        chain.append(ordered[at])
        at = before[at]
    return chain[::-1], total
