"""A stream followed throw by throw: recorded in this process, tracked in another one."""

from __future__ import annotations

import signal
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Future, ProcessPoolExecutor
from contextlib import closing, suppress
from dataclasses import dataclass, replace
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import cv2

from curling_env.errors import CurlingError, TrackTooShortError
from curling_env.infrastructure.files.writing import keep
from curling_env.infrastructure.provenance import provenance
from curling_env.infrastructure.workers import begin_worker
from curling_env.trajectory import Trajectory
from curling_env.typing import Image
from curling_env.units import Units
from friction_estimation.camera.pose import camera_from_scene
from friction_estimation.camera.scene import Scene
from friction_estimation.estimation.whole_ice import estimate_ice
from friction_estimation.live.feed import Feed
from friction_estimation.live.recorder import Clip, Recorder
from friction_estimation.reports.estimate_page import Still, write_report
from friction_estimation.reports.throws_section import throw_in_words
from friction_estimation.tracking import TrackedFilm, Tracker, track_each, track_film
from friction_estimation.tracking.films.motion_detector import MotionDetector
from friction_estimation.tracking.overlay.film import draw_stills
from friction_estimation.tracking.stone_numbers import StoneNumbers
from friction_estimation.tracks.throw_table import throw_table


@dataclass(frozen=True, kw_only=True)
class TrackedClip:
    """The throws of a recorded film, or the reason why it has none.

    Parameters
    ----------
    clip : the film; it holds several throws where the ice was never quiet between them
    tracks : the thrown stone's track, then those of other stones; empty where none was thrown
    reason : why there are no tracks
    """

    clip: Clip
    tracks: tuple[Trajectory, ...] = ()
    reason: str = ""

    def in_words(self, units: Units = Units.METRES) -> str:
        """Describe the throw: its number, its measures, and the number of other stones."""
        if not self.tracks:
            return self.reason
        stone, *others = self.tracks
        also = f", and {len(others)} other stones" if others else ""
        words = [throw_in_words(one, units) for one in throw_table(self.tracks)]
        if words and words[0]:
            return f"throw {stone.throw}, {words[0]}{also}"
        x, y = stone.xy[-1]
        seen = f"{len(stone)} rows, last seen at x {x:+.2f}, y {y:+.2f} m"
        return f"throw {stone.throw}, {seen}{also}"


@dataclass(frozen=True, kw_only=True)
class IceSoFar:
    """Estimate of the ice from all throws to date.

    Parameters
    ----------
    throws : their number
    words : the friction in a phrase, or why it is not known yet
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
    reload_seconds: float = 10.0,
    units: Units = Units.METRES,
    tracker: Tracker = track_film,
    on_frame: Callable[[int], object] = lambda waiting: None,
) -> Iterator[TrackedClip | IceSoFar]:
    """Record and track a stream, throw by throw, until it ends or enough throws were seen.

    A keyboard interrupt ends the recording; what was recorded until then is still tracked.

    Parameters
    ----------
    feed : the open source, see `open_feed`; it is closed at the end
    scene : the camera's view of the sheet
    folder : folder that keeps the films
    throws : number of throws to wait for; None waits as long as the stream lasts
    report : an existing folder for a page that shows the current ice; with None there is no page,
        and only one number is estimated for the ice
    reload_seconds : time after which a browser loads that page again [s]
    units : units of lengths on the page
    tracker : finds the stones in each film; another process must be able to import it
    on_frame : called after every frame with the number of films that wait to be tracked

    Yields
    ------
    Every film that ended, in order, as soon as it is tracked, and what is known of the ice then

    Raises
    ------
    InputError : points of the scene that do not fit the picture
    """
    motion = MotionDetector.for_camera(camera_from_scene(scene, feed.size), scene)
    recorder = Recorder(feed=feed, motion=motion, folder=folder)
    # A fresh process, because a forked one would share the camera.
    context = get_context("spawn")
    with ProcessPoolExecutor(1, mp_context=context, initializer=_begin) as process:
        analysis = _Analysis(process, scene, report, reload_seconds, units, tracker)
        with closing(feed):
            with closing(feed.frames()) as frames, suppress(KeyboardInterrupt):
                for frame in frames:
                    analysis.submit(recorder.add(frame))
                    yield from analysis.finished()
                    if throws is not None and analysis.throws >= throws:
                        break
                    on_frame(analysis.waiting)
            if throws is None or analysis.throws < throws:
                analysis.submit(recorder.finish())
        yield from analysis.remaining()


@dataclass(frozen=True, kw_only=True)
class _Result:
    """Result of tracking a film: its throws, and pictures of the last one for the page."""

    throws: tuple[TrackedFilm, ...]
    stills: tuple[Still, ...]


class _Analysis:
    """Films that are tracked, and the ice that is estimated, one after the other in a process."""

    def __init__(
        self,
        process: ProcessPoolExecutor,
        scene: Scene,
        report: Path | None,
        reload_seconds: float,
        units: Units,
        tracker: Tracker,
    ) -> None:
        self._process, self._scene, self._report = process, scene, report
        self._reload_seconds, self._units, self._tracker = reload_seconds, units, tracker
        self._films: deque[tuple[Clip, Future[_Result]]] = deque()
        self._tracks: list[Trajectory] = []
        self._stills: tuple[Still, ...] = ()
        self._estimate: Future[IceSoFar] | None = None
        self._throws_estimated = 0
        self._stones = StoneNumbers()
        self.throws = 0

    @property
    def waiting(self) -> int:
        """Number of films that are not tracked yet."""
        return len(self._films)

    def submit(self, clip: Clip | None) -> None:
        """Have a film tracked, if there is one."""
        if clip is not None:
            keep(
                f"what was recorded is kept in {clip.path.parent}; `curling track "
                f"{clip.path.parent} --scene SCENE.json` tracks it"
            )
            with_stills = self._report is not None
            pending = self._process.submit(
                _track, clip.path, self._scene, self._tracker, with_stills
            )
            self._films.append((clip, pending))

    def finished(self) -> Iterator[TrackedClip | IceSoFar]:
        """Yield the results finished since the last call."""
        while self._films and self._films[0][1].done():
            yield from self._next_clip()
        if self._estimate is not None and self._estimate.done():
            yield self._estimate.result()
            self._estimate = None
        if self._estimate is None and self._throws_estimated < self.throws:
            self._estimate = self._estimate_ice(self._reload_seconds)

    def remaining(self) -> Iterator[TrackedClip | IceSoFar]:
        """Wait for all unfinished films; the page is then written without reloading itself."""
        while self._films:
            yield from self._next_clip()
        if self._estimate is not None:
            yield self._estimate.result()
        news = self._throws_estimated < self.throws
        if news or (self.throws and self._report is not None):
            ice = self._estimate_ice(None).result()
            if news:
                yield ice

    def _next_clip(self) -> Iterator[TrackedClip]:
        clip, pending = self._films.popleft()
        try:
            result = pending.result()
        except CurlingError as error:
            yield TrackedClip(clip=clip, reason=str(error))
            return
        self._stills = result.stills
        for one in result.throws:
            stones = self._stones.of(one.tracks, one.handles)
            tracks = tuple(
                replace(track, throw=self.throws, stone=n, clock=round(clip.clock + track.clock, 3))
                for track, n in zip(one.tracks, stones, strict=True)
            )
            self.throws += 1
            self._tracks += tracks
            yield TrackedClip(clip=clip, tracks=tracks)

    def _estimate_ice(self, reload_seconds: float | None) -> Future[IceSoFar]:
        self._throws_estimated = self.throws
        return self._process.submit(
            _estimate,
            self.throws,
            self._tracks,
            self._stills,
            self._report,
            reload_seconds,
            self._units,
            provenance(),
        )


def _begin() -> None:
    begin_worker()
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def _track(path: Path, scene: Scene, tracker: Tracker, with_stills: bool) -> _Result:
    cv2.setNumThreads(1)
    throws = list(track_each([path], scene, tracker=tracker))
    last = throws[-1]
    shown: list[tuple[float, Image]] = []
    if with_stills and last.found is not None:
        shown = draw_stills(last.shown or path, scene, last.found)
    return _Result(
        throws=tuple(replace(one, found=None) for one in throws),
        stills=tuple(Still.of(path.name, t, image) for t, image in shown),
    )


def _estimate(
    throws: int,
    tracks: Sequence[Trajectory],
    stills: Sequence[Still],
    report: Path | None,
    reload_seconds: float | None,
    units: Units,
    origin: Mapping[str, Any],
) -> IceSoFar:
    try:
        found = estimate_ice(tracks, uniform=report is None)
    except CurlingError as error:
        too_short = isinstance(error, TrackTooShortError)
        words = "the throws are too short to show it yet" if too_short else str(error)
        return IceSoFar(throws=throws, words=words)
    if report is not None:
        write_report(found, report, stills, reload=reload_seconds, provenance=origin, units=units)
    low, high = found.interval
    return IceSoFar(
        throws=throws,
        words=f"μ = {found.mu:.5f} ± {50 * (high - low) / found.mu:.2g} % "
        f"from {found.throws} throws",
    )
