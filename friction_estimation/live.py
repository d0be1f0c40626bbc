"""A camera that is filming now: each throw is recorded as a film of its own, and then tracked.

A throw's path is known best when all of it has been seen, and the ice gives half a minute until
the next. So nothing is tracked in a hurry: while one throw is recorded, the one before goes
through the same `track_film` as any film, in a process beside. A throw begins when something moves
on the ice and ends when all has been still for some seconds; films without a stone that slides
are thrown away.
"""

# OpenCV's stubs widen the element type of every array that they return.
# pyright: reportArgumentType=false, reportCallIssue=false

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ProcessPoolExecutor
from contextlib import closing
from dataclasses import dataclass, field, replace
from multiprocessing import get_context
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from curling_env.errors import CurlingError, InputError
from curling_env.trajectory import Trajectory
from friction_estimation.camera import Camera
from friction_estimation.scene import Scene
from friction_estimation.tracking import track_film
from friction_estimation.tracking.background import sheet_region
from friction_estimation.video import DEFAULT_FPS, FilmWriter, save_times

Image = NDArray[np.uint8]

THINNED_PX = 4
"""Motion is looked for in every so many rows and columns."""
CONTRAST = 18
"""Least change of brightness (of 255) that counts."""
MOVING_SHARE = 4e-4
"""Of the pixels around the sheet, those that must change between two looks: a third of a stone."""
LOOK_EVERY = 0.1
"""Time between two looks [s]: a stone on its last metre still moves by a pixel."""
QUIET = 3.0
"""So long must all be still before a throw counts as over [s]."""
LEAD_IN = 4.0
"""Of the quiet before a throw, what its film keeps at least half of [s]."""
LONGEST = 120.0
"""A film is ended after this time even when the ice is never quiet [s]."""


@dataclass(frozen=True, kw_only=True)
class Clip:
    """One recorded film.

    Parameters
    ----------
    path : of the film, with its frames' times beside it
    clock : when its first frame was taken, since the recording began [s]
    """

    path: Path
    clock: float


@dataclass(eq=False, kw_only=True)
class Recorder:
    """Cuts a stream into films, one from quiet to quiet.

    Parameters
    ----------
    region : rows and columns of the picture in which motion counts
    folder : for the films
    fps : of the stream
    """

    region: tuple[slice, slice]
    folder: Path
    fps: float
    count: int = 0
    _writer: FilmWriter | None = None
    _times: list[float] = field(default_factory=list)
    _before: Image | None = None
    _looked: float = -np.inf
    _moved: float = -np.inf
    _begun: float = 0.0

    def take(self, t: float, frame: Image) -> Clip | None:
        """Record one frame, BGR, taken at t [s]; the film that ends with it, if one does."""
        self._look(t, frame)
        clip = None
        moved = self._moved >= self._begun
        over = moved and (t - self._moved > QUIET or t - self._begun > LONGEST)
        if over:
            clip = self.finish()
        elif not moved and t - self._begun > LEAD_IN:
            self._drop()
        if self._writer is None:
            size = (frame.shape[1], frame.shape[0])
            self._writer = FilmWriter(self._path, size, self.fps)
            self._begun, self._times = t, []
        self._writer.write(frame)
        self._times.append(t)
        return clip

    def finish(self) -> Clip | None:
        """End the film that is being recorded; None where nothing has moved in it."""
        if self._writer is None or self._moved < self._begun:
            self._drop()
            return None
        self._writer.close()
        self._writer = None
        path = self._path
        save_times(path, [t - self._begun for t in self._times])
        self.count += 1
        return Clip(path=path, clock=self._begun)

    @property
    def _path(self) -> Path:
        return self.folder / f"throw-{self.count:03d}.mp4"

    def _drop(self) -> None:
        if self._writer is not None:
            self._writer.close()
            self._writer = None
            self._path.unlink(missing_ok=True)

    def _look(self, t: float, frame: Image) -> None:
        if t - self._looked < LOOK_EVERY:
            return
        self._looked = t
        thinned = cv2.blur(frame[self.region][..., 1], (THINNED_PX, THINNED_PX))
        now = np.ascontiguousarray(thinned[::THINNED_PX, ::THINNED_PX], dtype=np.uint8)
        if self._before is not None:
            changed = np.count_nonzero(cv2.absdiff(now, self._before) > CONTRAST)
            if changed > max(3, MOVING_SHARE * now.size):
                self._moved = t
        self._before = now


def frames_of(source: str) -> tuple[Iterator[tuple[float, Image]], float]:
    """Frames of a camera or stream as they come, with their times [s], and its nominal rate.

    A stream that carries times keeps them; a camera's frames are stamped when they arrive.

    Raises
    ------
    InputError : nothing can be read there
    """
    capture = cv2.VideoCapture(int(source) if source.isdecimal() else source)
    ok, first = capture.read()
    if not ok:
        capture.release()
        what = f"camera {source}" if source.isdecimal() else source
        raise InputError("gives no picture; is it connected, and free?", source=what)
    said = capture.get(cv2.CAP_PROP_FPS)
    fps = float(said) if np.isfinite(said) and 1 <= said <= 1000 else DEFAULT_FPS
    stamped = not source.isdecimal()

    def frames() -> Iterator[tuple[float, Image]]:
        start, last, frame = time.monotonic(), -np.inf, first
        try:
            while True:
                t = time.monotonic() - start
                if stamped and np.isfinite(stamp := capture.get(cv2.CAP_PROP_POS_MSEC)):
                    t = stamp / 1000
                if not t > last:
                    t = last + 1 / fps
                last = t
                yield t, np.asarray(frame, dtype=np.uint8)
                ok, frame = capture.read()
                if not ok:
                    return
        finally:
            capture.release()

    return frames(), fps


@dataclass(frozen=True, kw_only=True)
class Seen:
    """What became of one recorded film.

    Parameters
    ----------
    clip : the film
    track : of the stone that was thrown in it; None where there was none
    reason : why there is none
    """

    clip: Clip
    track: Trajectory | None
    reason: str = ""


def follow(
    frames: Iterator[tuple[float, Image]],
    fps: float,
    scene: Scene,
    folder: Path,
    *,
    throws: int | None = None,
    on_frame: Callable[[float], object] = lambda t: None,
) -> Iterator[Seen]:
    """Record and track a stream, throw by throw, until it ends or enough was seen.

    Parameters
    ----------
    frames, fps : see `frames_of`
    scene : of the camera
    folder : keeps the films
    throws : how many to wait for; None: as long as the stream lasts
    on_frame : told the time [s] of every frame

    Yields
    ------
    every film that ended, in order, as soon as it is tracked

    Raises
    ------
    InputError : points that do not fit the picture
    """
    waiting: list[tuple[Clip, Future[Trajectory]]] = []
    found = 0
    # A fresh process: one that was forked would share the camera.
    context = get_context("spawn")
    with closing(frames), ProcessPoolExecutor(1, mp_context=context) as beside:  # type: ignore[type-var]
        recorder: Recorder | None = None
        for t, frame in frames:
            if recorder is None:
                camera = Camera.from_scene(scene, (frame.shape[1], frame.shape[0]))
                region = sheet_region(camera, scene.sheet)
                recorder = Recorder(region=region, folder=folder, fps=fps)
            on_frame(t)
            clip = recorder.take(t, frame)
            if clip is not None:
                waiting.append((clip, beside.submit(_tracked, clip.path, scene)))
            while waiting and waiting[0][1].done():
                seen = _outcome(*waiting.pop(0), found)
                found += seen.track is not None
                yield seen
                if throws is not None and found >= throws:
                    return
        clip = None if recorder is None else recorder.finish()
        if clip is not None:
            waiting.append((clip, beside.submit(_tracked, clip.path, scene)))
        for pending in waiting:
            seen = _outcome(*pending, found)
            found += seen.track is not None
            yield seen


def _tracked(path: Path, scene: Scene) -> Trajectory:
    cv2.setNumThreads(1)
    return track_film(path, scene).trajectory


def _outcome(clip: Clip, pending: Future[Trajectory], throw: int) -> Seen:
    try:
        track = pending.result()
    except CurlingError as error:
        return Seen(clip=clip, track=None, reason=str(error))
    return Seen(clip=clip, track=replace(track, throw=throw, clock=round(clip.clock, 3)))
