"""The screen *Throws*: what each throw was, beside its film, and what the coach says of it."""

from __future__ import annotations

import mimetypes
from pathlib import Path

from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import FileResponse, JSONResponse, Response
from starlette.routing import Route

from agents.app.club import Club, Session, Throw
from agents.app.club.club import named
from agents.app.club.records import Hand, State
from agents.app.club.session_files import finish_files
from agents.app.club.targets import with_places
from agents.app.pages import club_of, form_of, go_to, page, session_of
from agents.app.screens.screen import Screen
from agents.app.views.film_view import throw_view
from agents.app.views.measures import sheets_of
from agents.app.views.progress import in_words
from agents.app.views.told import COLUMNS, told
from agents.app.work.film_copy import copy_of
from agents.app.work.jobs import COPY, latest, submit
from agents.coaching import read_call
from curling_env.errors import InputError

MADE = {"": None, "made": True, "missed": False}
LONGEST = 300
"""Of what was called, and of a note."""


def show(request: Request) -> Response:
    """The throws of a session; the latest session without a number."""
    club, session = club_of(request), session_of(request)
    sheets = [] if session is None else sheets_of(club, session)
    if session is None or not sheets:
        return page(
            request, "empty.html", session=session, heading="Throws", text="Nobody has thrown yet."
        )
    throws = {one.number: one for one in club.throws(session)}
    rows = [
        {"throw": throws[sheet.throw], "sheet": sheet, "told": told(sheet)}
        for sheet in sheets
        if sheet.throw in throws
    ]
    athletes = sorted({sheet.athlete for sheet in sheets if sheet.athlete})
    chosen = request.query_params.get("athlete", "")
    if chosen:
        rows = [row for row in rows if row["sheet"].athlete == chosen]
    return page(
        request,
        "throws.html",
        session=session,
        rows=rows,
        columns=COLUMNS,
        athletes=athletes,
        chosen=chosen,
        unseen=len(throws) - len(sheets),
    )


def show_throw(request: Request) -> Response:
    """One throw: film, speed, numbers, and the coach's entry."""
    club = club_of(request)
    session, throw = _asked_for(request)
    throws = club.throws(session)
    place = next(k for k, one in enumerate(throws) if one.id == throw.id)
    sheet = next((one for one in sheets_of(club, session) if one.throw == throw.number), None)
    film = club.film(throw.film_id)
    return page(
        request,
        "throw_film.html",
        session=session,
        throw=throw,
        sheet=sheet,
        words="" if sheet is None else in_words(sheet),
        told=[] if sheet is None else [k for k in told(sheet) if k.value],
        film=film,
        copied=film is not None and copy_of(club, film).exists(),
        athlete=next((a for a in club.athletes() if a.id == throw.athlete_id), None),
        stone=next((s for s in club.stones() if s.id == throw.stone_id), None),
        athletes=club.athletes(),
        stones=club.stones(),
        call=read_call(with_places(throw.called, club.named_targets())),
        targets=club.targets(),
        before=throws[place - 1] if place else None,
        after=throws[place + 1] if place + 1 < len(throws) else None,
    )


def show_track(request: Request) -> Response:
    """The throw's speed and its path in the picture, for the page's script."""
    session, throw = _asked_for(request)
    found = throw_view(club_of(request), session, throw)
    if found is None:
        raise HTTPException(404, "Its track is not there.")
    return JSONResponse(found)


def show_film(request: Request) -> Response:
    """A film, or the part of it that the browser asks for."""
    club = club_of(request)
    film = club.film(request.path_params["film"])
    return _sent(None if film is None else club.path(film.file))


def show_copy(request: Request) -> Response:
    """The copy of a film that browsers play, or a part of it."""
    club = club_of(request)
    film = club.film(request.path_params["film"])
    return _sent(None if film is None else copy_of(club, film))


def _sent(path: Path | None) -> Response:
    if path is None or not path.is_file():
        raise HTTPException(404, "There is no such film.")
    kind = mimetypes.guess_type(path.name)[0] or "application/octet-stream"
    if not kind.startswith("video/"):
        kind = "application/octet-stream"
    return FileResponse(path, media_type=kind, headers={"Cache-Control": "private, max-age=3600"})


def make_playable(request: Request) -> Response:
    """Ask for a copy that browsers play; the work that makes it."""
    club = club_of(request)
    film = club.film(request.path_params["film"])
    session = None if film is None else club.session(film.session_id)
    if film is None or session is None:
        raise HTTPException(404, "There is no such film.")
    job = latest(club, COPY, session, str(film.id))
    if job is None or job.state is State.DONE:
        job = submit(club, COPY, session, str(film.id))
    return JSONResponse({"job": job.id})


async def enter(request: Request) -> Response:
    """The coach's entry: who, which stone, what was called, made or missed."""
    club, form = club_of(request), await form_of(request)
    session, throw = _asked_for(request)
    if form.get("made", "") not in MADE:
        raise InputError("expected made, missed or neither")
    for what in ("called", "note"):
        if len(form.get(what, "")) > LONGEST:
            raise InputError(f"at most {LONGEST} letters", source=what)
    if form.get("hand", "right") not in [hand.value for hand in Hand]:
        raise InputError("a hand is right or left")
    _keep(club, session, throw, form)
    finish_files(club)
    return go_to(request, f"throws/{session.id}/{throw.id}")


def _keep(club: Club, session: Session, throw: Throw, form: dict[str, str]) -> None:
    athlete, stone = form.get("athlete", ""), form.get("stone", "")
    with club.database.writing() as connection:
        athlete_id = stone_id = None
        if athlete:
            name = named(athlete, "an athlete")
            connection.execute(
                "insert into athlete (name, hand) values (?, ?) "
                "on conflict (name) do update set hand = excluded.hand",
                (name, form.get("hand", "right")),
            )
            query = "select id from athlete where name = ?"
            athlete_id = connection.execute(query, (name,)).fetchone()[0]
            # With another hand the handles of all their throws have other names.
            connection.execute(
                "update session set stale = 1 where id in "
                "(select session_id from throw where athlete_id = ?)",
                (athlete_id,),
            )
        if stone:
            name = named(stone, "a stone")
            connection.execute(
                "insert into stone (name) values (?) on conflict do nothing", (name,)
            )
            query = "select id from stone where name = ?"
            stone_id = connection.execute(query, (name,)).fetchone()[0]
        connection.execute(
            "update throw set athlete_id = ?, stone_id = ?, called = ?, made = ?, note = ? "
            "where id = ?",
            (
                athlete_id,
                stone_id,
                _line(form.get("called", "")),
                MADE[form.get("made", "")],
                _line(form.get("note", "")),
                throw.id,
            ),
        )
        connection.execute("update session set stale = 1 where id = ?", (session.id,))


def _line(text: str) -> str:
    """What was typed, as one line of a table."""
    return " ".join("".join(c if c.isprintable() else " " for c in text).split())


def _asked_for(request: Request) -> tuple[Session, Throw]:
    session = session_of(request)
    throw = club_of(request).throw(request.path_params["throw"])
    if session is None or throw is None or throw.session_id != session.id:
        raise HTTPException(404, "There is no such throw.")
    return session, throw


SCREEN = Screen(
    name="throws",
    title="Throws",
    routes=[
        Route("/throws", show),
        Route("/throws/films/{film:int}", show_film),
        Route("/throws/films/{film:int}/copy", show_copy),
        Route("/throws/films/{film:int}/copy", make_playable, methods=["POST"]),
        Route("/throws/{session:int}", show),
        Route("/throws/{session:int}/{throw:int}", show_throw),
        Route("/throws/{session:int}/{throw:int}", enter, methods=["POST"]),
        Route("/throws/{session:int}/{throw:int}/track", show_track),
    ],
)
