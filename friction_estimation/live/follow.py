"""A stream followed throw by throw: recorded here, tracked and read in a process beside."""

from __future__ import annotations

import signal
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ProcessPoolExecutor
from contextlib import closing, suppress
from dataclasses import dataclass, replace
from multiprocessing import get_context
from pathlib import Path

import cv2

from curling_env.errors import CurlingError, TrackTooShortError
from curling_env.trajectory import Trajectory
from friction_estimation.camera.pose import camera_from_scene
from friction_estimation.camera.scene import Scene
from friction_estimation.inversion import estimate_ice
from friction_estimation.live.feed import Feed
from friction_estimation.live.motion import MotionDetector
from friction_estimation.live.recorder import Clip, Recorder
from friction_estimation.reports.estimate_page import Still, write_report
from friction_estimation.tracking import Tracker, track_film, track_films
from friction_estimation.tracking.overlay import draw_stills

RELOADED = 10.0
"""A page of ice that is still being measured is loaded again after this time [s]."""


@dataclass(frozen=True, kw_only=True)
class TrackedClip:
    """What became of one recorded film.

    Parameters
    ----------
    clip : the film
    tracks : of the stone that was thrown in it, and of those that it met; none where none was
    reason : why there is none
    """

    clip: Clip
    tracks: tuple[Trajectory, ...] = ()
    reason: str = ""


@dataclass(frozen=True, kw_only=True)
class IceSoFar:
    """What all throws so far say of the ice.

    Parameters
    ----------
    throws : how many that were
    words : a phrase
    """

    throws: int
    words: str


def follow_stream(
    feed: Feed,
    scene: Scene,
    folder: Path,
    *,
    throws: int | None = None,
    report: Path | None = None,
    tracker: Tracker = track_film,
    on_frame: Callable[[int], object] = lambda waiting: None,
) -> Iterator[TrackedClip | IceSoFar]:
    """Measurements and track a stream, throw by throw, until it ends or enough was seen.

    A keyboard interrupt ends the recording; what was recorded until then is still tracked.

    Parameters
    ----------
    feed : see `open_feed`; closed at the end
    scene : of the camera
    folder : keeps the films
    throws : how many to wait for; None: as long as the stream lasts
    report : a folder that exists, for the page of the ice so far; None: one number for the ice,
        and no page
    tracker : finds the stones in each film; it must be importable by another process
    on_frame : told after every frame how many films wait to be tracked

    Yields
    ------
    every film that ended, in order, as soon as it is tracked, and what its throw adds to the ice

    Raises
    ------
    InputError : points that do not fit the picture
    """
    motion = MotionDetector.for_camera(camera_from_scene(scene, feed.size), scene)
    recorder = Recorder(feed=feed, motion=motion, folder=folder)
    # A fresh process: one that was forked would share the camera.
    context = get_context("spawn")
    with ProcessPoolExecutor(1, mp_context=context, initializer=_leave_interrupts) as beside:
        work = _Work(beside, scene, report, tracker)
        with closing(feed):
            with closing(feed.frames()) as moments, suppress(KeyboardInterrupt):
                for moment in moments:
                    work.track(recorder.add(moment))
                    yield from work.done()
                    if throws is not None and work.throws >= throws:
                        break
                    on_frame(work.waiting)
            if throws is None or work.throws < throws:
                work.track(recorder.finish())
        yield from work.rest()


@dataclass(frozen=True, kw_only=True)
class _TrackedFilm:
    """A film that was tracked."""

    tracks: tuple[Trajectory, ...]
    stills: tuple[Still, ...]


class _Work:
    """What is done beside the recording, one thing after the other."""

    def __init__(
        self, beside: ProcessPoolExecutor, scene: Scene, report: Path | None, tracker: Tracker
    ) -> None:
        self._beside, self._scene, self._report = beside, scene, report
        self._tracker = tracker
        self._films: deque[tuple[Clip, Future[_TrackedFilm]]] = deque()
        self._tracks: list[Trajectory] = []
        self._stills: tuple[Still, ...] = ()
        self._telling: Future[IceSoFar] | None = None
        self._asked = 0
        self.throws = 0

    @property
    def waiting(self) -> int:
        """How many films have not been tracked."""
        return len(self._films)

    def track(self, clip: Clip | None) -> None:
        if clip is not None:
            pending = self._beside.submit(
                _track, clip.path, self._scene, self._tracker, self._report is not None
            )
            self._films.append((clip, pending))

    def done(self) -> Iterator[TrackedClip | IceSoFar]:
        """What has been finished since."""
        while self._films and self._films[0][1].done():
            yield self._seen()
        if self._telling is not None and self._telling.done():
            yield self._telling.result()
            self._telling = None
        if self._telling is None and self._asked < self.throws:
            self._telling = self._ask(RELOADED)

    def rest(self) -> Iterator[TrackedClip | IceSoFar]:
        """All that is still to be finished; then the page is as it stays."""
        while self._films:
            yield self._seen()
        if self._telling is not None:
            yield self._telling.result()
        news = self._asked < self.throws
        if news or (self.throws and self._report is not None):
            told = self._ask(None).result()
            if news:
                yield told

    def _seen(self) -> TrackedClip:
        clip, pending = self._films.popleft()
        try:
            watched = pending.result()
        except CurlingError as error:
            return TrackedClip(clip=clip, reason=str(error))
        tracks = tuple(
            replace(track, throw=self.throws, clock=round(clip.clock, 3))
            for track in watched.tracks
        )
        self.throws += 1
        self._tracks += tracks
        self._stills = watched.stills
        return TrackedClip(clip=clip, tracks=tracks)

    def _ask(self, reload: float | None) -> Future[IceSoFar]:
        self._asked = self.throws
        return self._beside.submit(
            _estimate, self.throws, self._tracks, self._stills, self._report, reload
        )


def _leave_interrupts() -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def _track(path: Path, scene: Scene, tracker: Tracker, with_stills: bool) -> _TrackedFilm:
    cv2.setNumThreads(1)
    (tracked,) = track_films([path], scene, tracker=tracker)
    found = tracked.found if with_stills else None
    shown = [] if found is None else draw_stills(path, scene, found)
    return _TrackedFilm(
        tracks=tracked.tracks,
        stills=tuple(Still.of(path.name, t, image) for t, image in shown),
    )


def _estimate(
    throws: int,
    tracks: Sequence[Trajectory],
    shown: Sequence[Still],
    report: Path | None,
    reload: float | None,
) -> IceSoFar:
    try:
        found = estimate_ice(tracks, uniform=report is None)
    except CurlingError as error:
        too_short = isinstance(error, TrackTooShortError)
        return IceSoFar(
            throws=throws, words="too short to tell of the ice" if too_short else str(error)
        )
    if report is not None:
        write_report(found, report, shown, reload=reload)
    low, high = found.interval
    return IceSoFar(
        throws=throws,
        words=f"μ = {found.mu:.5f} ± {50 * (high - low) / found.mu:.2g} % "
        f"from {len(found.slides)} throws",
    )
