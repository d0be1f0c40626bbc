"""Writer of films: H.264 in MP4, which browsers, phones and editors play."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager, suppress
from fractions import Fraction
from pathlib import Path

import av
import cv2
import numpy as np
from av.error import FFmpegError
from av.video.frame import VideoFrame
from av.video.stream import VideoStream

from curling_env.errors import InputError, OutputError
from curling_env.infrastructure.files.kinds import FILM_MARK, FILM_SUFFIXES
from curling_env.infrastructure.files.writing import atomic_path
from curling_env.typing import Image
from friction_estimation.film.decoding import opened, packets

CONTAINERS: dict[str, tuple[str, str, str]] = dict(
    zip(FILM_SUFFIXES, (("mp4", "libx264", "yuv420p"), ("avi", "mjpeg", "yuvj420p")), strict=True)
)
"""Container, codec and pixel format of a film by its suffix. Many players support H.264 with halved
colours (yuv420p) only.
"""
TIME_UNIT = Fraction(1, 90_000)
"""Unit of the times in an MP4 film [s]."""
QUALITY = 20
"""Constant rate factor of H.264: lower is better and larger, 18 looks like the original."""
PRESET = "superfast"
"""x264's name for the effort of compression. The next slower preset halves the file for twice the
work, but occasionally makes another film of the same frames, even with one thread.
"""

KEY_SECONDS = 1.0
"""Time between key frames, as in cameras [s]: a player jumps to them immediately, and between them
the still ice keeps the noise of the last one.
"""


class FilmWriter:
    """Writer of BGR frames of one size to a film; see `film_writer`."""

    def __init__(
        self,
        path: Path,
        size: tuple[int, int],
        fps: float,
        quality: float = QUALITY,
        *,
        preset: str = PRESET,
        threads: int | None = None,
        name: str | Path | None = None,
    ) -> None:
        kind, codec, pixels = CONTAINERS[path.suffix.lower()]
        self._size, self._name = size, path if name is None else name
        self._even = (size[0] // 2 * 2, size[1] // 2 * 2)
        self._rate = Fraction(fps).limit_denominator(1001)
        self._unit = TIME_UNIT if kind == "mp4" else 1 / self._rate
        self._count, self._last = 0, -1
        # The index goes before the pictures, so that a film plays while it is still loading.
        options = {"movflags": "+faststart"} if kind == "mp4" else {}
        with self._reporting_errors():
            self._container = av.open(str(path), "w", format=kind, options=options)
            self._container.metadata["comment"] = FILM_MARK
            stream = self._container.add_stream(codec, rate=self._rate)
        assert isinstance(stream, VideoStream)  # a video codec was requested
        stream.width, stream.height = self._even
        stream.pix_fmt = pixels
        # By default the common setting for all work.
        stream.codec_context.thread_count = cv2.getNumThreads() if threads is None else threads
        stream.codec_context.time_base = self._unit
        if kind == "mp4":
            every = max(round(fps * KEY_SECONDS), 1)
            stream.options = {"preset": preset, "crf": f"{quality:g}", "g": str(every)}
        else:
            stream.options = {"q:v": "3"}
        self._stream = stream

    @property
    def frames(self) -> int:
        """Number of frames written."""
        return self._count

    def write(self, frame: Image, t: float | None = None) -> None:
        """Append one frame.

        Parameters
        ----------
        frame : (height, width, 3) BGR; for an odd size the last row or column is dropped, because
            colours are stored for two rows and columns at a time
        t : its time since the film began [s]; by default one interval after the other

        Raises
        ------
        OutputError : the disk is full
        """
        if (frame.shape[1], frame.shape[0]) != self._size:
            raise ValueError(f"expected frames of {self._size} px, got {frame.shape}")
        when = Fraction(self._count) / self._rate if t is None else Fraction(float(t))
        width, height = self._even
        stored = VideoFrame.from_ndarray(np.ascontiguousarray(frame[:height, :width]), "bgr24")
        stored.time_base = self._unit
        stored.pts = self._last = max(round(when / self._unit), self._last + 1)
        self._count += 1
        with self._reporting_errors():
            self._container.mux(self._stream.encode(stored))

    def finish(self) -> None:
        """Write the frames that are still being compressed, and the index of the film.

        Raises
        ------
        OutputError : the disk is full
        """
        with self._reporting_errors():
            if self._count:
                self._container.mux(self._stream.encode(None))
            self._container.close()

    def abandon(self) -> None:
        """Abandon a film that will not be finished."""
        with suppress(FFmpegError, OSError):
            self._container.close()

    @contextmanager
    def _reporting_errors(self) -> Iterator[None]:
        try:
            yield
        except (FFmpegError, OSError) as fault:
            reason = (fault.strerror or str(fault)).lower()
            raise OutputError(f"{self._name}: the film cannot be written: {reason}") from fault


@contextmanager
def film_writer(
    path: str | Path,
    size: tuple[int, int],
    fps: float,
    *,
    quality: float = QUALITY,
    preset: str = PRESET,
    threads: int | None = None,
) -> Iterator[FilmWriter]:
    """Provide the writer of a film, which appears under its name only when it is complete.

    An MP4 film is H.264 with its index in front, so that it plays in browsers, on phones and while
    it is being loaded. An AVI film is a row of JPEG pictures.

    Parameters
    ----------
    path : path ending in .mp4 or .avi
    size : width and height of every frame [px]
    fps : frames per second
    quality : constant rate factor of H.264; 0 loses nothing, 51 is the worst
    preset : x264's name for the effort of compression
    threads : number of threads for compression, on which even the pixels depend; by default
        OpenCV's number

    Raises
    ------
    OutputError : not writable, a full disk, or a suffix of another kind
    """
    if Path(path).suffix.lower() not in CONTAINERS:
        raise OutputError(
            f"{path}: cannot be written as a film; expected a name ending in .mp4 or .avi"
        )
    with atomic_path(path) as draft:
        writer = FilmWriter(draft, size, fps, quality, preset=preset, threads=threads, name=path)
        try:
            yield writer
        except BaseException:
            writer.abandon()
            raise
        writer.finish()
        _check_written(draft, writer.frames, path)


def _check_written(draft: Path, frames: int, name: str | Path) -> None:
    """Refuse a film that does not contain all written frames.

    Raises
    ------
    OutputError : it cannot be read back, or frames are missing
    """
    found = 0
    with suppress(InputError), opened(draft) as (container, stream):
        found = sum(packet.size > 0 for packet in packets(container, stream))
    if found < frames or not found:
        raise OutputError(f"{name}: could not be written completely: {found} of {frames} frames")
