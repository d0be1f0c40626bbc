"""The screen *Practice*: sessions, their cameras and films, the work on them, and their removal."""

from __future__ import annotations

import datetime

from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import JSONResponse, Response, StreamingResponse
from starlette.routing import Route

from agents.app.club import Camera, Club, Session, films, removal
from agents.app.club.club import changed, named
from agents.app.club.records import Note, State
from agents.app.club.session_files import finish_files, note_change
from agents.app.club.targets import rename_in_calls
from agents.app.pages import (
    Screen,
    club_of,
    document_of,
    film_of,
    form_of,
    go_to,
    number_in,
    page,
    session_of,
    text_in,
)
from agents.app.screens.marking import MARKING, can_be_marked
from agents.app.views.progress import events, job_events, state_of
from agents.app.work import jobs
from curling_env.errors import InputError
from friction_estimation.camera.annotation.verdict import SHEETS as OFFERED
from friction_estimation.camera.annotation.verdict import size_in_words
from friction_estimation.film.video import SUFFIXES

SHEETS = {f"{sheet.length:g}x{sheet.width:g}": sheet for sheet in OFFERED}
"""Sizes of the ice that a camera may see."""
WORK = ("track", "estimate", "discover")
"""Kinds of work that the page may ask for."""
RENAMED = ("athlete", "stone", "camera", "target", "position")
"""Tables of the database whose rows can be renamed."""
MERGED = {
    "athlete": (("throw", "athlete_id"),),
    "stone": (("throw", "stone_id"),),
    "camera": (("session", "camera_id"), ("film", "camera_id")),
    "target": (),
}
"""Tables whose rows are merged by giving one the name of another; the columns that hold them."""
LONGEST_LIST = 400
"""Letters of a list of numbers, and of what an ice technician enters."""
CONDITIONS = ("pebble", "temperature", "humidity", "scrape")
"""Of the ice, entered for each session."""
LONGEST_NOTE, LONGEST_ADDRESS = 5000, 500
"""Letters of a remark, and of the address of a camera."""


def show(request: Request) -> Response:
    """A session's films and how far they are; the latest session without a number."""
    club, session = club_of(request), session_of(request)
    camera = None if session is None else club.camera(session.camera_id)
    return page(
        request,
        "practice.html",
        session=session,
        sessions=club.sessions(),
        cameras=club.cameras(),
        camera=camera,
        sizes=[(key, size_in_words(sheet)) for key, sheet in SHEETS.items()],
        there=films.films_there(club),
        endings=",".join(SUFFIXES),
        today=datetime.date.today().isoformat(),
        can_be_marked=session is not None and can_be_marked(club, session),
        conditions=CONDITIONS,
        names={table: club.names(table) for table in RENAMED},
        merged=MERGED,
        notes=[] if session is None else club.notes(session),
        removed=[] if session is None else removal.removed_in(club, session),
        removed_sessions=removal.removed_sessions(club),
        state=None if session is None else state_of(club, session),
    )


async def begin(request: Request) -> Response:
    """Begin a session."""
    club, form = club_of(request), await form_of(request)
    session = club.add_session(*_about(form), _chosen_camera(club, form))
    return go_to(request, f"practice/{session.id}")


async def rename(request: Request) -> Response:
    """Rename something; if another one has that name, both are merged."""
    club, form = club_of(request), await form_of(request)
    table, name = form.get("table", ""), named(form.get("name", ""), "it")
    if table not in RENAMED:
        raise InputError(f"expected one of {', '.join(RENAMED)}", source="table")
    number = number_in(form.get("id", ""), f"the {table}")
    with club.database.writing() as connection:
        query = f"select id from {table} where name = ? and id <> ?"
        other = connection.execute(query, (name, number)).fetchone()
        if table == "target":
            rename_in_calls(connection, number, name)
        if other is None:
            changed(connection, table, number, name=name)
        elif table not in MERGED:
            raise InputError(f"another {table} has this name; choose another", source=name)
        else:
            for of, column in MERGED[table]:
                query = f"update {of} set {column} = ? where {column} = ?"
                connection.execute(query, (other[0], number))
            connection.execute(f"delete from {table} where id = ?", (number,))
            if table == "target":
                changed(connection, table, other[0], removed=None)
        note_change(connection, "true")
    await run_in_threadpool(finish_files, club)
    if table == "camera":  # films that had other marks are tracked with those of the camera
        for session in club.sessions():
            _track_if_marked(club, session)
    here = form.get("session", "")
    return go_to(request, f"practice/{here}" if here.isdecimal() else "practice")


async def announce_film(request: Request) -> Response:
    """A film that the browser is going to send; how much of it is there already."""
    club, session, result = club_of(request), _session(request), await document_of(request)
    name, size = result.get("name"), result.get("size")
    if not isinstance(name, str) or not isinstance(size, int):
        raise InputError("expected the name and the size of a film")
    film = films.begin_film(club, session, name, size)
    return JSONResponse({"film": film.id, "received": film.received})


async def receive_piece(request: Request) -> Response:
    """The next piece of a film; the last one sets off tracking."""
    club, (film, session) = club_of(request), film_of(request)
    begin = number_in(request.query_params.get("begin", ""), "the first byte")
    film = films.add_piece(club, film, begin, await request.body())
    if film.is_whole:
        _track_if_marked(club, session)
    return JSONResponse({"received": film.received})


def cancel(request: Request) -> Response:
    """End work."""
    jobs.cancel(club_of(request), request.path_params["job"])
    return Response(status_code=204)


def work_again(request: Request) -> Response:
    """Begin work once more that failed or was cancelled."""
    jobs.retry(club_of(request), request.path_params["job"])
    return Response(status_code=204)


async def watch_work(request: Request) -> Response:
    """Server-sent events: how far some work is, by its numbers."""
    asked = request.query_params.get("jobs", "")[:LONGEST_LIST]
    numbers = {number_in(part, "a piece of work") for part in asked.split(",") if part}
    result = job_events(club_of(request), request.app.state.closed, numbers)
    return StreamingResponse(result, media_type="text/event-stream")


def again(request: Request) -> Response:
    """Track a film once more that could not be tracked."""
    club, (film, session) = club_of(request), film_of(request)
    if film.state is State.FAILED:
        club.change("film", film.id, state=State.WAITING, said="")
    _track_if_marked(club, session)
    return Response(status_code=204)


DEEDS = ("correct", "camera", "take", "record", "work", "note")
"""Forms of a session."""


async def do(request: Request) -> Response:
    """Do what a form of a session asks for, and show the session again."""
    session, form = _session(request), await form_of(request)
    deed = request.url.path.rpartition("/")[2]
    await run_in_threadpool(_do, club_of(request), session, deed, form)
    return go_to(request, f"practice/{session.id}")


def _do(club: Club, session: Session, deed: str, form: dict[str, str]) -> None:
    match deed:
        case "correct":
            name, day, sheet = _about(form)
            room = {word: text_in(form, word, LONGEST_LIST) for word in CONDITIONS if word in form}
            club.change("session", session.id, name=name, day=day, sheet=sheet, **room)
        case "camera":
            camera = _chosen_camera(club, form)
            number = None if camera is None else camera.id
            club.change("session", session.id, camera_id=number)
            _track_if_marked(club, session)
        case "take":
            films.take_film(club, session, club.path(form.get("file", "")))
            _track_if_marked(club, session)
        case "record":
            source = text_in(form, "source", LONGEST_ADDRESS)
            if not source:
                raise InputError("expected the number of a camera, or the address of a stream")
            jobs.submit(club, "record", session, source)
        case "work":
            kind = form.get("kind", "")
            if kind not in WORK:
                raise InputError(f"expected one of {', '.join(WORK)}", source="work")
            jobs.submit(club, kind, session)
        case _:
            text = text_in(form, "text", LONGEST_NOTE)
            now = datetime.datetime.now().isoformat(" ", "minutes")
            if text:
                club.add(Note, session_id=session.id, text=text, written=now)


async def watch(request: Request) -> Response:
    """Server-sent events: how far all is."""
    result = events(club_of(request), request.app.state.closed, _session(request))
    return StreamingResponse(result, media_type="text/event-stream")


def _about(form: dict[str, str]) -> tuple[str, str, str]:
    """The name, day and sheet of a session in a form."""
    day = form.get("day", "")
    try:
        datetime.date.fromisoformat(day)
    except ValueError:
        raise InputError("expected a day such as 2026-11-22") from None
    sheet = named(form.get("sheet", ""), "the sheet")
    return named(form.get("name") or f"Practice on {sheet}", "the session"), day, sheet


def _session(request: Request) -> Session:
    session = session_of(request)
    assert session is not None  # the address names one
    return session


def _track_if_marked(club: Club, session: Session) -> None:
    session = club.session(session.id) or session
    camera = club.camera(session.camera_id)
    waiting = any(films.waits(club, session, film) for film in club.films(session))
    if waiting and camera is not None and camera.scene is not None:
        jobs.submit(club, "track", session)


def _chosen_camera(club: Club, form: dict[str, str]) -> Camera | None:
    """The camera that a form names, which may be a new one."""
    chosen = form.get("camera", "")
    if chosen == "new":
        name = named(form.get("camera_name", ""), "the camera")
        size = SHEETS.get(form.get("size", ""))
        if size is None:
            raise InputError(f"expected one of {', '.join(SHEETS)}", source="size of the ice")
        if any(camera.name == name for camera in club.cameras()):
            raise InputError("another camera has this name; choose another", source=name)
        return club.add(Camera, name=name, length=size.length, width=size.width)
    if not chosen:
        return None
    camera = club.camera(number_in(chosen, "a camera"))
    if camera is None:
        raise InputError("unknown camera; choose one from the list")
    return camera


REMOVALS = {
    "remove": removal.remove,
    "bring-back": removal.bring_back,
    "delete": removal.delete_for_good,
}


async def deal(request: Request) -> Response:
    """Remove what the form names, once the work on it has ended; or bring it back, or delete it."""
    club, form = club_of(request), await form_of(request)
    kind: removal.Kind | None = next(
        (one for one in removal.KINDS if one == form.get("kind")), None
    )
    if kind is None:
        raise InputError("expected a session, a film or a throw")
    number = number_in(form.get("id", ""), f"a {kind}")
    page = number if kind == "session" else number_in(form.get("session", ""), "a session")
    deed = request.url.path.rpartition("/")[2]
    if deed == "remove" and kind != "throw":
        film = club.film(number) if kind == "film" else None
        if kind == "session" or (film is not None and film.state is State.RUNNING):
            _end_work(club, page, "" if film is None else "track")
    await run_in_threadpool(REMOVALS[deed], club, kind, number)
    there = club.session(page)
    return go_to(request, f"practice/{there.id}#removed" if there else "practice#removed")


def _end_work(club: Club, number: int, kind: str) -> None:
    """End the work on a session, or that of one kind, which then continues with the rest."""
    session = club.session(number)
    work = [] if session is None else jobs.jobs(club, session)
    ended = [job for job in work if job.state in jobs.OPEN and kind in ("", job.kind)]
    for job in ended:
        jobs.cancel(club, job.id)
    if session is not None and kind and ended:
        jobs.submit(club, kind, session)


SCREEN = Screen(
    "practice",
    "Practice",
    show,
    [
        Route("/practice", begin, methods=["POST"]),
        Route("/practice/films/{film:int}", receive_piece, methods=["PUT"]),
        Route("/practice/work/{job:int}/again", work_again, methods=["POST"]),
        Route("/practice/work/events", watch_work),
        Route("/practice/films/{film:int}/again", again, methods=["POST"]),
        Route("/practice/work/{job:int}/cancel", cancel, methods=["POST"]),
        Route("/practice/rename", rename, methods=["POST"]),
        Route("/practice/{session:int}/films", announce_film, methods=["POST"]),
        Route("/practice/{session:int}/events", watch),
        *(Route(f"/practice/{{session:int}}/{deed}", do, methods=["POST"]) for deed in DEEDS),
        *MARKING,
        *(Route(f"/practice/{deed}", deal, methods=["POST"], name=deed) for deed in REMOVALS),
    ],
)
