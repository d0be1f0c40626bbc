"""Films in and out: frames with their own times, and overlays written whole or not at all."""

# OpenCV's stubs widen the element type of every array that they return.
# pyright: reportArgumentType=false, reportCallIssue=false, reportReturnType=false
# pyright: reportAssignmentType=false

from __future__ import annotations

import os
import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import count
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from curling_env.errors import InputError, OutputError
from curling_env.storage import atomic_path, read_table, write_table

Image = NDArray[np.uint8]

DEFAULT_FPS = 30.0
"""Taken where neither the film nor the scene says anything usable."""
SEEK_BEYOND = 40
"""A jump of fewer frames is quicker made by decoding them: a seek goes back to a whole picture."""
KEYS_SUFFICE = 0.8
"""Share of the frames asked for that a film's whole pictures must make up to be taken instead."""
CAPTURE_OPTIONS = "OPENCV_FFMPEG_CAPTURE_OPTIONS"
"""Environment variable that OpenCV reads when it opens a film; these options go no other way."""
TIMES_SUFFIX = ".times.csv"
"""Added to a film's name: a table with the time of every frame, where its container lost them."""


@dataclass(frozen=True, kw_only=True)
class Film:
    """A film on disk that can be decoded.

    Parameters
    ----------
    path : of the file
    size : width and height [px]
    fps : nominal frames per second
    frame_count : as the container says; the film may end earlier
    fps_given : whether the caller's rate replaces the container's times
    times : of every frame as `TIMES_SUFFIX` beside the film keeps them [s]; empty where there is
        none
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
        with _capture(path) as capture:
            ok, frame = capture.read()
            if not ok:
                raise InputError("not a film that can be decoded", source=path)
            said = capture.get(cv2.CAP_PROP_FPS)
            frame_count = int(capture.get(cv2.CAP_PROP_FRAME_COUNT))
        usable = np.isfinite(said) and 1 <= said <= 1000
        return cls(
            path=path,
            size=(frame.shape[1], frame.shape[0]),
            fps=fps or (float(said) if usable else DEFAULT_FPS),
            frame_count=max(frame_count, 1),
            fps_given=fps is not None,
            times=() if fps is not None else _times_beside(path),
        )

    def frames(self) -> Iterator[tuple[float, Image]]:
        """Every frame, (height, width, 3) BGR, with its time since the first one [s].

        Times are the container's where they increase; a frame without a usable one comes one
        nominal interval after its predecessor.
        """
        first: float | None = None
        last = -np.inf
        with _capture(self.path) as capture:
            for index in count():
                ok, frame = capture.read()
                if not ok:
                    return
                if index < len(self.times):
                    yield self.times[index], frame
                    continue
                stamp = capture.get(cv2.CAP_PROP_POS_MSEC) / 1000
                if first is None:
                    first, t = stamp, 0.0
                else:
                    t = stamp - first
                    if self.fps_given or not t > last + 0.05 / self.fps:
                        t = last + 1 / self.fps
                last = t
                yield t, frame

    def sample(self, count: int) -> list[tuple[float, Image]]:
        """About `count` frames spread evenly over the film, with approximate times [s].

        Where there are enough of them, these are the film's whole pictures: the frames between are
        stored as changes, and need not be decoded then.
        """
        keys = self._whole_pictures(count)
        if len(keys) >= KEYS_SUFFICE * min(count, self.frame_count):
            return keys
        return self.pick(np.linspace(0, self.frame_count - 1, count).round().astype(int).tolist())

    def index_at(self, t: float) -> int:
        """The number of the frame nearest to a time [s], as far as the film's rate tells."""
        if self.times:
            index = int(np.searchsorted(self.times, t - 0.5 / self.fps))
        else:
            index = round(t * self.fps)
        return min(max(index, 0), self.frame_count - 1)

    def _whole_pictures(self, count: int) -> list[tuple[float, Image]]:
        """At most `count` of the frames that stand for themselves, with approximate times [s]."""
        frames: list[tuple[float, Image]] = []
        with _capture(self.path, "avdiscard;nonkey") as capture:
            said = capture.get(cv2.CAP_PROP_FPS)
            step, due = (self.frame_count - 1) / max(count - 1, 1), 0.0
            while capture.grab():
                stamp = capture.get(cv2.CAP_PROP_POS_MSEC) / 1000
                index = round(stamp * said)
                if index + 0.5 < due:
                    continue
                due = step * ((index + 0.5) // step + 1)
                ok, frame = capture.retrieve()
                if ok and (frame.shape[1], frame.shape[0]) == self.size:
                    frames.append((self._time_of(index, stamp), frame))
        return frames

    def _time_of(self, index: int, stamp: float) -> float:
        """Time of a frame whose number and time the container tells [s]."""
        if index < len(self.times):
            return self.times[index]
        return index / self.fps if self.fps_given else stamp

    def pick(self, wanted: Sequence[int]) -> list[tuple[float, Image]]:
        """The frames of these numbers that the film has, with approximate times [s]."""
        return list(self.picked(wanted))

    def between(self, low: float, high: float, step: float) -> Iterator[tuple[float, Image]]:
        """Frames from one time to another about a step apart, with approximate times [s]."""
        first, last = self.index_at(low), self.index_at(high)
        return self.picked(range(first, last + 1, max(1, round(step * self.fps))))

    def picked(self, wanted: Sequence[int]) -> Iterator[tuple[float, Image]]:
        """The same as `pick`, one after the other."""
        with _capture(self.path) as capture:
            at = 0
            for index in sorted(set(wanted)):
                if index - at > SEEK_BEYOND:
                    capture.set(cv2.CAP_PROP_POS_FRAMES, index)
                else:
                    while at < index and capture.grab():
                        at += 1
                ok, frame = capture.read()
                at = index + 1
                if ok and (frame.shape[1], frame.shape[0]) == self.size:
                    stamp = capture.get(cv2.CAP_PROP_POS_MSEC) / 1000
                    yield self._time_of(index, stamp), frame


def save_times(film: str | Path, times: Sequence[float]) -> None:
    """Keep when each frame of a film was taken, beside the film [s]."""
    write_table(_times_path(Path(film)), {"t": np.round(times, 6)})


def _times_path(film: Path) -> Path:
    return film.with_name(film.name + TIMES_SUFFIX)


def _times_beside(film: Path) -> tuple[float, ...]:
    path = _times_path(film)
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
    """Whether what a user gave is a camera's number or a stream's address, not a file."""
    return (
        source.isdecimal() or re.match(r"[a-z][a-z0-9+.-]*://", source, re.IGNORECASE) is not None
    )


@contextmanager
def _capture(path: Path, options: str | None = None) -> Iterator[cv2.VideoCapture]:
    before = os.environ.get(CAPTURE_OPTIONS)
    if options is not None:
        os.environ[CAPTURE_OPTIONS] = options
    try:
        capture = cv2.VideoCapture(str(path))
    finally:
        if before is None:
            os.environ.pop(CAPTURE_OPTIONS, None)
        else:
            os.environ[CAPTURE_OPTIONS] = before
    try:
        if not capture.isOpened():
            raise InputError("not a film that can be decoded", source=path)
        yield capture
    finally:
        capture.release()


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
