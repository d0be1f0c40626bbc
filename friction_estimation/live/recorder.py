"""Division of a stream into films, each from the first motion on the ice until all is still."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import av
import numpy as np

from curling_env.infrastructure.files.writing import atomic_path
from friction_estimation.live import tuning
from friction_estimation.live.feed import Feed, LiveFrame, Packet
from friction_estimation.tracking.films.motion_detector import MotionDetector


@dataclass(frozen=True, kw_only=True)
class Clip:
    """One recorded film.

    Parameters
    ----------
    path : path of the film
    clock : when its first frame was taken, since the stream began [s]
    frames : number of its frames
    missing : number of frames that never came, according to the times of the others
    """

    path: Path
    clock: float
    frames: int
    missing: int


@dataclass(eq=False, kw_only=True)
class Recorder:
    """Keeps the packets of a stream until a throw is over, and then writes them as a film.

    Parameters
    ----------
    feed : the source of the frames that are added
    motion : detects what moves on the ice in them
    folder : folder for the films
    count : number of the next film, or of the next that is free in the folder
    """

    feed: Feed
    motion: MotionDetector
    folder: Path
    count: int = 0
    _kept: list[Packet] = field(default_factory=list)
    _last_motion: float = -np.inf

    def add(self, frame: LiveFrame) -> Clip | None:
        """Add the next frame; return the film that ends with it, if any."""
        if self.motion.detects(frame.t, frame.grey):
            self._last_motion = frame.t
        self._kept += frame.packets
        if self._last_motion == -np.inf:
            self._forget_before(frame.t - tuning.LEAD_IN_SECONDS)
            return None
        quiet = frame.t - self._last_motion > tuning.QUIET_SECONDS
        long = frame.t - self._kept[0].t > tuning.MAX_FILM_SECONDS
        return self.finish() if quiet or long else None

    def finish(self) -> Clip | None:
        """End the film that is being recorded; None if nothing has moved in it."""
        if self._last_motion == -np.inf:
            return None
        first = self._kept[0]
        # A packet after the key frame may hold a frame shown before it, which cannot be decoded.
        packets = [packet for packet in self._kept if packet.pts >= first.pts]
        path = self._next_path()
        with atomic_path(path) as draft:
            _write(draft, self.feed, packets)
        self.count += 1
        steps = np.diff(np.sort([packet.t for packet in packets]))
        usual = float(np.median(steps)) if steps.size else 1.0
        # The next film may begin within the end of this one, at its last key frame.
        self._forget_before(np.inf)
        self._last_motion = -np.inf
        return Clip(
            path=path,
            clock=first.t,
            frames=len(packets),
            missing=int(np.sum(np.maximum(np.rint(steps / usual) - 1, 0))),
        )

    def _next_path(self) -> Path:
        """Return the next unused name: films of an earlier evening must not be overwritten."""
        path = self.folder / f"throw-{self.count:03d}.mp4"
        while path.exists() or path.is_symlink():
            self.count += 1
            path = self.folder / f"throw-{self.count:03d}.mp4"
        return path

    def _forget_before(self, t: float) -> None:
        """Drop the packets that a film beginning at a time [s] does not need."""
        keys = [k for k, packet in enumerate(self._kept) if packet.key and packet.t <= t]
        del self._kept[: keys[-1] if keys else 0]


def _write(path: Path, feed: Feed, packets: Sequence[Packet]) -> None:
    """Write packets as a film whose time begins with the first one."""
    begin = packets[0].pts
    with av.open(str(path), "w", format="mp4") as film:
        stream = feed.add_to(film)
        for packet in packets:
            out = av.Packet(packet.data)
            out.pts, out.dts = packet.pts - begin, packet.dts - begin
            out.time_base, out.is_keyframe = packet.unit, packet.key
            out.stream = stream
            film.mux(out)
