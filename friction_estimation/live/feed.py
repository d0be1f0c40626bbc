"""What a camera or a stream sends: frames to look at, and the same frames coded, to be kept.

A stream's own packets are kept as they came: coding them anew would cost time and blur what is to
be measured (on 1080p from above the sheet, positions then err by 3.2 instead of 1.9 mm). A camera
that sends plain frames is coded at the finest step that MPEG-4 has, which positions do not feel.
"""

from __future__ import annotations

import time
from collections.abc import Generator
from contextlib import suppress
from dataclasses import dataclass
from fractions import Fraction
from queue import Empty, Queue
from threading import Event, Thread
from typing import Any, Protocol

import av
import cv2
import numpy as np
from av.codec.context import Flags
from av.error import FFmpegError

from curling_env.errors import InputError
from curling_env.typing import Image
from friction_estimation.film.frame import brightness_of
from friction_estimation.film.video import DEFAULT_FPS, timestamp_of

PATIENCE = (10.0, 10.0)
"""So long a stream may take to open, and then to send something [s]."""
CLOCKLESS = ("mpjpeg", "mjpeg")
"""Formats of streams that carry no times: their pictures are stamped when they arrive."""
WAITING = 50
"""Frames of a camera that may wait to be coded; beyond these the camera drops its own."""
FINEST = {"qmin": "2", "qmax": "2", "g": "50"}
"""MPEG-4 at its finest step, with a whole picture every 50."""
CAMERA_CLOCK = Fraction(1, 65535)
"""Finest unit of time that MPEG-4 knows [s]."""


@dataclass(frozen=True, kw_only=True)
class Packet:
    """A piece of a coded stream: one frame, most often as changes to others.

    Parameters
    ----------
    data : as it came
    pts, dts : when its frame is shown, and decoded, since the first frame, in units
    unit : of these times [s]
    whole : whether it stands for itself, so that a film can begin with it
    """

    data: bytes
    pts: int
    dts: int
    unit: Fraction
    whole: bool

    @property
    def t(self) -> float:
        """When its frame was taken, since the first one [s]."""
        return float(self.pts * self.unit)


@dataclass(frozen=True, kw_only=True, eq=False)
class LiveFrame:
    """One frame as it came.

    Parameters
    ----------
    t : when it was taken, since the first one [s]
    grey : its brightness, (height, width)
    coded : what came since the last one of the coded stream, as it is stored
    """

    t: float
    grey: Image
    coded: tuple[Packet, ...]


class Feed(Protocol):
    """A source of frames that is open.

    Attributes
    ----------
    size : width and height [px]
    fps : nominal frames per second
    """

    size: tuple[int, int]
    fps: float

    def frames(self) -> Generator[LiveFrame]:
        """Frames as they come, until the source ends."""
        ...

    def add_to(self, film: Any) -> Any:
        """A stream of a film (`av.open(..., "w")`) that takes this source's packets."""
        ...

    def close(self) -> None:
        """Let the source go; nothing can be added to a film after that."""
        ...


def open_feed(source: str) -> Feed:
    """Open a camera, by its number, or a stream, by its address.

    Raises
    ------
    InputError : nothing can be read there
    """
    return Webcam(int(source)) if source.isdecimal() else Stream(source)


class Stream:
    """A stream by its address: rtsp, http, udp, ..."""

    def __init__(self, address: str) -> None:
        self._address = address
        self._film: Any = self._open({})
        if self._film.format.name in CLOCKLESS:
            self._film.close()
            self._film = self._open({"use_wallclock_as_timestamps": "1"})
        self._video = self._film.streams.video[0]
        self._video.codec_context.thread_count = 1
        self.size = (self._video.width, self._video.height)
        self.fps = float(self._video.guessed_rate or DEFAULT_FPS)

    def _open(self, options: dict[str, str]) -> Any:
        try:
            film = av.open(
                self._address, timeout=PATIENCE, options={"rtsp_transport": "tcp", **options}
            )
        except FFmpegError as error:
            raise InputError(
                "gives no picture; is the address right, and does it send?", source=self._address
            ) from error
        if not film.streams.video or not film.streams.video[0].width:
            film.close()
            raise InputError("sends no picture that can be decoded", source=self._address)
        return film

    def frames(self) -> Generator[LiveFrame]:
        begin: int | None = None
        last = -np.inf
        held: list[Packet] = []
        with suppress(FFmpegError):  # It broke off; what came until then stands.
            for packet in self._film.demux(self._video):
                shown = timestamp_of(packet)
                if packet.dts is not None and shown is not None:
                    if begin is None and packet.is_keyframe:
                        begin = shown
                    if begin is None:
                        continue  # Changes to a picture that was never seen.
                    held.append(_coded(packet, shown, begin))
                for frame in _decoded(packet):
                    moment = timestamp_of(frame)
                    if begin is None or moment is None:
                        continue
                    t = float((moment - begin) * packet.time_base)
                    if t > last:
                        last = t
                        yield LiveFrame(t=t, grey=brightness_of(frame), coded=tuple(held))
                        held.clear()

    def add_to(self, film: Any) -> Any:
        return film.add_stream_from_template(self._video)

    def close(self) -> None:
        self._film.close()


def _coded(packet: Any, shown: int, begin: int) -> Packet:
    return Packet(
        data=bytes(packet),
        pts=shown - begin,
        dts=packet.dts - begin,
        unit=packet.time_base,
        whole=packet.is_keyframe,
    )


def _decoded(packet: Any) -> list[Any]:
    try:
        return list(packet.decode())
    except FFmpegError:
        return []  # Damaged on its way.


class Webcam:
    """A camera of this computer by its number; its frames are stamped by its driver if that does.

    They are taken by a thread of its own, so that coding one delays the stamp of none.
    """

    def __init__(self, number: int) -> None:
        self._capture = cv2.VideoCapture(number)
        seen = [self._take(), self._take()]
        if None in seen:
            self._capture.release()
            raise InputError(
                "gives no picture; is it connected, and free?", source=f"camera {number}"
            )
        (first, frame), (second, _) = ((k[1], k[2]) for k in seen if k is not None)
        self._stamped = second > first > 0
        self.size = (frame.shape[1], frame.shape[0])
        said = self._capture.get(cv2.CAP_PROP_FPS)
        self.fps = float(said) if np.isfinite(said) and 1 <= said <= 1000 else DEFAULT_FPS

    def _take(self) -> tuple[float, float, Image] | None:
        """When a frame arrived, when its driver says that it was taken [s], and the frame, BGR."""
        ok, frame = self._capture.read()
        if not ok:
            return None
        stamp = self._capture.get(cv2.CAP_PROP_POS_MSEC) / 1000
        return time.monotonic(), stamp, np.asarray(frame, dtype=np.uint8)

    def frames(self) -> Generator[LiveFrame]:
        waiting: Queue[tuple[float, float, Image] | None] = Queue(WAITING)
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
                tick = max(tick + 1, round((t - begin) / CAMERA_CLOCK))
                planes = np.asarray(cv2.cvtColor(picture, cv2.COLOR_BGR2YUV_I420), dtype=np.uint8)
                frame = av.VideoFrame.from_ndarray(planes, format="yuv420p")
                frame.pts, frame.time_base = tick, CAMERA_CLOCK
                packets = coder.encode(frame)
                yield LiveFrame(
                    t=float(tick * CAMERA_CLOCK),
                    grey=planes[: self.size[1]],
                    coded=tuple(_coded(packet, packet.pts, 0) for packet in packets),
                )
        finally:
            ended.set()
            with suppress(Empty):  # It may stand before a full queue.
                waiting.get_nowait()
            thread.join()

    def add_to(self, film: Any) -> Any:
        stream = film.add_stream("mpeg4", rate=round(self.fps))
        self._set(stream.codec_context)
        return stream

    def close(self) -> None:
        self._capture.release()

    def _set(self, coder: Any) -> None:
        """The same for the coder and for every film, whose head must tell how it was coded."""
        coder.width, coder.height = self.size
        coder.pix_fmt, coder.time_base, coder.framerate = "yuv420p", CAMERA_CLOCK, round(self.fps)
        coder.bit_rate, coder.options = 80_000_000, FINEST
