"""Input of a camera or a stream: decoded frames, and the same frames encoded, for the film.

The packets of a stream are kept unchanged: encoding them again would cost time and accuracy. The
frames of a camera are encoded at the finest step of MPEG-4, which does not affect the measured
positions.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Generator
from contextlib import suppress
from dataclasses import dataclass
from fractions import Fraction
from functools import partial
from queue import Empty, Queue
from threading import Event, Thread
from typing import Any, Protocol

import av
import cv2
import numpy as np
from av.codec.context import Flags
from av.error import FFmpegError

from curling_env.errors import InputError
from curling_env.infrastructure.files import limits
from curling_env.typing import Image
from friction_estimation.film.decoding import FORMATS, timestamp_of
from friction_estimation.film.frame import brightness_of
from friction_estimation.film.video import DEFAULT_FPS
from friction_estimation.live import tuning

CLOCKLESS_FORMATS = ("mpjpeg", "mjpeg")
"""Formats of streams without times: their pictures are stamped when they arrive."""
A_FILE = {"protocol_whitelist": "file", "format_whitelist": FORMATS}
"""For films on the disk: no playlists or other formats that name further files."""
FINEST_MPEG4 = {"qmin": "2", "qmax": "2", "g": "50"}
"""MPEG-4 at its finest step, with a key frame every 50 frames."""
MPEG4_TICK = Fraction(1, 65535)
"""Finest unit of time in MPEG-4 [s]."""


@dataclass(frozen=True, kw_only=True)
class Packet:
    """A piece of an encoded stream: one frame, usually as changes to others.

    Parameters
    ----------
    data : the bytes as they came
    pts, dts : when its frame is shown, and decoded, since the first frame, in units of `unit`
    unit : unit of these times [s]
    key : whether it is a key frame, with which a film can begin
    """

    data: bytes
    pts: int
    dts: int
    unit: Fraction
    key: bool

    @property
    def t(self) -> float:
        """Time at which its frame was taken, since the first one [s]."""
        return float(self.pts * self.unit)


@dataclass(frozen=True, kw_only=True, eq=False)
class LiveFrame:
    """One frame of a feed.

    Parameters
    ----------
    t : when it was taken, since the first frame [s]
    grey : its brightness, (height, width)
    picture : makes the frame in colour, (height, width, 3) BGR, until the next one is asked for
    packets : all packets that came since the frame before it
    """

    t: float
    grey: Image
    picture: Callable[[], Image]
    packets: tuple[Packet, ...]


class Feed(Protocol):
    """An open source of frames.

    Attributes
    ----------
    size : width and height [px]
    fps : nominal number of frames per second
    """

    size: tuple[int, int]
    fps: float

    def frames(self) -> Generator[LiveFrame]:
        """Yield the frames as they arrive, until the source ends."""
        ...

    def add_to(self, film: Any) -> Any:
        """Add a stream for this source's packets to a film that PyAV has opened for writing."""
        ...

    def close(self) -> None:
        """Close the source; nothing can be added to a film after that."""
        ...


def open_feed(source: str) -> Feed:
    """Open a camera or a stream.

    Parameters
    ----------
    source : number of a camera on this computer, or address of a stream

    Raises
    ------
    InputError : nothing can be read there
    """
    if not source.isdecimal():
        return Stream(source)
    if len(source) > 3:
        raise InputError("expected a camera index from 0 to 999", source=f"camera {source[:20]}")
    return Webcam(int(source))


class Stream:
    """A stream at an address: rtsp, http, udp, ..."""

    def __init__(self, address: str) -> None:
        self._address = address
        self._film: Any = self._open({})
        if self._film.format.name in CLOCKLESS_FORMATS:
            self._film.close()
            self._film = self._open({"use_wallclock_as_timestamps": "1"})
        self._video = self._film.streams.video[0]
        self._video.codec_context.thread_count = 1
        self.size = (self._video.width, self._video.height)
        self.fps = float(self._video.guessed_rate or DEFAULT_FPS)

    def _open(self, options: dict[str, str]) -> Any:
        try:
            film = av.open(
                self._address,
                timeout=(tuning.OPEN_TIMEOUT, tuning.READ_TIMEOUT),
                # A film on the disk is allowed, but no file that it names.
                options={
                    "rtsp_transport": "tcp",
                    **(A_FILE if _is_file(self._address) else {}),
                    **options,
                },
            )
        except FFmpegError as error:
            raise InputError(
                "sends no picture; expected the address of a running stream", source=self._address
            ) from error
        videos = film.streams.video
        codec: Any = videos[0].codec_context if videos else None  # None too where it is unknown
        if codec is None or not codec.width:
            film.close()
            raise InputError(
                "sends no decodable picture; expected a video stream", source=self._address
            )
        if codec.width * codec.height > limits.MAX_FRAME_PIXELS:
            film.close()
            raise InputError(
                f"sends pictures of {codec.width} × {codec.height} pixels; "
                f"expected at most {limits.MAX_FRAME_PIXELS // 10**6} million",
                source=self._address,
            )
        codec.options = {"max_pixels": str(limits.MAX_FRAME_PIXELS * 5 // 4)}
        return film

    def frames(self) -> Generator[LiveFrame]:
        begin: int | None = None
        last = -np.inf
        unseen: list[Packet] = []
        with suppress(FFmpegError):  # an interrupted stream keeps its frames
            for packet in self._film.demux(self._video):
                shown = timestamp_of(packet)
                if packet.dts is not None and shown is not None:
                    if begin is None and packet.is_keyframe:
                        begin = shown
                    if begin is None:
                        continue  # changes to a missing picture
                    unseen.append(_coded(packet, shown, begin))
                for frame in _decoded(packet):
                    shown = timestamp_of(frame)
                    if begin is None or shown is None:
                        continue
                    t = float((shown - begin) * packet.time_base)
                    if t > last:
                        last = t
                        yield LiveFrame(
                            t=t,
                            grey=brightness_of(frame),
                            picture=partial(frame.to_ndarray, format="bgr24"),
                            packets=tuple(unseen),
                        )
                        unseen.clear()

    def add_to(self, film: Any) -> Any:
        return film.add_stream_from_template(self._video)

    def close(self) -> None:
        self._film.close()


def _is_file(address: str) -> bool:
    return address.lower().startswith("file:")


def _coded(packet: Any, shown: int, begin: int) -> Packet:
    return Packet(
        data=bytes(packet),
        pts=shown - begin,
        dts=packet.dts - begin,
        unit=packet.time_base,
        key=packet.is_keyframe,
    )


def _decoded(packet: Any) -> list[Any]:
    try:
        return list(packet.decode())
    except FFmpegError:
        return []  # damaged on its way


class Webcam:
    """A camera of this computer.

    Its frames have the times that its driver gives them, or else those of their arrival. A separate
    thread takes them, so that encoding one frame does not delay the time of the next.

    Parameters
    ----------
    number : 0 is the first camera
    """

    def __init__(self, number: int) -> None:
        self._capture = cv2.VideoCapture(number)
        seen = [self._take(), self._take()]
        if None in seen:
            self._capture.release()
            raise InputError(
                "sends no picture; expected a connected camera that no other program uses",
                source=f"camera {number}",
            )
        (first, frame), (second, _) = ((k[1], k[2]) for k in seen if k is not None)
        self._stamped = second > first > 0
        self.size = (frame.shape[1], frame.shape[0])
        fps = self._capture.get(cv2.CAP_PROP_FPS)
        self.fps = float(fps) if np.isfinite(fps) and 1 <= fps <= 1000 else DEFAULT_FPS

    def _take(self) -> tuple[float, float, Image] | None:
        """Take a frame: times of arrival and from its driver [s], and the frame; None if absent."""
        ok, frame = self._capture.read()
        if not ok:
            return None
        stamp = self._capture.get(cv2.CAP_PROP_POS_MSEC) / 1000
        return time.monotonic(), stamp, np.asarray(frame, dtype=np.uint8)

    def frames(self) -> Generator[LiveFrame]:
        waiting: Queue[tuple[float, float, Image] | None] = Queue(tuning.MAX_QUEUED_FRAMES)
        ended = Event()

        def take_all() -> None:
            while not ended.is_set():
                taken = self._take()
                waiting.put(taken)
                if taken is None:
                    return

        coder: Any = av.CodecContext.create("mpeg4", "w")
        self._set(coder)
        coder.flags |= Flags.global_header
        thread = Thread(target=take_all, daemon=True)
        thread.start()
        begin, tick = None, -1
        try:
            while (taken := waiting.get()) is not None:
                arrived, stamp, picture = taken
                t = stamp if self._stamped else arrived
                begin = t if begin is None else begin
                tick = max(tick + 1, round((t - begin) / MPEG4_TICK))
                planes = np.asarray(cv2.cvtColor(picture, cv2.COLOR_BGR2YUV_I420), dtype=np.uint8)
                frame = av.VideoFrame.from_ndarray(planes, format="yuv420p")
                frame.pts, frame.time_base = tick, MPEG4_TICK
                packets = coder.encode(frame)
                yield LiveFrame(
                    t=float(tick * MPEG4_TICK),
                    grey=planes[: self.size[1]],
                    picture=partial(np.asarray, picture),
                    packets=tuple(_coded(packet, packet.pts, 0) for packet in packets),
                )
        finally:
            ended.set()
            with suppress(Empty):  # so that the thread does not wait before a full queue
                waiting.get_nowait()
            thread.join()

    def add_to(self, film: Any) -> Any:
        stream = film.add_stream("mpeg4", rate=round(self.fps))
        self._set(stream.codec_context)
        return stream

    def close(self) -> None:
        self._capture.release()

    def _set(self, coder: Any) -> None:
        """Set the encoder; every film needs the same settings, because its header states them."""
        coder.width, coder.height = self.size
        coder.pix_fmt, coder.time_base, coder.framerate = "yuv420p", MPEG4_TICK, round(self.fps)
        coder.bit_rate, coder.options = 80_000_000, FINEST_MPEG4
