"""Many films to tracks, one after the other, with what an interrupted call has already tracked."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, TypeAlias

from curling_env.errors import InputError
from curling_env.trajectory import Trajectory
from curling_env.typing import Progress, no_progress
from friction_estimation.camera.scene import Scene, load_scene
from friction_estimation.tracking.film_track import FilmTrack
from friction_estimation.tracking.resume import Checkpoints, digest
from friction_estimation.tracking.tracker import Tracker, load_tracker, tracks_in


@dataclass(frozen=True, kw_only=True, eq=False)
class TrackedFilm:
    """What tracking one of several films gave.

    Parameters
    ----------
    film : its path
    tracks : the thrown stone's track, then those of the other stones
    summary : frames, rows, times and contacts, for JSON
    found : everything that the built-in tracker found; None for a tracker that returns tracks
        alone, and for a resumed film
    resumed : whether an earlier, interrupted call had tracked the film
    """

    film: Path
    tracks: tuple[Trajectory, ...]
    summary: dict[str, Any]
    found: FilmTrack | None = None
    resumed: bool = False

    @property
    def thrown(self) -> Trajectory:
        """The thrown stone's track."""
        return self.tracks[0]


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
    """Track films of one throw each.

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
    The tracks of all stones in all films, numbered by throw from 0; the thrown stone of each film
    comes first and is stone 0.

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
    progress: Progress = no_progress,
) -> Iterator[TrackedFilm]:
    """Track films of one throw each, and yield what is found in each film as soon as it is known.

    Parameters
    ----------
    films : in order of play
    scenes : one for all films, or one for each
    throws : number of the throw in each film; 0, 1, 2, ... by default
    tracker : finds the stones in a film; by default the built-in one, `track_film`
    checkpoints : keeps the tracks of each film until all films are done, so that an interrupted
        call can be repeated; the caller deletes them at the end. None: nothing is kept
    always_track : as many of the first films are tracked even if checkpoints hold their tracks,
        for callers that need `found`

    Raises
    ------
    InputError : a number of scenes that is neither one nor that of the films; also what the tracker
        raises
    """
    scenes = [scenes] if isinstance(scenes, Scene) else list(scenes)
    if len(scenes) not in (1, len(films)):
        raise InputError(
            f"one scene for all films or one for each: {len(films)} films, {len(scenes)} scenes",
            source="--scene",
        )
    scenes *= len(films) // len(scenes)
    numbers = range(len(films)) if throws is None else throws
    tracker = load_tracker() if tracker is None else tracker
    return _track_each(
        list(zip(films, scenes, numbers, strict=True)), tracker, checkpoints, always_track, progress
    )


def _track_each(
    jobs: Sequence[tuple[Path, Scene, int]],
    tracker: Tracker,
    checkpoints: Checkpoints | None,
    always_track: int,
    progress: Progress,
) -> Iterator[TrackedFilm]:
    for i, (film, scene, throw) in enumerate(jobs):
        key = ""
        if checkpoints is not None:
            choices = {"scene": asdict(replace(scene, source=None)), "throw": throw}
            key = digest(film, tracker=_identity(tracker), **choices)
            kept = None if i < always_track else checkpoints.load(i, key)
            if kept is not None:
                tracks, summary = kept
                yield TrackedFilm(film=film, tracks=tuple(tracks), summary=summary, resumed=True)
                continue
        found = tracker(film, scene, progress=progress)
        numbered = tuple(
            replace(track, throw=throw, stone=k) for k, track in enumerate(tracks_in(found, film))
        )
        tracked = TrackedFilm(
            film=film,
            tracks=numbered,
            summary=_summary(found if isinstance(found, FilmTrack) else numbered[0]),
            found=found if isinstance(found, FilmTrack) else None,
        )
        if checkpoints is not None and len(jobs) > 1:
            checkpoints.save(i, key, tracked.tracks, tracked.summary)
        yield tracked


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
        about = {"frames": found.frame_count, **about}
        if found.contacts:
            about["contacts_s"] = [float(t) for t in found.contacts]
        if found.others:
            about["others"] = [_summary_of_other(other) for other in found.others]
    return about


def _summary_of_other(other: FilmTrack) -> dict[str, Any]:
    begin, end = other.trajectory.xy[0], other.trajectory.xy[-1]
    about: dict[str, Any] = {
        "stone": int(other.trajectory.stone),
        "struck": bool(other.contacts),
        "lay": [round(float(value), 4) for value in begin],
    }
    if other.contacts:
        about["rests"] = [round(float(value), 4) for value in end]
    return about
