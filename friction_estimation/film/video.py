"""Reader of films: frames with their times."""

# OpenCV's stubs widen the element type of every array that they return.
# pyright: reportArgumentType=false, reportCallIssue=false, reportReturnType=false
# pyright: reportAssignmentType=false

from __future__ import annotations

import os
import re
from bisect import bisect_left, bisect_right
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import islice
from pathlib import Path

import av
import numpy as np
from av.packet import Packet
from av.video.stream import VideoStream

from curling_env.errors import InputError
from curling_env.infrastructure.files import limits
from curling_env.infrastructure.files.reading import ordinary_file
from curling_env.infrastructure.files.table import Column, read_table
from curling_env.infrastructure.files.writing import fitted
from curling_env.typing import Image
from friction_estimation.film.decoding import (
    decoded,
    decoded_from,
    opened,
    packets,
    rate,
    seek_before,
    slow_motion,
    stamp,
    start,
    timestamp_of,
    timetable_of,
    undamaged,
    unit,
)
from friction_estimation.film.frame import LazyFrame

DEFAULT_FPS = 30.0
"""Frame rate if neither the film nor the scene has a usable one."""
MIN_FRAMES_TO_SEEK = 40
"""Number of frames below which decoding is cheaper than a seek, which goes back to a key frame."""
MIN_KEY_FRAMES = 0.8
"""Minimum share of the requested frames for a sample of key frames only."""
MAX_SAMPLE_SHIFT = 0.25
"""Otherwise, maximum shift of a sample's frame towards a key frame, as a share of the step between
frames.
"""
MAX_DECODED_SHARE = 0.7
"""Maximum share of the film that may be decoded for it."""
SUFFIXES = (".mp4", ".mov", ".m4v", ".mkv", ".avi", ".webm", ".mts", ".m2ts", ".ts", ".mpg", ".3gp")
"""Suffixes of the files that count as films in a folder."""
TIMES_SUFFIX = ".times.csv"
"""Suffix added to a film's name for a table with the time of every frame, if its container lost
them.
"""


TIMES_TABLE = (Column(name="t", unit="s", low=-1e9, high=1e9),)
"""Columns of that table: one row for every frame, without gaps."""


@dataclass(frozen=True, kw_only=True)
class Film:
    """Film on disk that can be decoded.

    Parameters
    ----------
    path : path of the file
    size : width and height [px]
    fps : nominal recording rate [frames per second]
    frame_count : number of frames according to the container; the film may end earlier
    fps_given : true if the caller's rate replaces the container's times
    times : time of every frame [s], from the table `TIMES_SUFFIX` beside the film; empty if there
        is no table
    slow : factor of slow motion; its times are real times
    first : number of its first frame in the file; above 0 in a part of a film
    whole : true if it goes to the end of its file, whatever the number of frames
    """

    path: Path
    size: tuple[int, int]
    fps: float
    frame_count: int
    fps_given: bool = False
    times: tuple[float, ...] = ()
    slow: float = 1.0
    first: int = 0
    whole: bool = True

    @classmethod
    def open(cls, path: str | Path, fps: float | None = None, slow: float | None = None) -> Film:
        """Open a film: it must exist, be a film, and have a first frame.

        Parameters
        ----------
        fps : rate that replaces the container's own times; None trusts the container
        slow : factor of slow motion; None uses the one stored by the camera

        Raises
        ------
        InputError : missing, not a film, or without a single frame that can be decoded
        """
        path = ordinary_file(path, "film")
        with opened(path) as (container, stream):
            first, _ = next(decoded(container, stream), (None, False))
            if first is None:
                raise InputError("cannot be decoded; expected a film", source=path)
            height, width, _ = LazyFrame(first).shape
            nominal = rate(stream)
            length = (container.duration or 0) / av.time_base
            frame_count = stream.frames or round(length * (nominal or DEFAULT_FPS))
            if frame_count == 0:
                frame_count = 1 + sum(packet.size > 0 for packet in packets(container, stream))
            noted = slow_motion(container, stream)
        usable = 1 <= nominal <= 1000
        times = () if fps is not None else _times_table(path)
        if fps is not None or times:
            noted = 1.0  # these times are real times already
        slow = noted if slow is None else slow
        return cls(
            path=path,
            size=(width, height),
            fps=(fps or (nominal if usable else DEFAULT_FPS)) * slow,
            frame_count=min(max(frame_count, 1), limits.MAX_FRAMES),
            fps_given=fps is not None,
            times=tuple(t / slow for t in times),
            slow=slow,
        )

    @property
    def duration(self) -> float:
        """Duration according to the container [s]."""
        if self.times:
            return self.times[-1]
        moments = self._moments
        if self.fps_given or not moments:
            return self.frame_count / self.fps
        return (moments[-1] - moments[0]) * self._tick + 1 / self.fps

    @property
    def _moments(self) -> tuple[int, ...]:
        """Return the times of its frames, in the container's unit; empty if unknown."""
        moments = timetable_of(self.path).moments[self.first :]
        return moments if self.whole else moments[: self.frame_count]

    @property
    def _begin(self) -> int | None:
        """Return the time of the first frame of a part; None for a film from its file's
        beginning.
        """
        return self._moments[0] if self.first and self._moments else None

    def part(self, low: float, high: float) -> Film:
        """Return the part between two times [s], as a separate film whose times begin at 0.

        Nothing before it is decoded, except for frames that its first frame depends on.
        """
        first, last = self.index_at(low), self.index_at(high)
        times = self.times[first : last + 1]
        return replace(
            self,
            frame_count=last - first + 1,
            first=self.first + first,
            times=tuple(t - times[0] for t in times),
            whole=self.whole and last >= self.frame_count - 1,
        )

    def begin_of(self, part: Film) -> float:
        """Return the time at which a part of this film begins [s]."""
        index = part.first - self.first
        if index < len(self.times):
            return self.times[index]
        moments = self._moments
        if self.fps_given or index >= len(moments):
            return index / self.fps
        return (moments[index] - moments[0]) * self._tick

    @property
    def _tick(self) -> float:
        """Return the unit of the container's times [s of real time]."""
        return float(timetable_of(self.path).unit) / self.slow

    def frames(self) -> Iterator[tuple[float, Image]]:
        """Yield every frame, (height, width, 3) BGR, with its time since the first one [s].

        Times are the container's if they increase; a frame without a usable one comes one nominal
        interval after its predecessor. After damaged data, frames are dropped up to the next key
        frame: those in between are stored as changes and would show a stale picture.
        """
        for t, frame in self.lazy_frames():
            yield t, frame.whole()

    def lazy_frames(self) -> Iterator[tuple[float, LazyFrame]]:
        """Yield the same as `frames`, with colours converted only where they are read."""
        first: float | None = None
        last = -np.inf
        with opened(self.path) as (container, stream):
            begin = self._begin
            skipped = 0 if begin is not None else self.first
            for number, frame in undamaged(container, stream, begin):
                index = number - skipped
                if index < 0:
                    continue
                if not self.whole and index >= self.frame_count:
                    return
                if index < len(self.times):
                    last = self.times[index]
                    yield last, LazyFrame(frame)
                    continue
                moment = stamp(frame, stream) / self.slow
                if first is None:
                    t = last + 1 / self.fps if self.times else 0.0  # a table may end too early
                    first = moment - t
                else:
                    t = moment - first
                    if self.fps_given or not t > last + 0.05 / self.fps:
                        t = last + 1 / self.fps
                last = t
                yield t, LazyFrame(frame)

    def sample(self, count: int) -> list[tuple[float, Image]]:
        """Return about `count` frames spread evenly over the film, with approximate times [s].

        If there are enough of them, these are the film's key frames, so that the frames between
        need not be decoded. Otherwise frames near a key frame are taken, as a frame depends on all
        since.
        """
        enough = MIN_KEY_FRAMES * min(count, self.frame_count)
        if self._key_count >= enough:
            keys = self._key_frames(count)
            if len(keys) >= enough:
                return keys
        elif wanted := self._near_key_frames(count):
            near = self._seen_from_key_frames(wanted)
            if len(near) >= enough:
                return near
        return self.pick(np.linspace(0, self.frame_count - 1, count).round().astype(int).tolist())

    @property
    def _key_count(self) -> float:
        """Return the number of its key frames; infinite if its container does not state it."""
        keys, moments = timetable_of(self.path).keys, self._moments
        if not moments:
            return np.inf
        return bisect_right(keys, moments[-1]) - bisect_left(keys, moments[0])

    def index_at(self, t: float) -> int:
        """Return the number of the frame nearest to a time [s], to the container's precision."""
        moments = self._moments
        if self.times:
            index = int(np.searchsorted(self.times, t - 0.5 / self.fps))
        elif self.fps_given or not moments:
            index = round(t * self.fps)
        else:
            return int(np.argmin(np.abs((np.array(moments) - moments[0]) * self._tick - t)))
        return min(max(index, 0), self.frame_count - 1)

    def _key_frames(self, count: int) -> list[tuple[float, Image]]:
        """Yield at most `count` of the key frames, with approximate times [s]."""
        if self.first and self._begin is None:
            return []
        step, due = max((self.frame_count - 1) / max(count - 1, 1), 1.0), 0.0
        frames: list[tuple[float, Image]] = []
        with opened(self.path) as (container, stream):
            begin = start(stream) if self._begin is None else self._begin
            nominal = rate(stream) or DEFAULT_FPS
            until = None
            if not self.whole:
                last = begin + round((self.frame_count - 0.5) / nominal / unit(stream))
                until = self._moments[-1] if self._moments else last
            if self.first:
                seek_before(container, stream, begin)

            def is_due(packet: Packet[VideoStream]) -> bool:
                nonlocal due
                t = stamp(packet, stream, begin)
                early = np.isnan(t) or round(t * nominal) + 0.5 < due
                if not packet.is_keyframe or early:
                    # the last one, which flushes the frames still held back
                    return packet.size == 0
                due = step * ((round(t * nominal) + 0.5) // step + 1)
                return True

            for frame, damaged in decoded(container, stream, is_due, until):
                t = stamp(frame, stream, begin)
                raw = LazyFrame(frame)
                if not damaged and np.isfinite(t) and (raw.shape[1], raw.shape[0]) == self.size:
                    frames.append((self._time_of(round(t * nominal), t), raw.whole()))
        return frames

    def _near_key_frames(self, count: int) -> list[int]:
        """Return numbers of `count` frames, about evenly spread, most of them soon after key
        frames.

        Empty if hardly less would be decoded than the whole film.
        """
        moments, key_moments, _ = timetable_of(self.path)
        keys = np.searchsorted(moments, key_moments) - self.first
        if len(self._moments) < self.frame_count or keys.min(initial=1) > 0:
            return []
        even = np.linspace(0, self.frame_count - 1, count)
        slack = MAX_SAMPLE_SHIFT * (self.frame_count - 1) / max(count - 1, 1)
        at = np.searchsorted(keys, even, side="right") - 1
        before, after = keys[at], keys[np.minimum(at + 1, len(keys) - 1)]
        near = np.where(np.abs(after - even) <= slack, after, np.maximum(even - slack, before))
        wanted = np.unique(near.round().clip(0, self.frame_count - 1).astype(int))
        at = np.searchsorted(keys, wanted, side="right") - 1
        last = np.append(np.diff(at) > 0, True)
        effort = int((wanted - keys[at] + 1)[last].sum())
        return wanted.tolist() if effort < MAX_DECODED_SHARE * self.frame_count else []

    def _seen_from_key_frames(self, wanted: Sequence[int]) -> list[tuple[float, Image]]:
        """Yield the same as `pick`; from the last of them to the next key frame nothing is
        decoded.
        """
        moments, keys = self._moments, timetable_of(self.path).keys
        due = {moments[index]: index for index in wanted}
        waiting: set[int] = set()

        def is_needed(packet: Packet[VideoStream]) -> bool:
            moment = timestamp_of(packet)
            if packet.is_keyframe and moment is not None:
                following = bisect_right(keys, moment)
                until = keys[following] if following < len(keys) else np.inf
                waiting.update(m for m in due if moment <= m < until)
            needed = bool(waiting) or packet.size == 0
            if moment is not None:
                waiting.discard(moment)
            return needed

        frames: list[tuple[float, Image]] = []
        with opened(self.path) as (container, stream):
            begin = start(stream) if self._begin is None else self._begin
            if self.first:
                seek_before(container, stream, begin)
            for frame, damaged in decoded(container, stream, is_needed):
                moment = timestamp_of(frame)
                index = None if moment is None else due.pop(moment, None)
                raw = LazyFrame(frame)
                if index is None or damaged or (raw.shape[1], raw.shape[0]) != self.size:
                    continue
                frames.append((self._time_of(index, stamp(frame, stream, begin)), raw.whole()))
                if not due:
                    break
        return frames

    def _time_of(self, index: int, t: float) -> float:
        """Return the time of a frame whose number and time are in the container [s]."""
        if index < len(self.times):
            return self.times[index]
        return index / self.fps if self.fps_given or np.isnan(t) else t / self.slow

    def pick(self, wanted: Sequence[int]) -> list[tuple[float, Image]]:
        """Return the undamaged frames of these numbers, with approximate times [s]."""
        return list(self.picked(wanted))

    def between(self, low: float, high: float, step: float) -> Iterator[tuple[float, Image]]:
        """Return frames from one time to another about a step apart, with approximate times [s]."""
        first, last = self.index_at(low), self.index_at(high)
        return self.picked(range(first, last + 1, max(1, round(step * self.fps))))

    def picked(self, wanted: Sequence[int]) -> Iterator[tuple[float, Image]]:
        """Yield the same as `pick`, one after the other."""
        moments = self._moments
        with opened(self.path) as (container, stream):
            begin = start(stream) if self._begin is None else self._begin
            frames, at = decoded(container, stream), -self.first
            for index in sorted(set(wanted)):
                if index - at > MIN_FRAMES_TO_SEEK and index < len(moments):
                    frames, at = decoded_from(container, stream, moments[index]), index
                frame, damaged = next(islice(frames, index - at, None), (None, False))
                if frame is None:
                    return
                at, raw = index + 1, LazyFrame(frame)
                if not damaged and (raw.shape[1], raw.shape[0]) == self.size:
                    yield self._time_of(index, stamp(frame, stream, begin)), raw.whole()


def _times_table(film: Path) -> tuple[float, ...]:
    path = film.with_name(fitted(film.name, TIMES_SUFFIX))
    if not os.path.lexists(path):
        return ()
    times = read_table(path, columns=TIMES_TABLE, empty_rows=False).numbers("t")
    backwards = np.flatnonzero(np.diff(times) <= 0)
    if backwards.size:
        raise InputError(
            "times of frames must increase", source=path, where=f"row {backwards[0] + 3}"
        )
    return tuple((times - times[0]).tolist()) if len(times) else ()


def films_in(places: Sequence[str | Path]) -> list[Path]:
    """Return films, where each path is a film or a folder; those of a folder sorted by name.

    Numbers in names count as numbers, so that film 10 comes after film 9.

    Raises
    ------
    InputError : a camera or a stream, or a folder without films
    """
    films: list[Path] = []
    for given in places:
        if is_stream(str(given)):
            problem = "is a camera or a stream; use `curling live`"
            raise InputError(problem, source=str(given))
        place = Path(given)
        if not place.is_dir():
            films.append(place)
            continue
        # Names that begin with a dot are macOS's companions of films on other systems' disks.
        named = (path for path in place.iterdir() if not path.name.startswith("."))
        within = [path for path in named if path.suffix.lower() in SUFFIXES]
        if not within:
            raise InputError(f"contains no films ({', '.join(SUFFIXES)})", source=place)
        films += sorted(within, key=_name_in_order)
    return films


def _name_in_order(path: Path) -> list[tuple[int, str]]:
    parts = re.split(r"(\d+)", path.name.lower())
    return [(int(part), "") if part.isdecimal() else (-1, part) for part in parts]


def is_stream(source: str) -> bool:
    """Return whether a source is a camera's number or a stream's address, not a file."""
    return (
        source.isdecimal() or re.match(r"[a-z][a-z0-9+.-]*://", source, re.IGNORECASE) is not None
    )
