"""Quick looks at a long film: a few frames of every second; most frames are never decoded."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from av.packet import Packet
from av.video.frame import VideoFrame
from av.video.reformatter import Interpolation
from av.video.stream import VideoStream

from curling_env.typing import Image
from friction_estimation.film.decoding import (
    decoded,
    opened,
    stamp,
    timestamp_of,
    timetable_of,
)
from friction_estimation.film.frame import brightness_of
from friction_estimation.film.video import Film
from friction_estimation.tracking import tuning


@dataclass(frozen=True, kw_only=True, eq=False)
class Look:
    """Frame of a film as stored.

    Parameters
    ----------
    t : when it was taken, since the film began [s]
    stored : the frame as the decoder gives it
    """

    t: float
    stored: VideoFrame

    @property
    def grey(self) -> Image:
        """Its brightness, (height, width)."""
        return np.ascontiguousarray(np.rot90(brightness_of(self.stored), self._turns))

    def picture(self, parts: int) -> Image:
        """Picture with 1/`parts` of the lines and columns, BGR."""
        small = self.stored.reformat(
            width=self.stored.width // parts,
            height=self.stored.height // parts,
            format="bgr24",
            interpolation=Interpolation.AREA,
        )
        picture = np.asarray(small.to_ndarray(), dtype=np.uint8)
        return np.ascontiguousarray(np.rot90(picture, self._turns))

    @property
    def _turns(self) -> int:
        return self.stored.rotation // 90 % 4


def looks(film: Film) -> Iterator[Look]:
    """Yield frames of a film, some in every second.

    These are key frames if there are enough, so that no others are decoded.
    """
    moments, keys, unit = timetable_of(film.path)
    with opened(film.path) as (container, stream):
        tick = float(unit) / film.slow
        begin = moments[film.first] if moments else None
        far_apart = tuning.MAX_KEY_GAP / tick
        codec = stream.codec_context
        codec.skip_frame = "NONREF"
        due, sparse = -np.inf, True

        def wanted(packet: Packet[VideoStream]) -> bool:
            nonlocal due, sparse
            moment = timestamp_of(packet)
            if moment is None or not packet.size:
                return True
            if not packet.is_keyframe:
                return sparse
            after = bisect_right(keys, moment)
            end = keys[after] if after < len(keys) else (moments or (moment,))[-1]
            sparse = end - moment > far_apart
            if sparse or moment * tick >= due:
                due = moment * tick + tuning.LOOK_STEP - 0.5 / film.fps
                return True
            return False

        last = -np.inf
        until = None if begin is None else begin + round(film.duration / tick)
        index = -1
        for frame, damaged in decoded(container, stream, wanted, until):
            index += 1
            if damaged:
                continue
            t = stamp(frame, stream, begin) / film.slow
            if np.isnan(t) or film.fps_given:
                t = index / film.fps
            if t >= last + tuning.LOOK_STEP - 0.5 / film.fps and 0.0 <= t <= film.duration:
                last = t
                yield Look(t=t, stored=frame)


def parts_for(size: tuple[int, int]) -> int:
    """Return the largest reduction of a picture at which stones are still visible."""
    parts = 1
    while min(size) / parts > tuning.FINE_LINES:
        parts *= 2
    return parts
