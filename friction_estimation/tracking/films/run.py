"""Films to tracks, throw by throw, with what an interrupted call has already tracked."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, TypeAlias

from curling_env.errors import InputError, NoThrowError
from curling_env.infrastructure.files.storage import ordinary_file
from curling_env.trajectory import Trajectory
from curling_env.typing import Progress, no_progress
from friction_estimation.camera.refinement import RefinedCamera
from friction_estimation.camera.scene import Scene, load_scene
from friction_estimation.film.video import Film
from friction_estimation.tracking.cutting.pace import slides_freely, stops_before_its_hog_line
from friction_estimation.tracking.cutting.pieces import Piece, cut, is_short, minutes
from friction_estimation.tracking.cutting.throws import shows_several
from friction_estimation.tracking.films.film_track import FilmTrack, TrackingOptions
from friction_estimation.tracking.films.resume import Checkpoints, digest
from friction_estimation.tracking.films.shared_cameras import SharedCameras, camera_document
from friction_estimation.tracking.pipeline import track_film
from friction_estimation.tracking.stone_numbers import StoneNumbers, handle_code
from friction_estimation.tracking.tracker import Tracker, load_tracker, tracks_in


@dataclass(frozen=True, kw_only=True, eq=False)
class TrackedFilm:
    """What tracking one throw gave.

    Parameters
    ----------
    film : its path
    tracks : the thrown stone's track, then those of the other stones
    summary : frames, rows, times and contacts, for JSON
    found : everything that the built-in tracker found; None for a tracker that returns tracks
        alone, and for a resumed film
    resumed : whether an earlier, interrupted call had tracked the film
    shown : the film, or the part of it that shows this throw; None for a resumed film
    scene : its camera's view of the sheet
    """

    film: Path
    tracks: tuple[Trajectory, ...]
    summary: dict[str, Any]
    found: FilmTrack | None = None
    resumed: bool = False
    shown: Film | Path | None = None
    scene: Scene | None = None

    @property
    def thrown(self) -> Trajectory:
        """The thrown stone's track."""
        return self.tracks[0]

    @property
    def name(self) -> str:
        """The film, and where in a longer one the throw is."""
        at = self.summary.get("clock")
        return self.film.name if at is None else f"{self.film.name} at {minutes(at)}"

    @property
    def handles(self) -> list[str | None]:
        """Colour of the handle of each stone, see `handle_code`; None where it is not known."""
        seen: list[dict[str, Any]] = [self.summary, *self.summary.get("others", [])]
        codes = [about.get("handle") for about in seen]
        return [*codes, *[None] * len(self.tracks)][: len(self.tracks)]


SceneLike: TypeAlias = Scene | str | Path
"""A scene, or the path of a scene file."""


def track_films(
    films: Sequence[str | Path],
    scenes: SceneLike | Sequence[SceneLike],
    *,
    tracker: Tracker | None = None,
    resume_beside: str | Path | None = None,
    progress: Progress = no_progress,
) -> list[Trajectory]:
    """Track films, of one throw each or of many.

    Parameters
    ----------
    films : paths, in order of play
    scenes : one for all films, or one for each; scenes or paths of scene files
    tracker : finds the stones in a film; by default the built-in one, `track_film`
    resume_beside : path of a file; the tracks of each film are kept in a folder beside it until all
        films are tracked, so that an interrupted call goes on there. None: nothing is kept
    progress : called with the number of frames done in a film and the expected number of all

    Returns
    -------
    The tracks of all stones in all throws, numbered by throw from 0; the thrown stone comes first.
    Stones are numbered in order of play, and told apart by the colours of their handles.

    Raises
    ------
    InputError : see `track_each` and `load_scene`
    """
    given = [scenes] if isinstance(scenes, Scene | str | Path) else scenes
    loaded = [one if isinstance(one, Scene) else load_scene(one) for one in given]
    checkpoints = None if resume_beside is None else Checkpoints(Path(resume_beside))
    tracked = track_each(
        [Path(film) for film in films],
        loaded,
        tracker=tracker,
        checkpoints=checkpoints,
        progress=progress,
    )
    tracks = [track for film in tracked for track in film.tracks]
    if checkpoints is not None:
        checkpoints.delete()
    return tracks


def track_each(
    films: Sequence[Path],
    scenes: Scene | Sequence[Scene],
    *,
    throws: Sequence[int] | None = None,
    tracker: Tracker | None = None,
    checkpoints: Checkpoints | None = None,
    always_track: int = 0,
    cameras: SharedCameras | None = None,
    left_out: Callable[[str], object] | None = None,
    progress: Progress = no_progress,
) -> Iterator[TrackedFilm]:
    """Track films, and yield what is found of each throw as soon as it is known.

    The built-in tracker cuts a film of several throws into these. Another tracker is given whole
    films, as is the built-in one where `throws` numbers them.

    Parameters
    ----------
    films : in order of play
    scenes : one for all films, or one for each
    throws : number of the throw in each film, which then shows one throw each
    tracker : finds the stones in a film; by default the built-in one, `track_film`
    checkpoints : keeps the tracks of each throw until all films are done, so that an interrupted
        call can be repeated; the caller deletes them at the end. None: nothing is kept
    always_track : as many of the first throws are tracked even if checkpoints hold their tracks,
        for callers that need `found`
    cameras : what is known of the cameras of scenes; by default nothing, and each is solved from
        its first films
    left_out : called with what is no throw after all in a film of several, and why; of several
        films also with those that show none. Without it, these are refused

    Raises
    ------
    InputError : a number of scenes that is neither one nor that of the films, or a film that is
        missing, before any is tracked; also what the tracker raises
    """
    scenes = [scenes] if isinstance(scenes, Scene) else list(scenes)
    if len(scenes) not in (1, len(films)):
        raise InputError(
            f"one scene for all films or one for each: {len(films)} films, {len(scenes)} scenes",
            source="--scene",
        )
    scenes *= len(films) // len(scenes)
    tracker = load_tracker() if tracker is None else tracker
    for film in films if _built_in(tracker)[0] is track_film else ():
        ordinary_file(film, "film")
    jobs = list(zip(films, scenes, strict=True))
    found = _track_each(
        jobs,
        tracker,
        throws,
        checkpoints,
        always_track,
        cameras=SharedCameras() if cameras is None else cameras,
        left_out=left_out,
        progress=progress,
    )
    return found if throws is not None else _with_stones(found)


def _track_each(
    films: Sequence[tuple[Path, Scene]],
    tracker: Tracker,
    throws: Sequence[int] | None,
    checkpoints: Checkpoints | None,
    always_track: int,
    *,
    cameras: SharedCameras,
    left_out: Callable[[str], object] | None,
    progress: Progress,
) -> Iterator[TrackedFilm]:
    index = throw = 0
    empty: list[InputError] = []
    whole = len(films) == 1 or left_out is None  # then a film without a throw is refused
    say = left_out or (lambda why: None)
    for k, (film, scene) in enumerate(films):

        def say_of_it(why: str, film: Path = film) -> None:
            say(f"{film.name}, {why}")

        try:
            pieces = [Piece.whole(film)]
            if throws is None:
                pieces = _pieces(film, scene, tracker, say_of_it, progress)
        except NoThrowError as error:
            if whole:
                raise
            empty.append(_alone(error))
            say(f"{film.name}: {error.problem}")
            continue
        known = None
        if cameras_are_shared(tracker):
            like = [other for other, its in films[k + 1 :] if its is scene]
            known = cameras.of(scene, pieces, like, progress)
        refused: list[InputError] = []
        waiting, count = deque(pieces), len(pieces)
        while waiting:
            piece = waiting.popleft()
            number = throw if throws is None else throws[k]
            one = None
            key = ""
            if checkpoints is not None:
                choices = {
                    "scene": asdict(replace(scene, source=None)),
                    "piece": piece.key,
                    "camera": None if known is None else camera_document(known),
                }
                key = digest(film, tracker=_identity(tracker), **choices)
                kept = None if index < always_track else checkpoints.load(index, key)
                if kept is not None:
                    tracks, summary = kept
                    one = TrackedFilm(
                        film=film, tracks=tuple(tracks), summary=summary, resumed=True
                    )
            if one is None:
                as_it_is = throws is not None or count > 1
                try:
                    one = _track(piece, scene, tracker, known, progress)
                    parts = [] if as_it_is else _parts(piece, scene, one.found, say_of_it, progress)
                except InputError as error:
                    parts = [] if as_it_is else _parts(piece, scene, None, say_of_it, progress)
                    if not parts:
                        if count == 1 and (whole or not isinstance(error, NoThrowError)):
                            raise
                        refused.append(_alone(error))
                        where = film.name if count == 1 else f"{film.name}, {piece.name}"
                        say(f"{where}: {error.problem}")
                        continue
                if parts:
                    waiting, count = deque(parts), len(parts)
                    continue
                assert one is not None
                if one.found is not None:
                    cameras.note(scene, one.found)
                if checkpoints is not None and len(films) * count > 1:
                    checkpoints.save(index, key, one.tracks, one.summary)
            yield replace(_numbered(one, number, piece), scene=scene)
            index, throw = index + 1, throw + 1
        if len(refused) == count:
            if whole or not isinstance(refused[0], NoThrowError):
                raise refused[0]
            empty.append(refused[0])
    if len(empty) == len(films):
        raise empty[0]


def _alone(error: InputError) -> InputError:
    """An error without what was being done: the pictures of a throw that is left out."""
    error.__cause__ = error.__context__ = None
    return error.with_traceback(None)


def cameras_are_shared(tracker: Tracker) -> bool:
    """Whether a tracker takes a camera that was solved before, and may correct it."""
    function, options = _built_in(tracker)
    return function is track_film and (options is None or options.refine)


def _built_in(tracker: Tracker) -> tuple[Any, TrackingOptions | None]:
    """A tracker's function, and the options of the built-in one."""
    if isinstance(tracker, partial):
        return tracker.func, tracker.keywords.get("options")
    return tracker, None


def _pieces(
    film: Path,
    scene: Scene,
    tracker: Tracker,
    left_out: Callable[[str], object],
    progress: Progress,
) -> list[Piece]:
    """The throws of a film, or all of it where it shows one throw only."""
    function, options = _built_in(tracker)
    if function is not track_film:
        return [Piece.whole(film)]
    opened = Film.open(film, scene.fps, None if options is None else options.slow)
    return cut(opened, scene, left_out=left_out, progress=progress)


def _parts(
    piece: Piece,
    scene: Scene,
    found: FilmTrack | None,
    left_out: Callable[[str], object],
    progress: Progress,
) -> list[Piece]:
    """The throws of a short film that was tracked as one, if there are several.

    Parameters
    ----------
    found : what was found in it; None where that is no throw
    """
    if piece.begin is not None or not isinstance(piece.film, Film) or not is_short(piece.film):
        return []
    if found is not None and not shows_several(found.sightings):
        return []
    parts = cut(piece.film, scene, look_through=True, left_out=left_out, progress=progress)
    return parts if len(parts) > 1 else []


def _track(
    piece: Piece,
    scene: Scene,
    tracker: Tracker,
    camera: RefinedCamera | None,
    progress: Progress,
) -> TrackedFilm:
    # Only the built-in tracker is given parts of films, and cameras.
    given: dict[str, Any] = {} if camera is None else {"camera": camera}
    found = tracker(piece.film, scene, progress=progress, **given)  # pyright: ignore[reportArgumentType]
    tracks = tracks_in(found, piece.path)
    about = found if isinstance(found, FilmTrack) else None
    if piece.begin is not None and not slides_freely(tracks[0]):
        raise NoThrowError(
            "what moves there keeps its pace, as a stone does that is carried or pushed",
            source=piece.path,
        )
    if piece.begin is not None and stops_before_its_hog_line(tracks[0]):
        raise NoThrowError(
            "what moves there stops before the hog line of its own end, as no thrown stone does",
            source=piece.path,
        )
    return TrackedFilm(
        film=piece.path,
        tracks=tracks,
        summary=_summary(about or tracks[0]),
        found=about,
        shown=piece.film,
    )


def _numbered(one: TrackedFilm, throw: int, piece: Piece) -> TrackedFilm:
    """With the number of the throw, and the time at which it begins."""
    tracks = tuple(
        replace(track, throw=throw, stone=k, clock=piece.begin or track.clock)
        for k, track in enumerate(one.tracks)
    )
    return replace(one, tracks=tracks, summary={**piece.summary, **one.summary})


def _with_stones(films: Iterable[TrackedFilm]) -> Iterator[TrackedFilm]:
    """With the stones numbered in order of play, and told apart by the colours of their handles."""
    numbers = StoneNumbers()
    for one in films:
        given = numbers.of(one.tracks, one.handles)
        tracks = tuple(replace(k, stone=n) for k, n in zip(one.tracks, given, strict=True))
        summary = {"stone": given[0], **one.summary}
        others: list[dict[str, Any]] = one.summary.get("others", [])
        if others:
            summary["others"] = [
                {**about, "stone": n} for about, n in zip(others, given[1:], strict=True)
            ]
        yield replace(one, tracks=tracks, summary=summary)


def _identity(tracker: Any) -> str:
    """A text that differs for different trackers and for different options of one."""
    if isinstance(tracker, partial):
        return f"{_identity(tracker.func)} {tracker.args!r} {tracker.keywords!r}"
    return f"{getattr(tracker, '__module__', '')}:{getattr(tracker, '__qualname__', tracker)}"


def _summary(found: FilmTrack | Trajectory) -> dict[str, Any]:
    thrown = found.trajectory if isinstance(found, FilmTrack) else found
    about: dict[str, Any] = {
        "tracked": len(thrown),
        "from_s": float(thrown.t[0]),
        "to_s": float(thrown.t[-1]),
    }
    if isinstance(found, FilmTrack):
        about = {"frames": found.frame_count, **about, **_handle(found)}
        if found.not_seen:
            about["not_seen"] = found.not_seen
        if found.contacts:
            about["contacts_s"] = [float(t) for t in found.contacts]
        if found.others:
            about["others"] = [_summary_of_other(other) for other in found.others]
    return about


def _summary_of_other(other: FilmTrack) -> dict[str, Any]:
    begin, end = other.trajectory.xy[0], other.trajectory.xy[-1]
    about: dict[str, Any] = {
        "stone": int(other.trajectory.stone),
        **_handle(other),
        "struck": bool(other.contacts),
        "lay": [round(float(value), 4) for value in begin],
    }
    if other.contacts:
        about["rests"] = [round(float(value), 4) for value in end]
    return about


def _handle(found: FilmTrack) -> dict[str, str]:
    """The colour of a stone's handle, where it is seen."""
    code = handle_code(found.handle_colour)
    return {} if code is None else {"handle": code}
