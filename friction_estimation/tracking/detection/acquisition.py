"""Finding the thrown stone without a click: a blob of a stone's size that travels along the ice."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import cv2
import numpy as np
from scipy.interpolate import PchipInterpolator

from curling_env.sheet import Sheet
from curling_env.typing import Floats, Image
from friction_estimation.appearance import StoneModel
from friction_estimation.camera.camera import Camera
from friction_estimation.tracking.detection.background import Background, Blob, moving_blobs

MAX_SPEED = 5.0
"""No thrown stone is faster [m/s]; the hardest take-outs reach about 4."""
MIN_TRAVEL = 0.5
"""Something that moves less over the whole film is not a thrown stone [m]."""
MIN_SIGHTINGS = 4
"""Sparse frames in which the same stone must be seen."""
CROWN = 0.06
"""How far a handle stands above the body, roughly [m]."""
MAX_GROWTH = 2.5
"""A stone's shadow and mirror image make its blob at most this many times as wide or high."""
ENOUGH_SIGHTINGS = 12
"""A path seen in fewer sparse frames is looked at again in frames closer together."""
CLOSER = 0.12
"""Time between these [s]."""
LARGEST_MISFIT = 2.2
"""By which factor a blob may be larger or smaller than a stone there would be."""
RIM_PX = 1.5
"""What the threshold takes in of the blurred rim of a blob."""
MISS_COST = 0.15
"""What a sparse frame without a sighting takes from a path's score; a perfect sighting gives 1."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Sighting:
    """A blob that may be a stone.

    Parameters
    ----------
    frame : index of the sparse frame
    t : time since the film began [s]
    xy : (2,) centre on the ice [m]
    likeness : 1 for exactly the size and shape of a stone there, towards 0 otherwise
    """

    frame: int
    t: float
    xy: Floats
    likeness: float


@dataclass(frozen=True, kw_only=True, eq=False)
class RoughPath:
    """Where a stone is, roughly, at any time: sightings joined by a smooth monotone curve."""

    sightings: tuple[Sighting, ...]

    def at(self, t: float) -> Floats:
        """Place at a time [s], (2,) [m]; beyond the sightings it runs on as it last went."""
        times, places = self._t, self._xy
        if times[0] <= t <= times[-1]:
            return self._curve(t)
        if t < times[0]:
            span = min(3, len(times))
            speed = (places[span - 1] - places[0]) / (times[span - 1] - times[0])
            return places[0] + speed * (t - times[0])
        return places[-1]

    @cached_property
    def _t(self) -> Floats:
        return np.array([s.t for s in self.sightings])

    @cached_property
    def _xy(self) -> Floats:
        return np.array([s.xy for s in self.sightings])

    @cached_property
    def _curve(self) -> PchipInterpolator:
        return PchipInterpolator(self._t, self._xy)


@dataclass(frozen=True, kw_only=True, eq=False)
class Acquired:
    """The thrown stone, found.

    Parameters
    ----------
    rough : its path
    pictures : times [s] and frames that the path's sightings count by
    """

    rough: RoughPath
    pictures: Sequence[tuple[float, Image]]


def acquire(
    sample: Sequence[tuple[float, Image]],
    background: Background,
    camera: Camera,
    model: StoneModel,
    sheet: Sheet,
    between: Callable[[float, float, float], Iterable[tuple[float, Image]]],
) -> Acquired | None:
    """The thrown stone: looked for in sparse frames, and closer where these hardly show it.

    A camera over one house sees a stone that is thrown from there for a second or two.

    Parameters
    ----------
    sample : sparse frames over the whole film
    between : frames from one time to another, a step apart [s]
    """
    rough = thrown_stone(_sightings(sample, background, camera, model, sheet))
    if rough is not None and len(rough.sightings) >= ENOUGH_SIGHTINGS:
        return Acquired(rough=rough, pictures=sample)
    sparse = (sample[-1][0] - sample[0][0]) / max(len(sample) - 1, 1)
    if sparse <= 2 * CLOSER:
        return None if rough is None else Acquired(rough=rough, pictures=sample)
    low, high = sample[0][0], sample[-1][0]
    if rough is not None:
        low = max(low, rough.sightings[0].t - sparse)
        high = min(high, rough.sightings[-1].t + sparse)
    closer = thrown_stone(_sightings(between(low, high, CLOSER), background, camera, model, sheet))
    if closer is None:
        return None if rough is None else Acquired(rough=rough, pictures=sample)
    # The frames are not all kept while they are looked through: they may fill the memory.
    seen = closer.sightings[:: -(-len(closer.sightings) // len(sample))]
    chosen = {round(s.t, 6): s for s in seen}
    pictures = [(t, frame) for t, frame in between(low, high, CLOSER) if round(t, 6) in chosen]
    return Acquired(
        rough=RoughPath(
            sightings=tuple(
                replace(chosen[round(t, 6)], frame=k) for k, (t, _) in enumerate(pictures)
            )
        ),
        pictures=pictures,
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


def stone_likeness(blob: Blob, camera: Camera, model: StoneModel, sheet: Sheet) -> Sighting | None:
    """How much a blob looks like a stone that stands on the ice where the blob is.

    The body alone, with its handle, or with part of its mirror image in the ice, whichever fits.
    None for a blob that is off the ice, or of quite another size or shape.
    """
    if (blob.whole_px > MAX_GROWTH * (blob.high_px - blob.low_px + 3.0)).any():
        return None  # the core of something much larger: a person's jacket, say
    extents = _extents(model)
    middle = (blob.low_px + blob.high_px) / 2
    places = camera.on_plane([middle] * len(extents), np.mean(extents, axis=1))
    tries = (
        _as_stone(blob, xy, camera, model, sheet, *extent)
        for xy, extent in zip(places, extents, strict=True)
    )
    return max((s for s in tries if s is not None), key=lambda s: s.likeness, default=None)


def _extents(model: StoneModel) -> tuple[tuple[float, float], ...]:
    """Heights between which a blob of a stone may reach [m]: body, with handle, with mirror."""
    crown = model.height + CROWN
    return (0.0, model.height), (0.0, crown), (-model.height / 2, crown)


def _as_stone(
    blob: Blob,
    xy: Floats,
    camera: Camera,
    model: StoneModel,
    sheet: Sheet,
    low: float,
    high: float,
) -> Sighting | None:
    """A blob as a stone at a place that reaches from one height to another [m]."""
    if not np.isfinite(xy).all():
        return None
    if (np.abs(xy) - np.array([sheet.width, sheet.length]) / 2 > model.radius).any():
        return None
    found = blob.high_px - blob.low_px + 1
    corners = model.extent_px(camera, xy)
    if (
        len(corners) == 0
        or (corners[1] - corners[0] + RIM_PX > LARGEST_MISFIT * found + 0.01).any()
    ):
        return None  # smaller than the body alone
    body = model.outline_px(camera, xy)
    around = np.linspace(0, 2 * np.pi, 24, endpoint=False)
    slim = 0.6 * model.radius * np.column_stack([np.cos(around), np.sin(around)])
    ends = [np.column_stack([xy + slim, np.full(24, z)]) for z in (low, high)]
    outline = np.concatenate([body, camera.project(np.concatenate(ends))])
    expected = np.ptp(outline, axis=0) + RIM_PX
    least = 0.9 * cv2.contourArea(body.astype(np.float32)) + 1.0
    most = 1.3 * cv2.contourArea(cv2.convexHull(outline.astype(np.float32))) + 4.0
    area = max(np.log(least / blob.area_px), np.log(blob.area_px / most), 0.0)
    misfit = max(float(np.abs(np.log(found / expected)).max()), area)
    if misfit > np.log(LARGEST_MISFIT):
        return None
    return Sighting(frame=0, t=0.0, xy=xy, likeness=float(np.exp(-((misfit / 0.45) ** 2))))


def sightings_in(
    blobs: Sequence[Blob], frame: int, t: float, camera: Camera, model: StoneModel, sheet: Sheet
) -> list[Sighting]:
    """All blobs of one sparse frame that may be a stone."""
    found = (stone_likeness(blob, camera, model, sheet) for blob in blobs if blob.darker)
    return [
        Sighting(frame=frame, t=t, xy=s.xy, likeness=s.likeness) for s in found if s is not None
    ]


def thrown_stone(sightings: Sequence[Sighting]) -> RoughPath | None:
    """The path that a thrown stone most likely took through the sightings.

    The chain of highest likeness in which every link is a stone's motion: along the sheet one way,
    never faster than any throw, hardly sideways. None where nothing travels like a stone.
    """
    best: RoughPath | None = None
    best_score = 0.0
    for direction in (1.0, -1.0):
        chain, score = _best_chain(sightings, direction)
        if len(chain) < MIN_SIGHTINGS or score <= best_score:
            continue
        if np.linalg.norm(chain[-1].xy - chain[0].xy) < MIN_TRAVEL:
            continue
        best, best_score = RoughPath(sightings=tuple(chain)), score
    return best


def _best_chain(sightings: Sequence[Sighting], direction: float) -> tuple[list[Sighting], float]:
    ordered = sorted(sightings, key=lambda s: s.frame)
    score = [s.likeness for s in ordered]
    speed = [MAX_SPEED] * len(ordered)
    before = [-1] * len(ordered)
    for i, now in enumerate(ordered):
        for j in range(i):
            earlier = ordered[j]
            gap = now.frame - earlier.frame
            dt = now.t - earlier.t
            if gap <= 0 or dt <= 0:
                continue
            step = now.xy - earlier.xy
            forward, aside = direction * step[1], abs(step[0])
            pace = forward / dt
            # 0.1 m of play: a blob's centre is that uncertain far from the camera.
            if forward < -0.1 or aside > 0.25 * abs(forward) + 0.15 or pace > MAX_SPEED:
                continue
            # A stone never gains speed once it is thrown; a person beside it may.
            gain = max(pace - speed[j] * 1.05 - 0.2 / dt, 0.0)
            value = score[j] + now.likeness - MISS_COST * (gap - 1) - min(gain, 2.0)
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
