"""Cuts a stream into films, one from quiet to quiet."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import av
import numpy as np

from curling_env.storage import atomic_path
from friction_estimation.live.feed import Feed, LiveFrame, Packet
from friction_estimation.live.motion import MotionDetector

QUIET = 3.0
"""So long must all be still before a throw counts as over [s]."""
LEAD_IN = 2.0
"""Of the quiet before a throw its film keeps this, and more back to a whole picture [s]."""
LONGEST = 120.0
"""A film is ended after this time even when the ice is never quiet [s]."""


@dataclass(frozen=True, kw_only=True)
class Clip:
    """One recorded film.

    Parameters
    ----------
    path : of the film
    clock : when its first frame was taken, since the stream began [s]
    frames : how many it has
    missing : how many more there should be, as the times of these tell
    """

    path: Path
    clock: float
    frames: int
    missing: int


@dataclass(eq=False, kw_only=True)
class Recorder:
    """Keeps what comes until a throw is over, and writes it as a film then.

    Parameters
    ----------
    feed : whose moments it is given
    motion : on the ice in front of it
    folder : for the films
    """

    feed: Feed
    motion: MotionDetector
    folder: Path
    count: int = 0
    _kept: list[Packet] = field(default_factory=list)
    _moved: float = -np.inf

    def add(self, moment: LiveFrame) -> Clip | None:
        """Keep one moment; the film that ends with it, if one does."""
        if self.motion.detects(moment.t, moment.grey):
            self._moved = moment.t
        self._kept += moment.coded
        if self._moved == -np.inf:
            self._forget_until(moment.t - LEAD_IN)
            return None
        quiet, long = moment.t - self._moved, moment.t - self._kept[0].t
        return self.finish() if quiet > QUIET or long > LONGEST else None

    def finish(self) -> Clip | None:
        """End the film that is being recorded; None where nothing has moved in it."""
        if self._moved == -np.inf:
            return None
        first = self._kept[0]
        # What a whole picture precedes may show before it, as changes to one that is not there.
        pieces = [piece for piece in self._kept if piece.pts >= first.pts]
        path = self.folder / f"throw-{self.count:03d}.mp4"
        with atomic_path(path) as draft:
            _write(draft, self.feed, pieces)
        self.count += 1
        steps = np.diff(np.sort([piece.t for piece in pieces]))
        usual = float(np.median(steps)) if steps.size else 1.0
        # The next film may begin with the end of this one, where there is a whole picture.
        self._forget_until(np.inf)
        self._moved = -np.inf
        return Clip(
            path=path,
            clock=first.t,
            frames=len(pieces),
            missing=int(np.sum(np.maximum(np.rint(steps / usual) - 1, 0))),
        )

    def _forget_until(self, t: float) -> None:
        """Let go what a film that begins at a time [s] does not need."""
        whole = [k for k, piece in enumerate(self._kept) if piece.whole and piece.t <= t]
        del self._kept[: whole[-1] if whole else 0]


def _write(path: Path, feed: Feed, pieces: Sequence[Packet]) -> None:
    """A film of what came, with its own times from the first piece on."""
    begin = pieces[0].pts
    with av.open(str(path), "w", format="mp4") as film:
        stream = feed.add_to(film)
        for piece in pieces:
            packet = av.Packet(piece.data)
            packet.pts, packet.dts = piece.pts - begin, piece.dts - begin
            packet.time_base, packet.is_keyframe = piece.unit, piece.whole
            packet.stream = stream
            film.mux(packet)
