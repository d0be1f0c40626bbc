"""Decoding of films: frames from any place on, damaged data, and times of the container."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from fractions import Fraction
from functools import lru_cache
from itertools import dropwhile
from pathlib import Path
from typing import Any, NamedTuple, cast

import av
import cv2
import numpy as np
from av.container import InputContainer
from av.error import FFmpegError
from av.packet import Packet
from av.video.frame import VideoFrame
from av.video.stream import VideoStream

from curling_env.errors import InputError
from curling_env.infrastructure.files import limits
from friction_estimation.film.frame import keep_one_field

CAPTURE_RATE = "com.android.capture.fps"
"""Key of Android's cameras for the number of frames taken in a second."""
MIN_SLOW, MAX_SLOW = 1.5, 64.0
"""Ratios of recording and playback rates that mean slow motion."""
FORMATS = (
    "mov,matroska,webm,avi,mpegts,mpeg,mpegvideo,h264,hevc,m4v,flv,asf,ogg,mxf,gif,ivf,nut,dv,mjpeg"
)
"""Containers that contain their frames: no playlists, which name other files."""
SEEK_BACK = 4.0
"""First step back of a seek that was too late [s]; doubled at each attempt."""


@contextmanager
def opened(path: Path) -> Iterator[tuple[InputContainer, VideoStream]]:
    """Return a film's container and its first stream of pictures.

    Raises
    ------
    InputError : not a film, a kind that names other files, or too large frames
    """
    try:
        # No film may name another file, in any place.
        container = av.open(
            f"file:{path}",
            metadata_errors="replace",
            options={"protocol_whitelist": "file", "format_whitelist": FORMATS},
        )
    except (FFmpegError, OSError, ValueError) as fault:
        raise InputError("cannot be decoded; expected a film", source=path) from fault
    with container:
        if not container.streams.video:
            raise InputError("cannot be decoded; expected a film", source=path)
        stream = container.streams.video[0]
        codec = cast("Any", stream.codec_context)  # None for a damaged or unknown kind of film
        if codec is None:
            raise InputError("cannot be decoded; expected a film", source=path)
        if codec.width * codec.height > limits.MAX_FRAME_PIXELS:
            raise InputError(
                f"has frames of {codec.width} × {codec.height} pixels; expected at most "
                f"{limits.MAX_FRAME_PIXELS // 10**6} million",
                source=path,
            )
        # The size may change within the film; FFmpeg adds a margin to compressed frames.
        codec.options = {"max_pixels": str(limits.MAX_FRAME_PIXELS * 5 // 4)}
        stream.thread_type = "AUTO"
        codec.thread_count = cv2.getNumThreads()  # one setting for all decoding
        yield container, stream


def packets(container: InputContainer, stream: VideoStream) -> Iterator[Packet[VideoStream]]:
    """Yield the packets of the film from here on, up to its end or to damaged data."""
    packets = container.demux(stream)
    while True:
        try:
            packet = next(packets)
        except (StopIteration, FFmpegError):
            return
        yield packet


def decoded(
    container: InputContainer,
    stream: VideoStream,
    wanted: Callable[[Packet[VideoStream]], bool] | None = None,
    until: int | None = None,
) -> Iterator[tuple[VideoFrame, bool]]:
    """Yield all frames from here on that can be decoded, or only those of the requested packets.

    Parameters
    ----------
    until : packets due later than this, in the container's unit, end it

    Returns
    -------
    Frames, and whether each is damaged, like those that depend on a lost or damaged one.
    """
    damaged = False
    for packet in packets(container, stream):
        ended = until is not None and packet.size and (timestamp_of(packet) or 0) > until
        if not ended and wanted is not None and not wanted(packet):
            continue
        try:
            frames = stream.codec_context.decode(None) if ended else packet.decode()
        except FFmpegError:  # this packet has no picture, the next one may
            damaged = True
            continue
        for frame in frames:
            damaged = frame.is_corrupt or (damaged and not frame.key_frame)
            if frame.interlaced_frame and not frame.format.has_palette:
                keep_one_field(frame)
            yield frame, damaged
        if ended:
            return


def undamaged(
    container: InputContainer, stream: VideoStream, begin: int | None = None
) -> Iterator[tuple[int, VideoFrame]]:
    """Yield numbers and frames, without those that depend on a lost or damaged one.

    Parameters
    ----------
    begin : time of the frame with number 0, in the container's unit; None for the first frame of
        the file
    """
    frames = decoded(container, stream) if begin is None else decoded_from(container, stream, begin)
    return ((index, frame) for index, (frame, damaged) in enumerate(frames) if not damaged)


def decoded_from(
    container: InputContainer, stream: VideoStream, moment: int
) -> Iterator[tuple[VideoFrame, bool]]:
    """Yield the same from the frame that is due at a moment."""
    seek_before(container, stream, moment)
    frames = decoded(container, stream)
    return dropwhile(lambda found: (timestamp_of(found[0]) or 0) < moment, frames)


def seek_before(container: InputContainer, stream: VideoStream, moment: int) -> None:
    """Seek a key frame from which a frame due at a moment can be decoded."""
    step, earliest = round(SEEK_BACK / unit(stream)), start(stream)
    back = 0
    # Containers without an index of their key frames seek approximately: the next key frame may
    # come too late, even after the film's first moment.
    while True:
        _seek(container, stream, moment - back)
        first, _ = next(decoded(container, stream), (None, False))
        in_time = first is not None and (timestamp_of(first) or 0) <= moment
        if in_time or moment - back < earliest - step:
            break
        back = max(2 * back, step)
    _seek(container, stream, moment - back)


def _seek(container: InputContainer, stream: VideoStream, moment: int) -> None:
    try:
        container.seek(moment, stream=stream)
    except FFmpegError:  # some containers have no data before their first picture
        container.seek(start(stream), stream=stream)


class Timetable(NamedTuple):
    """Times of the frames of a film, in the container's unit.

    Parameters
    ----------
    moments : time of every frame, in order; empty if the container lacks one
    keys : times of the key frames, in order
    unit : the container's unit [s]
    """

    moments: tuple[int, ...]
    keys: tuple[int, ...]
    unit: Fraction


def timetable_of(path: Path) -> Timetable:
    """Return the times of the frames of a film; nothing is decoded."""
    return _timetable_of(path, path.stat().st_mtime_ns)


@lru_cache(maxsize=4)
def _timetable_of(path: Path, changed: int) -> Timetable:
    with opened(path) as (container, stream):
        found = [
            (timestamp_of(packet), packet.is_keyframe)
            for packet in packets(container, stream)
            if packet.size and not packet.is_discard
        ]
        tick = unit(stream)
    timed = sorted((moment, key) for moment, key in found if moment is not None)
    if len(timed) < len(found):
        return Timetable((), (), tick)
    return Timetable(tuple(m for m, _ in timed), tuple(m for m, key in timed if key), tick)


def timestamp_of(stored: VideoFrame | Packet[VideoStream]) -> int | None:
    """Return the time of a frame, in the container's unit; None if it is missing."""
    return stored.dts if stored.pts is None else stored.pts


def stamp(
    stored: VideoFrame | Packet[VideoStream], stream: VideoStream, begin: int | None = None
) -> float:
    """Return the time of a frame since the film began, or since a moment [s].

    NaN if the container does not state it.
    """
    moment = timestamp_of(stored)
    begin = start(stream) if begin is None else begin
    return np.nan if moment is None else float((moment - begin) * unit(stream))


def slow_motion(container: InputContainer, stream: VideoStream) -> float:
    """Return the factor of slow motion, as stored by its camera; 1 if it is missing.

    Android's cameras note the rate at which the frames were taken.
    """
    for notes in (container.metadata, stream.metadata):
        try:
            taken = float(notes.get(CAPTURE_RATE, "nan"))
        except ValueError:
            continue
        played = rate(stream)
        if played > 0 and MIN_SLOW < taken / played < MAX_SLOW:
            return taken / played
    return 1.0


def start(stream: VideoStream) -> int:
    return stream.start_time or 0


def unit(stream: VideoStream) -> Fraction:
    """Return the unit of the container's times [s]."""
    return stream.time_base or Fraction(1, 1000)


def rate(stream: VideoStream) -> float:
    """Return the nominal frames per second of the container; 0 if missing."""
    return float(stream.guessed_rate or stream.average_rate or 0)
