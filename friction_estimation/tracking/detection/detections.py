"""Detections: candidates for stones in each sampled frame, with positions and log odds."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from curling_env.sheet import Sheet
from curling_env.typing import Flags, Floats, Image, Integers
from friction_estimation.appearance import StoneModel
from friction_estimation.camera.camera import Camera
from friction_estimation.tracking import tuning
from friction_estimation.tracking.detection.background import Background, Blob, moving_blobs
from friction_estimation.tracking.detection.detector import StoneFinder
from friction_estimation.tracking.detection.sightings import is_larger, sighting_of

_LEAST_LIKENESS = 0.03
"""Minimum similarity of a candidate to a stone."""
_CLEAR_LIKENESS = 0.5
"""Minimum similarity of a blob that needs no finder."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Detections:
    """Detections of stones in the sampled frames, in order of time.

    Parameters
    ----------
    frame : (n,) index of the frame among the sampled ones
    t : (n,) its time [s]
    xy : (n, 2) place on the ice [m]
    sigma : (n, 2) standard error of the place [m]
    score : (n,) log odds of a stone rather than something else
    likeness : (n,) 1 for exactly the picture of a stone, towards 0 otherwise
    still : (n,) whether it rests on ice that does not change
    alone : (n,) whether nothing that moves touches it
    times : (k,) times of all sampled frames [s]
    crowds : times [s] and boxes (2, 2) [px] of what moves and is larger than a stone
    """

    frame: Integers
    t: Floats
    xy: Floats
    sigma: Floats
    score: Floats
    likeness: Floats
    still: Flags
    alone: Flags
    times: Floats
    crowds: tuple[tuple[float, Floats], ...] = ()

    @cached_property
    def leaves(self) -> Flags:
        """True for the last detection of a stone that rested and is gone at the end, (n,)."""
        found = np.zeros(len(self.t), dtype=bool)
        end = self.times[-tuning.END_FRAMES :][0]
        for k in np.flatnonzero(self.still & (self.t < end)):
            later = self.still & (self.t > self.t[k])
            there = np.hypot(*(self.xy[later] - self.xy[k]).T) < tuning.SAME_PLACE
            found[k] = not there.any()
        return found

    def joined(self, other: Detections) -> Detections:
        """These and those of other frames."""
        times = np.union1d(self.times, other.times)
        t = np.concatenate([self.t, other.t])
        order = np.argsort(t, kind="stable")

        def both(name: str) -> NDArray[Any]:
            return np.concatenate([getattr(self, name), getattr(other, name)])[order]

        return Detections(
            frame=np.searchsorted(times, t[order]),
            t=t[order],
            xy=both("xy"),
            sigma=both("sigma"),
            score=both("score"),
            likeness=both("likeness"),
            still=both("still"),
            alone=both("alone"),
            times=times,
            crowds=self.crowds + other.crowds,
        )


class Detector:
    """Detector of candidates for stones in the frames of one film.

    Separate moving objects are classified by size. Where a larger object moves, and on unchanged
    ice, the finder is used; its detections on still ice hold for every frame that shows it.

    Parameters
    ----------
    background : the ice without what moved
    camera : the film's camera
    model : the shape of a stone
    sheet : the ice
    finder : finds stones in pictures
    every : the finder is asked in one of this number of frames
    before : of an earlier part of the film; on ice that is as it was then, so are the stones
    """

    def __init__(
        self,
        background: Background,
        camera: Camera,
        model: StoneModel,
        sheet: Sheet,
        finder: StoneFinder,
        *,
        every: int = 1,
        before: Detector | None = None,
    ) -> None:
        self.background, self.camera = background, camera
        self.model, self.sheet = model, sheet
        self._finder, self._every = finder, every
        known = None if before is None else (before.background, before._still)
        self._still = _still(background, camera, model, finder, known)

    @property
    def at_rest(self) -> list[Floats]:
        """Positions (2,) of objects at rest on unchanged ice, most likely first [m]."""
        stones = sorted(self._still.stones, key=lambda one: -one.score)
        return [one.xy for one in stones]

    def detect(self, frames: Iterable[tuple[float, Image]]) -> Detections:
        """List candidates for stones in each frame, in order of time [s]."""
        found: list[_Found] = []
        times: list[float] = []
        crowds: list[tuple[float, Floats]] = []
        for k, (t, frame) in enumerate(frames):
            times.append(t)
            blobs = moving_blobs(frame, self.background)
            crowds += [
                (t, _box(blob)) for blob in blobs if is_larger(blob, self.camera, self.model)
            ]
            found += self._in_frame(k, t, frame, blobs)
        xy = np.array([one.xy for one in found]).reshape(-1, 2)
        return Detections(
            frame=np.array([one.frame for one in found], dtype=np.int64),
            t=np.array([one.t for one in found]),
            xy=xy,
            sigma=place_sigma(self.camera, xy, self.model),
            score=np.array([one.score for one in found]),
            likeness=np.array([one.likeness for one in found]),
            still=np.array([one.still for one in found], dtype=bool),
            alone=np.array([one.alone for one in found], dtype=bool),
            times=np.array(times),
            crowds=tuple(crowds),
        )

    def _in_frame(self, k: int, t: float, frame: Image, blobs: Sequence[Blob]) -> list[_Found]:
        seen = [
            sighting_of(blob, self.camera, self.model, self.sheet) if blob.darker else None
            for blob in blobs
        ]
        here = [
            _Found(
                frame=k,
                t=t,
                xy=one.xy,
                score=_blob_score(one.likeness),
                likeness=one.likeness,
                alone=True,
            )
            for one in seen
            if one is not None
        ]
        moved = np.array([_box(blob) for blob in blobs]).reshape(-1, 2, 2)
        unclear = np.array(
            [one is None or one.likeness < _CLEAR_LIKENESS for one in seen], dtype=bool
        )
        if unclear.any() and k % self._every == 0:
            for one in self._finder.detect(frame, moved[unclear]):
                known = (*(other.xy for other in here), *self._still.places)
                if _apart(one.xy, known):
                    like = float(np.clip(one.log_odds / 4, 0.0, 1.0))
                    here.append(_Found(frame=k, t=t, xy=one.xy, score=one.log_odds, likeness=like))
        for one in self._still.stones:
            if not _touching(one.px, moved).any() or _seen_again(one, frame, self.background):
                here.append(
                    _Found(frame=k, t=t, xy=one.xy, score=one.score, likeness=0.0, still=True)
                )
        return here


def place_sigma(camera: Camera, xy: Floats, model: StoneModel) -> Floats:
    """Standard error of each coordinate of detections (n, 2) [m]."""
    if not len(xy):
        return np.empty((0, 2))
    error = tuning.DETECTION_PX * camera.metres_per_px(xy, model.height / 2)
    return np.hypot(error, tuning.DETECTION_M)


@dataclass(frozen=True, kw_only=True, eq=False)
class _Found:
    """One detection; see `Detections`."""

    frame: int
    t: float
    xy: Floats
    score: float
    likeness: float
    still: bool = False
    alone: bool = False


@dataclass(frozen=True, kw_only=True, eq=False)
class _Resting:
    """Stone on the still ice: position [m], box (2, 2) [px] and log odds."""

    xy: Floats
    px: Floats
    score: float


@dataclass(frozen=True, kw_only=True, eq=False)
class _Still:
    """Stones on the still ice, and the positions of all detections of the finder there."""

    stones: tuple[_Resting, ...] = ()
    places: tuple[Floats, ...] = ()


def _still(
    background: Background,
    camera: Camera,
    model: StoneModel,
    finder: StoneFinder,
    known: tuple[Background, _Still] | None,
) -> _Still:
    """Return the stones on the still ice.

    Parameters
    ----------
    known : the ice of an earlier part of the film and what was on it, which holds where the ice has
        not changed; None: all of it is searched
    """
    whole = np.zeros((camera.size[1], camera.size[0], 3), dtype=np.uint8)
    whole[background.slices] = background.flat
    boxes: Floats | None = None
    stones: list[_Resting] = []
    others: list[Floats] = []
    if known is not None:
        ice, before = known
        boxes = np.array([_box(blob) for blob in moving_blobs(whole, ice)]).reshape(-1, 2, 2)
        stones = [one for one in before.stones if not _touching(one.px, boxes).any()]
        others = [xy for xy in before.places if not _shows(camera, model, xy, boxes)]
    found = finder.detect(whole, boxes)
    for one in found:
        px = model.extent_px(camera, one.xy)
        if len(px) and one.in_play and one.is_sure:  # others are parked
            stones.append(_Resting(xy=one.xy, px=px, score=one.log_odds))
    return _Still(stones=tuple(stones), places=(*others, *(one.xy for one in found)))


def _shows(camera: Camera, model: StoneModel, xy: Floats, boxes: Floats) -> bool:
    """Return whether one of some boxes (k, 2, 2) [px] contains a part of a stone at a position."""
    px = model.extent_px(camera, xy)
    return not len(px) or bool(_touching(px, boxes).any())


def _seen_again(one: _Resting, frame: Image, background: Background) -> bool:
    """Return whether a frame shows the still ice where a stone rests."""
    (left, top), (right, bottom) = one.px.astype(int).tolist()
    u, v = background.origin_px
    there = frame[top : bottom + 1, left : right + 1].astype(np.int16)
    before = background.flat[top - v : bottom + 1 - v, left - u : right + 1 - u]
    if there.shape != before.shape or not there.size:
        return False
    return float(np.median(np.abs(there - before))) < 3 * background.noise + 2


def _blob_score(likeness: float) -> float:
    return float(np.log(max(likeness, _LEAST_LIKENESS))) + 1.5


def _box(blob: Blob) -> Floats:
    """Corners of all of a blob, (2, 2) [px]."""
    middle = (blob.low_px + blob.high_px) / 2
    half = np.maximum(blob.whole_px, blob.high_px - blob.low_px + 1) / 2
    return np.array([middle - half, middle + half])


def _apart(xy: Floats, others: Sequence[Floats]) -> bool:
    """Return whether a position differs from all others."""
    return all(np.hypot(*(xy - other)) > tuning.SAME_PLACE for other in others)


def _touching(px: Floats, boxes: Floats) -> Flags:
    """Return which boxes (k, 2, 2) a box (2, 2) touches, (k,)."""
    return ((boxes[:, 0] < px[1]) & (boxes[:, 1] > px[0])).all(axis=1)
