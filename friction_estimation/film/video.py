"""Films in and out: frames with their own times, and films written whole or not at all."""

# OpenCV's stubs widen the element type of every array that they return.
# pyright: reportArgumentType=false, reportCallIssue=false, reportReturnType=false
# pyright: reportAssignmentType=false

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from itertools import chain, dropwhile, islice
from pathlib import Path

import av
import cv2
import numpy as np
from av.container import InputContainer
from av.error import FFmpegError
from av.packet import Packet
from av.video.frame import VideoFrame
from av.video.stream import VideoStream

from curling_env.errors import InputError, OutputError
from curling_env.infrastructure.storage import atomic_path, read_table
from curling_env.typing import Image
from friction_estimation.film.frame import LazyFrame

DEFAULT_FPS = 30.0
"""Taken where neither the film nor the scene gives a usable rate."""
SEEK_BEYOND = 40
"""Fewer frames than this are decoded rather than skipped by a seek, which goes back to a key frame.
"""
SEEK_BACK = 4.0
"""How much earlier a seek begins if it came too late [s]."""
MIN_KEY_FRAMES = 0.8
"""A sample is made of key frames alone if there are this share of the frames asked for."""
TIMES_SUFFIX = ".times.csv"
"""Added to a film's name: a table with the time of every frame, where its container lost them."""


@dataclass(frozen=True, kw_only=True)
class Film:
    """A film on disk that can be decoded.

    Parameters
    ----------
    path : path of the file
    size : width and height [px]
    fps : nominal frames per second
    frame_count : as the container says; the film may end earlier
    fps_given : whether the caller's rate replaces the container's times
    times : time of every frame [s], from the table `TIMES_SUFFIX` beside the film; empty if there
        is no table
    """

    path: Path
    size: tuple[int, int]
    fps: float
    frame_count: int
    fps_given: bool = False
    times: tuple[float, ...] = ()

    @classmethod
    def open(cls, path: str | Path, fps: float | None = None) -> Film:
        """Look at a film: it must exist, be a film, and have a first frame.

        Parameters
        ----------
        fps : rate that replaces the container's own times; None trusts the container

        Raises
        ------
        InputError : missing, not a film, or without a single frame that can be decoded
        """
        path = Path(path)
        if not path.exists():
            raise InputError("no such film", source=path)
        if path.is_dir():
            raise InputError("is a directory; expected a film", source=path)
        with _opened(path) as (container, stream):
            first = next(_decoded(container, stream), None)
            if first is None:
                raise InputError("not a film that can be decoded", source=path)
            height, width, _ = LazyFrame(first).shape
            said = _rate(stream)
            length = (container.duration or 0) / av.time_base
            frame_count = stream.frames or round(length * (said or DEFAULT_FPS))
            if frame_count == 0:
                frame_count = 1 + sum(packet.size > 0 for packet in _packets(container, stream))
        usable = 1 <= said <= 1000
        return cls(
            path=path,
            size=(width, height),
            fps=fps or (said if usable else DEFAULT_FPS),
            frame_count=max(frame_count, 1),
            fps_given=fps is not None,
            times=() if fps is not None else _times_beside(path),
        )

    def frames(self) -> Iterator[tuple[float, Image]]:
        """Every frame, (height, width, 3) BGR, with its time since the first one [s].

        Times are the container's where they increase; a frame without a usable one comes one
        nominal interval after its predecessor. After damaged data, frames are left out up to the
        next key frame: those in between are stored as changes and would show a stale picture.
        """
        for t, frame in self.lazy_frames():
            yield t, frame.whole()

    def lazy_frames(self) -> Iterator[tuple[float, LazyFrame]]:
        """The same as `frames`, with colours converted only where they are looked at."""
        first: float | None = None
        last = -np.inf
        with _opened(self.path) as (container, stream):
            for index, frame in _undamaged(container, stream):
                if index < len(self.times):
                    yield self.times[index], LazyFrame(frame)
                    continue
                stamp = _stamp(frame, stream)
                if first is None:
                    first, t = stamp, 0.0
                else:
                    t = stamp - first
                    if self.fps_given or not t > last + 0.05 / self.fps:
                        t = last + 1 / self.fps
                last = t
                yield t, LazyFrame(frame)

    def sample(self, count: int) -> list[tuple[float, Image]]:
        """About `count` frames spread evenly over the film, with approximate times [s].

        Where there are enough of them, these are the film's key frames, so that the frames between
        need not be decoded.
        """
        keys = self._key_frames(count)
        if len(keys) >= MIN_KEY_FRAMES * min(count, self.frame_count):
            return keys
        return self.pick(np.linspace(0, self.frame_count - 1, count).round().astype(int).tolist())

    def index_at(self, t: float) -> int:
        """The number of the frame nearest to a time [s], as far as the film's rate tells."""
        if self.times:
            index = int(np.searchsorted(self.times, t - 0.5 / self.fps))
        else:
            index = round(t * self.fps)
        return min(max(index, 0), self.frame_count - 1)

    def _key_frames(self, count: int) -> list[tuple[float, Image]]:
        """At most `count` of the key frames, with approximate times [s]."""
        step, due = max((self.frame_count - 1) / max(count - 1, 1), 1.0), 0.0
        frames: list[tuple[float, Image]] = []
        with _opened(self.path) as (container, stream):
            said = _rate(stream) or DEFAULT_FPS

            def is_due(packet: Packet[VideoStream]) -> bool:
                nonlocal due
                stamp = _stamp(packet, stream)
                if not packet.is_keyframe or np.isnan(stamp) or round(stamp * said) + 0.5 < due:
                    return packet.size == 0  # the last one, which asks for what is still held back
                due = step * ((round(stamp * said) + 0.5) // step + 1)
                return True

            for frame in _decoded(container, stream, is_due):
                stamp = _stamp(frame, stream)
                raw = LazyFrame(frame)
                if np.isfinite(stamp) and (raw.shape[1], raw.shape[0]) == self.size:
                    frames.append((self._time_of(round(stamp * said), stamp), raw.whole()))
        return frames

    def _time_of(self, index: int, stamp: float) -> float:
        """Time of a frame whose number and time the container tells [s]."""
        if index < len(self.times):
            return self.times[index]
        return index / self.fps if self.fps_given or np.isnan(stamp) else stamp

    def pick(self, wanted: Sequence[int]) -> list[tuple[float, Image]]:
        """The frames of these numbers that the film has, with approximate times [s]."""
        return list(self.picked(wanted))

    def between(self, low: float, high: float, step: float) -> Iterator[tuple[float, Image]]:
        """Frames from one time to another about a step apart, with approximate times [s]."""
        first, last = self.index_at(low), self.index_at(high)
        return self.picked(range(first, last + 1, max(1, round(step * self.fps))))

    def picked(self, wanted: Sequence[int]) -> Iterator[tuple[float, Image]]:
        """The same as `pick`, one after the other."""
        with _opened(self.path) as (container, stream):
            frames, at = _decoded(container, stream), 0
            for index in sorted(set(wanted)):
                if index - at > SEEK_BEYOND and index < len(self._moments):
                    frames, at = _decoded_from(container, stream, self._moments[index]), index
                frame = next(islice(frames, index - at, None), None)
                if frame is None:
                    return
                at, raw = index + 1, LazyFrame(frame)
                if (raw.shape[1], raw.shape[0]) == self.size:
                    yield self._time_of(index, _stamp(frame, stream)), raw.whole()

    @cached_property
    def _moments(self) -> list[int]:
        """When each frame is due, in the container's own unit; empty where it does not say."""
        with _opened(self.path) as (container, stream):
            found = [
                timestamp_of(packet)
                for packet in _packets(container, stream)
                if packet.size and not packet.is_discard
            ]
        said = [moment for moment in found if moment is not None]
        return sorted(said) if len(said) == len(found) else []


def _times_beside(film: Path) -> tuple[float, ...]:
    path = film.with_name(film.name + TIMES_SUFFIX)
    if not path.exists():
        return ()
    times = read_table(path, required=("t",)).numbers("t")
    backwards = np.flatnonzero(np.diff(times) <= 0)
    if backwards.size:
        raise InputError(
            "times of frames must increase", source=path, where=f"row {backwards[0] + 3}"
        )
    return tuple((times - times[0]).tolist()) if len(times) else ()


def is_stream(source: str) -> bool:
    """Whether a source is a camera's number or a stream's address, and not a file."""
    return (
        source.isdecimal() or re.match(r"[a-z][a-z0-9+.-]*://", source, re.IGNORECASE) is not None
    )


@contextmanager
def _opened(path: Path) -> Iterator[tuple[InputContainer, VideoStream]]:
    try:
        container = av.open(str(path), metadata_errors="replace")
    except (FFmpegError, OSError) as fault:
        raise InputError("not a film that can be decoded", source=path) from fault
    with container:
        if not container.streams.video:
            raise InputError("not a film that can be decoded", source=path)
        stream = container.streams.video[0]
        stream.thread_type = "AUTO"
        stream.codec_context.thread_count = cv2.getNumThreads()  # one setting for all that is done
        yield container, stream


def _packets(container: InputContainer, stream: VideoStream) -> Iterator[Packet[VideoStream]]:
    """The packets of the film from here on, up to its end or to where it breaks off."""
    packets = container.demux(stream)
    while True:
        try:
            packet = next(packets)
        except (StopIteration, FFmpegError):
            return
        yield packet


def _decoded(
    container: InputContainer,
    stream: VideoStream,
    wanted: Callable[[Packet[VideoStream]], bool] | None = None,
) -> Iterator[VideoFrame]:
    """All frames from here on that can be decoded, or only those of the packets that are wanted."""
    for packet in _packets(container, stream):
        if wanted is not None and not wanted(packet):
            continue
        try:
            frames = packet.decode()
        except FFmpegError:  # this packet holds no picture, the next one may
            continue
        yield from frames


def _undamaged(container: InputContainer, stream: VideoStream) -> Iterator[tuple[int, VideoFrame]]:
    """Numbers and frames, without those that depend on a lost or damaged one."""
    damaged, index = False, 0
    for packet in _packets(container, stream):
        try:
            frames = packet.decode()
        except FFmpegError:
            damaged = True
            continue
        for frame in frames:
            damaged = frame.is_corrupt or (damaged and not frame.key_frame)
            if not damaged:
                yield index, frame
            index += 1


def _decoded_from(
    container: InputContainer, stream: VideoStream, moment: int
) -> Iterator[VideoFrame]:
    """The same from the frame on that is due at a moment."""
    back = round(SEEK_BACK / _unit(stream))
    for begin in (moment, moment - back, _start(stream)):
        # Some containers have no table of their whole pictures, and go where it seems best.
        container.seek(begin, stream=stream)
        frames = _decoded(container, stream)
        first = next(frames, None)
        if first is not None and (timestamp_of(first) or 0) <= moment:
            break
    else:
        return iter(())
    return dropwhile(lambda frame: (timestamp_of(frame) or 0) < moment, chain([first], frames))


def timestamp_of(stored: VideoFrame | Packet[VideoStream]) -> int | None:
    """When a frame is due, in the container's own unit; None if it does not say."""
    return stored.dts if stored.pts is None else stored.pts


def _stamp(stored: VideoFrame | Packet[VideoStream], stream: VideoStream) -> float:
    """When a frame is due since the film began [s]; NaN if the container does not say."""
    moment = timestamp_of(stored)
    return np.nan if moment is None else float((moment - _start(stream)) * _unit(stream))


def _start(stream: VideoStream) -> int:
    return stream.start_time or 0


def _unit(stream: VideoStream) -> Fraction:
    """The unit of the container's times [s]."""
    return stream.time_base or Fraction(1, 1000)


def _rate(stream: VideoStream) -> float:
    """Nominal frames per second as the container says; 0 if it does not."""
    return float(stream.guessed_rate or stream.average_rate or 0)


class FilmWriter:
    """Writes BGR frames of one size to a film; see `film_writer`."""

    def __init__(self, path: Path, size: tuple[int, int], fps: float) -> None:
        codec = "MJPG" if path.suffix.lower() == ".avi" else "mp4v"
        self._size = size
        self._writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*codec), fps, size)
        if not self._writer.isOpened():
            raise OutputError(f"{path}: cannot be written as a film; name it .mp4 or .avi")

    def write(self, frame: Image) -> None:
        """Append one frame, (height, width, 3) BGR."""
        if (frame.shape[1], frame.shape[0]) != self._size:
            raise ValueError(f"expected frames of {self._size} px, got {frame.shape}")
        self._writer.write(frame)

    def close(self) -> None:
        self._writer.release()


@contextmanager
def film_writer(path: str | Path, size: tuple[int, int], fps: float) -> Iterator[FilmWriter]:
    """A film being written, which appears under its name only when it is complete.

    Parameters
    ----------
    path : ending in .mp4 or .avi
    size : width and height of every frame [px]
    fps : frames per second

    Raises
    ------
    OutputError : not writable, or a suffix that OpenCV cannot write
    """
    with atomic_path(path) as draft:
        writer = FilmWriter(draft, size, fps)
        try:
            yield writer
        finally:
            writer.close()
