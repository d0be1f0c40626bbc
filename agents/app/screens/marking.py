"""Marking the sheet in a camera's picture: the existing page, for a film of the session."""

from __future__ import annotations

from functools import lru_cache

from starlette.concurrency import run_in_threadpool
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route

from agents.app.club import Camera, Club, Session
from agents.app.club.club import CAMERAS, plain
from agents.app.pages import club_of, session_of, work_of
from curling_env.errors import InputError
from curling_env.infrastructure.files.storage import parse_json
from curling_env.sheet import Sheet
from friction_estimation.camera.annotation.annotate import Annotation
from friction_estimation.camera.annotation.page import AnnotationPage
from friction_estimation.camera.scene import Scene, load_scene, save_scene


def can_be_marked(club: Club, session: Session) -> bool:
    """Whether the session has a camera, and a film that shows what it sees."""
    return session.camera_id is not None and any(k.is_whole for k in club.films(session))


async def answer(request: Request) -> Response:
    """The page, its pictures, and what its script asks."""
    club, session = club_of(request), session_of(request)
    camera = None if session is None else club.camera(session.camera_id)
    if session is None or camera is None or not can_be_marked(club, session):
        raise HTTPException(404, "This session has no camera, or no film yet to mark it in.")
    asked = None
    if request.method == "POST":
        asked = parse_json(await request.body(), source="the request")
    opened = await run_in_threadpool(_annotation, club, session, camera)
    marking = AnnotationPage(opened, lambda scene: _keep(request, camera, scene))
    status, kind, content = await run_in_threadpool(
        marking.answer, request.path_params["rest"], asked
    )
    headers = {"Content-Security-Policy": f"{marking.policy}; frame-ancestors 'none'"}
    return Response(content, status, headers, media_type=kind)


def _annotation(club: Club, session: Session, camera: Camera) -> Annotation:
    """The first film of a session that can be opened, with what was marked before.

    Raises
    ------
    InputError : none can
    """
    scene = None if camera.scene is None else club.path(camera.scene)
    marked = scene.stat().st_mtime_ns if scene is not None and scene.exists() else 0
    problem = InputError("no film of this session can be opened")
    for film in club.films(session):
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


def _keep(request: Request, camera: Camera, scene: Scene) -> None:
    """Save a scene with its camera, and track what has waited for it."""
    club = club_of(request)
    file = camera.scene or f"{CAMERAS}/{camera.id}-{plain(camera.name)}.scene.json"
    try:
        save_scene(scene, club.path(file))
    except OSError as error:
        raise InputError(str(error)) from error
    with club.database.writing() as connection:
        connection.execute("update camera set scene = ? where id = ?", (file, camera.id))
    for session in club.sessions():
        if session.camera_id == camera.id and any(k.is_whole for k in club.films(session)):
            work_of(request).submit("track", session)


# The token stands in the address, because that page's script knows of none.
MARKING = [
    Route("/practice/{session:int}/mark/{token}/{rest:path}", answer, methods=["GET", "POST"])
]
