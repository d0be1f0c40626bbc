"""Tracking the films of a session: each throw is there as soon as it is tracked."""

from __future__ import annotations

from pathlib import Path

from agents.app.club import Club, Film, Session
from agents.app.club.films import waits
from agents.app.club.records import State
from agents.app.club.session_files import Part, keep_part, load_part, part_path, write_files
from agents.app.work.jobs import Reported, submit
from curling_env.errors import CurlingError, InputError
from curling_env.infrastructure.provenance import sha256_of
from friction_estimation.camera.scene import Scene, load_scene
from friction_estimation.tracking import TrackedFilm, track_each
from friction_estimation.tracking.films.resume import Checkpoints
from friction_estimation.tracking.films.shared_cameras import SharedCameras, camera_document


def do_track(club: Club, session: Session, progress: Reported, given: str = "") -> None:
    """Track the films of a session that wait, or whose marks have changed, in the order of play.

    A film without a throw says so, and the next one is tracked. Where films were tracked again,
    the ice that was estimated from them is estimated again.

    Raises
    ------
    InputError : the session's camera has not been marked
    """
    films = [film for film in club.films(session) if waits(club, session, film)]
    again = any(film.state is State.DONE for film in films)
    scenes = {film.id: scene_file(club, session, film) for film in films}
    for k, film in enumerate(films):
        progress.piece(k, len(films))
        set_state(club, film, State.RUNNING)
        marks = sha256_of(scenes[film.id])
        try:
            scene = load_scene(scenes[film.id])
            remark = _track_film(club, session, film, scene, progress)
        except CurlingError as error:
            problem = error.problem if isinstance(error, InputError) else str(error)
            set_state(club, film, State.FAILED, problem, marks)
        else:
            set_state(club, film, State.DONE, remark, marks)
    if films:
        write_files(club, session)  # numbers of later throws are final now
    if again and session.ice_of is not None:
        submit(club, "estimate", session)


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


def set_state(
    club: Club, film: Film, state: State, remark: str = "", marks: str | None = None
) -> None:
    """Write how far tracking of a film is, and with which marks it was done."""
    query = "update film set state = ?, said = ?, marks = coalesce(?, marks) where id = ?"
    club.database.write(query, state, remark, marks, film.id)


def _track_film(club: Club, session: Session, film: Film, scene: Scene, progress: Reported) -> str:
    """Track a film, throw by throw; return what there is to say of it."""
    found: list[TrackedFilm] = []
    remarks: list[str] = []
    path = part_path(club, session, film)
    kept = load_part(path)
    camera = None if kept is None else kept.camera
    # What was found before stays until as much is found again.
    least = 0 if kept is None else len(kept.throws)
    again = film.state is State.DONE

    def keep() -> None:
        throws, handles = [k.tracks for k in found], [k.handles for k in found]
        keep_part(club, session, film, Part(throws=throws, handles=handles, camera=camera))

    checkpoints = Checkpoints(path)
    for one in track_each(
        [club.path(film.file)],
        scene,
        checkpoints=checkpoints,
        cameras=SharedCameras(keep=True),
        left_out=lambda why: remarks.append(f"not used: {why}"),
        progress=progress,
    ):
        found.append(one)
        if one.found is not None and one.found.refined.measured:
            camera = camera_document(one.found.refined)
        if len(found) > least and not again:
            keep()
        moved = 0.0 if one.found is None else one.found.moved_px
        if moved:
            far = f"by {moved:.1f} px" if moved < 100 else "far"
            remarks.append(
                f"the camera has moved {far} since it was marked; its position was corrected"
            )
    if found and (again or len(found) <= least):
        keep()
    checkpoints.delete()
    return "; ".join(dict.fromkeys(remarks))
