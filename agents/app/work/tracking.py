"""Tracking the films of a session: each throw is there as soon as it is tracked."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from agents.app.club import Club, Film, Session
from agents.app.club.records import State
from agents.app.club.session_files import Part, keep_part, load_part, part_path
from curling_env.errors import CurlingError, InputError
from friction_estimation.camera.scene import Scene, load_scene
from friction_estimation.tracking import TrackedFilm, track_each
from friction_estimation.tracking.films.resume import Checkpoints
from friction_estimation.tracking.films.shared_cameras import SharedCameras, camera_document

if TYPE_CHECKING:
    from agents.app.work.reported import Reported


def track(club: Club, session: Session, progress: Reported, given: str = "") -> None:
    """Track the films of a session that are there and not tracked yet, in the order of play.

    A film that shows no throw is said to, and the next one is taken.

    Raises
    ------
    InputError : the session's camera has not been marked
    """
    films = list(_waiting(club, session))
    scenes = {film.id: scene_file(club, session, film) for film in films}
    for k, film in enumerate(films):
        progress.piece(k, len(films))
        set_state(club, film, State.RUNNING)
        try:
            scene = load_scene(scenes[film.id])
            said = _track_film(club, session, film, scene, progress)
        except CurlingError as error:
            problem = error.problem if isinstance(error, InputError) else str(error)
            set_state(club, film, State.FAILED, problem)
        else:
            set_state(club, film, State.DONE, said)


def scene_file(club: Club, session: Session, film: Film) -> Path:
    """The scene of a film.

    Raises
    ------
    InputError : its camera has not been marked
    """
    camera = club.camera_of(session, film)
    if camera is None or camera.scene is None:
        raise InputError("mark the sheet in the camera's picture first", source=session.name)
    return club.path(camera.scene)


def set_state(club: Club, film: Film, state: State, said: str = "") -> None:
    """Write how far tracking of a film is."""
    with club.database.writing() as connection:
        query = "update film set state = ?, said = ? where id = ?"
        connection.execute(query, (state, said, film.id))


def _waiting(club: Club, session: Session) -> Iterator[Film]:
    for film in club.films(session):
        if film.is_whole and film.state in (State.WAITING, State.RUNNING):
            yield film


def _track_film(club: Club, session: Session, film: Film, scene: Scene, progress: Reported) -> str:
    """Track a film, throw by throw; gives what there is to say of it."""
    found: list[TrackedFilm] = []
    said: list[str] = []
    kept = load_part(part_path(club, session, film))
    camera = None if kept is None else kept.camera
    checkpoints = Checkpoints(part_path(club, session, film))
    for one in track_each(
        [club.path(film.file)],
        scene,
        checkpoints=checkpoints,
        cameras=SharedCameras(keep=True),
        left_out=lambda why: said.append(f"left out: {why}"),
        progress=progress,
    ):
        found.append(one)
        if one.found is not None and one.found.refined.measured:
            camera = camera_document(one.found.refined)
        part = Part(
            throws=[k.tracks for k in found], handles=[k.handles for k in found], camera=camera
        )
        keep_part(club, session, film, part)
        moved = 0.0 if one.found is None else one.found.moved_px
        if moved:
            far = f"by {moved:.1f} px" if moved < 100 else "far"
            said.append(f"the camera had moved {far} since it was marked, and was solved anew")
    checkpoints.delete()
    return "; ".join(dict.fromkeys(said))
