"""Marking the sheet in a camera's picture: the existing page, for a film of the session."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

from starlette.concurrency import run_in_threadpool
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route

from agents.app.club import Camera, Club, Film, Session
from agents.app.club.club import CAMERAS, changed, plain
from agents.app.club.films import waits
from agents.app.pages import club_of, session_of
from agents.app.work.jobs import submit
from curling_env.errors import InputError
from curling_env.infrastructure.files.reading import parse_json
from curling_env.sheet import Sheet
from friction_estimation.camera.annotation.annotate import Annotation
from friction_estimation.camera.annotation.page import AnnotationPage
from friction_estimation.camera.scene import Scene, load_scene, save_scene


def can_be_marked(club: Club, session: Session) -> bool:
    """Return whether the session has a camera, and a film that shows what it sees."""
    return session.camera_id is not None and any(k.is_whole for k in club.films(session))


async def answer(request: Request) -> Response:
    """The page, its pictures, and what its script asks; about one film, or about all."""
    club, session = club_of(request), session_of(request)
    number = request.path_params.get("film")
    film = None if number is None else club.film(number)
    camera = None
    if session is not None:
        camera = club.camera(session.camera_id) if film is None else club.camera_of(session, film)
    is_there = session is not None and can_be_marked(club, session)
    is_of_session = number is None or (
        film is not None and session is not None and film.session_id == session.id
    )
    if session is None or camera is None or not is_there or not is_of_session:
        raise HTTPException(
            404, "The sheet cannot be marked yet: the session needs a camera and a film."
        )
    asked = None
    if request.method == "POST":
        asked = parse_json(await request.body(), source="the request")
    films = club.films(session) if film is None else [film]

    def keep(scene: Scene) -> None:
        if film is None:
            _keep(club, camera, scene)
        else:
            _keep_from(club, session, film, camera, scene)

    # The page comes at once; its script waits for the film, which may take long to open.
    marking = AnnotationPage(lambda: _annotation(club, films, camera), keep, units=club.units)
    status, kind, content = await run_in_threadpool(
        marking.answer, request.path_params["rest"], asked
    )
    headers = {"Content-Security-Policy": f"{marking.policy}; frame-ancestors 'none'"}
    return Response(content, status, headers, media_type=kind)


def _annotation(club: Club, films: Sequence[Film], camera: Camera) -> Annotation:
    """The first of some films that can be opened, with what was marked before.

    Raises
    ------
    InputError : none can
    """
    scene = None if camera.scene is None else club.path(camera.scene)
    marked = scene.stat().st_mtime_ns if scene is not None and scene.exists() else 0
    problem = InputError("none of the films of this session can be opened")
    for film in films:
        if film.is_whole:
            try:
                return _opened(club, camera, film.file, marked)
            except InputError as error:
                problem = error
    raise problem


@lru_cache(maxsize=1)  # its pictures take much memory
def _opened(club: Club, camera: Camera, file: str, marked: int) -> Annotation:
    path = club.path(file)
    if camera.scene is not None and marked:
        return Annotation.from_scene(path, load_scene(club.path(camera.scene)))
    return Annotation.open(path, Sheet(length=camera.length, width=camera.width))


def _keep(club: Club, camera: Camera, scene: Scene) -> None:
    """Save a scene with its camera; track films that waited for it or had other marks."""
    _save(club, camera, scene)
    for session in club.sessions():
        films = [k for k in club.films(session) if camera.id in (k.camera_id, session.camera_id)]
        if any(waits(club, session, film) for film in films):
            submit(club, "track", session)


def _keep_from(club: Club, session: Session, film: Film, before: Camera, scene: Scene) -> None:
    """Save the scene of a camera that was moved; it holds from this film on.

    The film is tracked again. Films before it keep the camera as it stood, as do
    other sessions.
    """
    name = f"{before.name[:40]}, from {film.name[:30]} on"
    with club.database.reading() as connection:
        query = "select count(*) from camera where substr(name, 1, ?) = ?"
        known = connection.execute(query, (len(name), name)).fetchone()[0]
    name = f"{name} ({known + 1})" if known else name
    camera = club.add(Camera, name=name, length=scene.sheet.length, width=scene.sheet.width)
    _save(club, camera, scene)
    with club.database.writing() as connection:
        connection.execute(
            "update film set camera_id = ? where session_id = ? and place < ? "
            "and camera_id is null",
            (before.id, session.id, film.place),
        )
        connection.execute(
            "update film set camera_id = null, said = '', state = 'waiting' "
            "where session_id = ? and (id = ? or (place > ? and state <> 'done'))",
            (session.id, film.id, film.place),
        )
        changed(connection, "session", session.id, camera_id=camera.id)
    submit(club, "track", session)


def _save(club: Club, camera: Camera, scene: Scene) -> None:
    file = camera.scene or f"{CAMERAS}/{camera.id}-{plain(camera.name)}.scene.json"
    try:
        save_scene(scene, club.path(file))
    except OSError as error:
        raise InputError(str(error)) from error
    size = {"length": scene.sheet.length, "width": scene.sheet.width}
    club.change("camera", camera.id, scene=file, **size)


# The token is part of the address, because that page's script has none.
_PAGE = "mark/{token}/{rest:path}"
MARKING = [
    Route(f"/practice/{{session:int}}/{_PAGE}", answer, methods=["GET", "POST"]),
    Route(f"/practice/{{session:int}}/films/{{film:int}}/{_PAGE}", answer, methods=["GET", "POST"]),
]
