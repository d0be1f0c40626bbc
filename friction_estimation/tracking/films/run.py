"""From films to tracks, throw by throw, reusing the throws of an interrupted call."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, TypeAlias

from curling_env.errors import InputError, NoThrowError
from curling_env.infrastructure.files.reading import ordinary_file
from curling_env.trajectory import Trajectory
from curling_env.typing import Progress, no_progress
from friction_estimation.camera.refined import RefinedCamera
from friction_estimation.camera.scene import Scene, load_scene
from friction_estimation.film.stabilisation import CameraMovesError
from friction_estimation.film.video import Film
from friction_estimation.tracking.association.recording import moved
from friction_estimation.tracking.built_in import track_film
from friction_estimation.tracking.films.film_track import FilmTrack, TrackingOptions
from friction_estimation.tracking.films.pieces import Piece, cut
from friction_estimation.tracking.films.resume import Checkpoints, digest
from friction_estimation.tracking.films.shared_cameras import SharedCameras, camera_document
from friction_estimation.tracking.films.tracked_film import TrackedFilm, summary_of, with_stones
from friction_estimation.tracking.tracker import Tracker, load_tracker, tracks_in

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
        films are tracked, so that an interrupted call continues. None: nothing is kept
    progress : called with the number of frames done in a film and the expected number of all

    Returns
    -------
    The tracks of all stones in all throws, numbered by throw from 0; the thrown stone comes first.
    Stones are numbered in order of play, and distinguished by the colours of their handles.

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
    tracker: Tracker | None = None,
    checkpoints: Checkpoints | None = None,
    always_track: int = 0,
    cameras: SharedCameras | None = None,
    left_out: Callable[[str], object] | None = None,
    progress: Progress = no_progress,
) -> Iterator[TrackedFilm]:
    """Track films, and yield each throw as soon as it is tracked.

    The built-in tracker cuts a film into its throws; another tracker gets whole films.

    Parameters
    ----------
    films : in order of play
    scenes : one for all films, or one for each
    tracker : finds the stones in a film; by default the built-in one, `track_film`
    checkpoints : keeps the tracks of each throw until all films are done, so that an interrupted
        call can be repeated; the caller deletes them at the end. None: nothing is kept
    always_track : number of first throws that are tracked even if checkpoints hold their tracks,
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
            f"expected one scene for all {len(films)} films or one for each, got {len(scenes)}",
            source="--scene",
        )
    scenes *= len(films) // len(scenes)
    tracker = tracker or load_tracker()
    for film in films if _is_built_in(tracker) else ():
        ordinary_file(film, "film")
    throw_tracker = _ThrowTracker(
        tracker=tracker,
        cameras=SharedCameras() if cameras is None else cameras,
        checkpoints=checkpoints,
        always_track=always_track,
        several_films=len(films) > 1,
        each_shows_one=len(films) == 1 or left_out is None,
        left_out=left_out or (lambda why: None),
        progress=progress,
    )
    return with_stones(throw_tracker.throws_of_all(list(zip(films, scenes, strict=True))))


@dataclass(kw_only=True, eq=False)
class _ThrowTracker:
    """Tracker of the throws of films, numbered in order; see `track_each`.

    Parameters
    ----------
    tracker : only the built-in one takes parts of films, and cameras
    several_films : whether there are several; the throw of a single film is not kept
    each_shows_one : whether a film without a throw is refused; else it is skipped, and reported
    """

    tracker: Tracker
    cameras: SharedCameras
    checkpoints: Checkpoints | None
    always_track: int
    several_films: bool
    each_shows_one: bool
    left_out: Callable[[str], object]
    progress: Progress
    _done: int = 0

    @property
    def _options(self) -> TrackingOptions | None:
        """Options of the built-in tracker; None for another tracker."""
        given: Any = self.tracker
        options = given.keywords.get("options") if isinstance(given, partial) else None
        return (options or TrackingOptions()) if _is_built_in(given) else None

    def throws_of_all(self, films: Sequence[tuple[Path, Scene]]) -> Iterator[TrackedFilm]:
        """Yield the throws of all films, in order."""
        empty: list[InputError] = []
        for k, (film, scene) in enumerate(films):
            like = [other for other, its in films[k + 1 :] if its is scene]
            try:
                why = yield from self._throws_of(film, scene, like)
            except NoThrowError as error:
                if self.each_shows_one:
                    raise
                why = _without_context(error)
                self.left_out(f"{film.name}: {why.problem}")
            if why is None:
                continue
            if self.each_shows_one or not isinstance(why, NoThrowError):
                raise why
            empty.append(why)
        if len(empty) == len(films):
            raise empty[0]

    def _throws_of(
        self, film: Path, scene: Scene, like: Sequence[Path]
    ) -> Generator[TrackedFilm, None, InputError | None]:
        """Track the throws of a film, in order.

        Parameters
        ----------
        like : films of the same scene that follow

        Returns
        -------
        None; or, if no part of the film is a throw, the error of the first; all were reported

        Raises
        ------
        InputError : a film without a throw, or an error of the tracker
        """
        pieces = self._pieces(film, scene)
        camera = self._camera_of(scene, pieces, like)
        refused: list[InputError] = []
        for piece in pieces:
            key = self._key(piece, scene, camera)
            one = self._kept(key, piece)
            if one is None:
                try:
                    one = self._track(piece, scene, camera)
                except InputError as error:
                    if piece.begin is None:
                        raise
                    moves = isinstance(error, CameraMovesError)
                    known = moves and any(isinstance(k, CameraMovesError) for k in refused)
                    refused.append(_without_context(error))
                    if not known:  # reported once
                        self.left_out(f"{piece.path.name}, {piece.name}: {error.problem}")
                    continue
                self._keep(one, key, scene, even_alone=piece.begin is not None)
            yield replace(one.numbered(self._done, piece), scene=scene)
            self._done += 1
        return refused[0] if len(refused) == len(pieces) else None

    def _track(self, piece: Piece, scene: Scene, camera: RefinedCamera | None) -> TrackedFilm:
        """Track a piece with one throw.

        Raises
        ------
        NoThrowError : a part of a film in which a stone is carried, pushed or moved, not thrown
        InputError : what the tracker raises, or no tracks
        """
        film: Any = self.cameras.sampled(piece) or piece.film
        given: dict[str, Any] = {} if camera is None else {"camera": camera}
        found = self.tracker(film, scene, progress=self.progress, **given)
        tracks = tracks_in(found, piece.path)
        about = found if isinstance(found, FilmTrack) else None
        if piece.begin is not None and self._options and (why := moved(tracks[0])):
            raise NoThrowError(why, source=piece.path)
        return TrackedFilm(
            film=piece.path,
            tracks=tracks,
            summary=summary_of(about or tracks[0]),
            found=about,
            shown=piece.film,
        )

    def _pieces(self, film: Path, scene: Scene) -> list[Piece]:
        """Return the throws of a film, or the whole film if it shows one throw only."""
        if self._options is None:
            return [Piece.whole(film)]
        return cut(
            Film.open(film, scene.fps, self._options.slow),
            scene,
            left_out=lambda why: self.left_out(f"{film.name}, {why}"),
            progress=self.progress,
        )

    def _camera_of(
        self, scene: Scene, pieces: Sequence[Piece], like: Sequence[Path]
    ) -> RefinedCamera | None:
        """Return the camera shared by all films of the scene; None if each is solved separately."""
        if self._options is None or not self._options.refine:
            return None
        return self.cameras.of(scene, pieces, like, self.progress)

    def _key(self, piece: Piece, scene: Scene, camera: RefinedCamera | None) -> str:
        """Return a digest of everything that determines the tracks of a piece."""
        if self.checkpoints is None:
            return ""
        return digest(
            piece.path,
            tracker=_identity(self.tracker),
            scene=asdict(replace(scene, source=None)),
            piece=piece.key,
            camera=None if camera is None else camera_document(camera),
        )

    def _kept(self, key: str, piece: Piece) -> TrackedFilm | None:
        """Return the kept tracks of a piece; None without any."""
        if self.checkpoints is None or self._done < self.always_track:
            return None
        kept = self.checkpoints.load(key)
        if kept is None:
            return None
        tracks, summary = kept
        return TrackedFilm(film=piece.path, tracks=tuple(tracks), summary=summary, resumed=True)

    def _keep(self, one: TrackedFilm, key: str, scene: Scene, *, even_alone: bool) -> None:
        """Keep the tracks, and the camera that was used."""
        if one.found is not None:
            self.cameras.note(scene, one.found)
        if self.checkpoints is not None and (even_alone or self.several_films):
            self.checkpoints.save(key, one.tracks, one.summary)


def _is_built_in(tracker: Any) -> bool:
    """Return whether a tracker is that of this package, with options or without."""
    return (tracker.func if isinstance(tracker, partial) else tracker) is track_film


def _identity(function: Any) -> str:
    """Return a text that identifies a tracker and its options."""
    if isinstance(function, partial):
        return f"{_identity(function.func)} {function.args!r} {function.keywords!r}"
    return f"{getattr(function, '__module__', '')}:{getattr(function, '__qualname__', function)}"


def _without_context(error: InputError) -> InputError:
    """Return an error without its context, which has the pictures of a dropped throw."""
    error.__cause__ = error.__context__ = None
    return error.with_traceback(None)
