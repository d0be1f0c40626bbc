"""From films to tracks, throw by throw, reusing the throws of an interrupted call."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import TypeAlias

from curling_env.errors import InputError, NoThrowError
from curling_env.infrastructure.files.reading import ordinary_file
from curling_env.trajectory import Trajectory
from curling_env.typing import Progress, no_progress
from friction_estimation.camera.scene import Scene, load_scene
from friction_estimation.tracking.films.resume import Checkpoints
from friction_estimation.tracking.films.shared_cameras import SharedCameras
from friction_estimation.tracking.films.throws_of_film import (
    ThrowTracker,
    is_built_in,
    without_context,
)
from friction_estimation.tracking.films.tracked_film import TrackedFilm, with_stones
from friction_estimation.tracking.tracker import Tracker, load_tracker

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
    for film in films if is_built_in(tracker) else ():
        ordinary_file(film, "film")
    throw_tracker = ThrowTracker(
        tracker=tracker,
        cameras=SharedCameras() if cameras is None else cameras,
        checkpoints=checkpoints,
        always_track=always_track,
        several_films=len(films) > 1,
        left_out=left_out or (lambda why: None),
        progress=progress,
    )
    each_shows_one = len(films) == 1 or left_out is None
    given = list(zip(films, scenes, strict=True))
    return with_stones(_throws_of_all(given, throw_tracker, each_shows_one))


def _throws_of_all(
    films: Sequence[tuple[Path, Scene]],
    throw_tracker: ThrowTracker,
    each_shows_one: bool,
) -> Iterator[TrackedFilm]:
    """Yield the throws of all films, in order.

    Parameters
    ----------
    each_shows_one : whether a film without a throw is refused; else it is skipped, and reported
    """
    empty: list[InputError] = []
    for k, (film, scene) in enumerate(films):
        like = [other for other, its in films[k + 1 :] if its is scene]
        try:
            why = yield from throw_tracker.throws_of(film, scene, like=like)
        except NoThrowError as error:
            if each_shows_one:
                raise
            why = without_context(error)
            throw_tracker.left_out(f"{film.name}: {why.problem}")
        if why is None:
            continue
        if each_shows_one or not isinstance(why, NoThrowError):
            raise why
        empty.append(why)
    if len(empty) == len(films):
        raise empty[0]
