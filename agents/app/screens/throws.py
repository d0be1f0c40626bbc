"""The screen *Throws*: what each throw was, beside its film, and what the coach says of it."""

from __future__ import annotations

import mimetypes
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from starlette.concurrency import run_in_threadpool
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import FileResponse, JSONResponse, Response
from starlette.routing import Route

from agents.app.club import Club, Session, Throw
from agents.app.club.club import changed, named_row
from agents.app.club.films import has_other_marks
from agents.app.club.records import Hand
from agents.app.club.session_files import SWEPT, finish_files, note_change
from agents.app.club.targets import with_places
from agents.app.pages import Screen, club_of, film_of, form_of, go_to, page, session_of, text_in
from agents.app.views.film_view import throw_view
from agents.app.views.progress import in_words
from agents.app.views.throws import COLUMNS, sheets_of, throw_numbers
from agents.app.work.film_copy import copy_of, still_of
from agents.app.work.jobs import COPY, requested
from agents.coaching import ThrowSheet, read_call
from agents.coaching.calls import call_error, shown_call, typed_call
from curling_env.errors import InputError
from curling_env.infrastructure.files.reading import parse_json

MADE = {"": None, "made": True, "missed": False}
CHOICES = {"made": [*MADE], "swept": ["", *SWEPT], "hand": [hand.value for hand in Hand]}
"""Values of the fields that are chosen."""
LONGEST = {"called": 300, "note": 5000}
"""Letters of each text that a coach enters."""
ENTRY = ("athlete", "hand", "stone", "called", "made", "swept", "note")
"""Fields of a coach's entry."""
COLOURS = 6
"""Number of colours for athletes."""


def show(request: Request) -> Response:
    """The throws of a session; the latest session without a number.

    `?athlete=NAME` shows the throws of one athlete.
    """
    club, session = club_of(request), session_of(request)
    throws = [] if session is None else club.throws(session)
    if session is None or not throws:
        text = "No throws yet: drop films on the page Practice, or start a camera there."
        return page(request, "empty.html", session=session, heading="Throws", text=text)
    sheets = {sheet.throw: sheet for sheet in sheets_of(club, session)}
    chosen = request.query_params.get("athlete", "")
    rows = [
        {
            "throw": one,
            "sheet": sheets[one.number],
            "numbers": throw_numbers(sheets[one.number]),
            "entry": entry_of(one),
        }
        for one in throws
        if one.number in sheets and chosen in ("", sheets[one.number].athlete)
    ]
    athletes = sorted({sheet.athlete for sheet in sheets.values() if sheet.athlete})
    waiting = [film for film in club.films(session) if has_other_marks(club, session, film)]
    return page(
        request,
        "throws.html",
        session=session,
        rows=rows,
        columns=COLUMNS,
        athletes=athletes,
        chosen=chosen,
        unseen=len(throws) - len(sheets),
        waiting=len(waiting),
        known_athletes=club.athletes(),
        known_stones=club.stones(),
        rests=[_rest(row["sheet"], athletes) for row in rows if row["sheet"].measures.rests],
    )


def show_throw(request: Request) -> Response:
    """One throw: film, speed, numbers, and the coach's entry; its neighbours are of `?athlete=`."""
    club = club_of(request)
    session, throw = _asked_for(request)
    sheet = next((one for one in sheets_of(club, session) if one.throw == throw.number), None)
    chosen = request.query_params.get("athlete", "")
    throws = [
        one for one in club.throws(session) if chosen in ("", one.athlete) or one.id == throw.id
    ]
    place = next(k for k, one in enumerate(throws) if one.id == throw.id)
    film = club.film(throw.film_id)
    return page(
        request,
        "throw_film.html",
        session=session,
        throw=throw,
        sheet=sheet,
        words="" if sheet is None else in_words(sheet),
        numbers=[] if sheet is None else [k for k in throw_numbers(sheet) if k.value],
        film=film,
        waiting=film is not None and has_other_marks(club, session, film),
        copied=film is not None and copy_of(club, film).exists(),
        entry=entry_of(throw),
        swept=SWEPT,
        athletes=club.athletes(),
        stones=club.stones(),
        reading=reading_of(club, throw.called),
        targets=club.targets(),
        chosen=chosen,
        before=throws[place - 1] if place else None,
        after=throws[place + 1] if place + 1 < len(throws) else None,
        rests=[] if sheet is None or not sheet.measures.rests else [_rest(sheet, [])],
    )


def read(request: Request) -> Response:
    """Answer how a call is read, while it is typed."""
    text = typed_call(request.query_params.get("text", "")[:400])
    return JSONResponse(reading_of(club_of(request), text))


def reading_of(club: Club, called: str) -> dict[str, Any]:
    """A call in words and where it is to rest; or the word that is not known."""
    text = with_places(called, club.named_targets())
    call = read_call(text)
    if call is None:
        return {"words": "", "problem": call_error(text) if text.strip() else "", "target": None}
    return {"words": f"Read as: {call.in_words()}.", "problem": "", "target": call.target}


def _rest(sheet: ThrowSheet, athletes: Sequence[str]) -> dict[str, Any]:
    """Resting place of a stone from the thrower's view, and its line of delivery."""
    one = sheet.measures
    assert one.right is not None  # it was seen to rest
    assert one.past is not None
    team = athletes.index(sheet.athlete) if sheet.athlete in athletes else -1
    return {
        "number": sheet.throw + 1,
        "athlete": sheet.athlete,
        "colour": team % COLOURS if team >= 0 else "none",
        "right": round(one.right.value, 3),
        "past": round(one.past.value, 3),
        "broom": None if one.line is None else round(one.line.value, 3),
        "target": None if sheet.call is None else sheet.call.target,
    }


def show_track(request: Request) -> Response:
    """The throw's speed and its path in the picture, for the page's script."""
    session, throw = _asked_for(request)
    found = throw_view(club_of(request), session, throw)
    if found is None:
        raise HTTPException(404, "The track of this throw is missing; track its film again.")
    return JSONResponse(found)


def show_film(request: Request) -> Response:
    """A film, or the part of it that the browser asks for."""
    film, _ = film_of(request)
    return _sent(club_of(request).path(film.file))


def show_copy(request: Request) -> Response:
    """The copy of a film that browsers play, or a part of it."""
    film, _ = film_of(request)
    return _sent(copy_of(club_of(request), film))


def show_still(request: Request) -> Response:
    """A small picture of a film; nothing for one that cannot be read."""
    film, _ = film_of(request)
    try:
        path = still_of(club_of(request), film)
    except InputError:
        return Response(status_code=204)
    return FileResponse(path, headers={"Cache-Control": "private, max-age=86400"})


def _sent(path: Path) -> Response:
    if not path.is_file():
        raise HTTPException(404, "That film does not exist or was removed.")
    kind = mimetypes.guess_type(path.name)[0] or "application/octet-stream"
    if not kind.startswith("video/"):
        kind = "application/octet-stream"
    return FileResponse(path, media_type=kind, headers={"Cache-Control": "private, max-age=3600"})


def make_playable(request: Request) -> Response:
    """Ask for a copy that browsers play; the work that makes it."""
    film, session = film_of(request)
    return JSONResponse({"job": requested(club_of(request), COPY, session, str(film.id)).id})


async def enter(request: Request) -> Response:
    """A coach's entry: who, which stone, what was called, made or missed, and a note.

    Fields that the form does not have stay as they are, and so do those that it has not changed:
    `was` holds what they were when the form was shown. Where another coach has changed one of
    those that this form changes, nothing of it is saved, and both are shown.
    """
    club, form = club_of(request), await form_of(request)
    session, throw = _asked_for(request)
    given = {name: _line(form[name]) for name in ENTRY if name in form}
    if "called" in given:
        given["called"] = typed_call(given["called"])
    if "note" in given:
        given["note"] = "\n".join(_line(line) for line in form["note"].splitlines())
    for name, choices in CHOICES.items():
        if given.get(name, choices[0]) not in choices:
            raise InputError(f"expected one of {', '.join(filter(None, choices))}", source=name)
    for name, most in LONGEST.items():
        text_in(given, name, most)
    was = parse_json(form.get("was") or "{}", source="was")
    if not isinstance(was, dict):
        raise InputError("expected an object", source="was")
    now = entry_of(throw)
    entered = {name: value for name, value in given.items() if value != was.get(name)}
    theirs = {
        name: now[name]
        for name, value in entered.items()
        if name in was and now[name] != was[name] and now[name] != value
    }
    if theirs:
        words = "; ".join(f"{name} is now “{value or 'empty'}”" for name, value in theirs.items())
        document = {"problem": f"Someone else has changed this: {words}", "now": now}
        if _wants_json(request):
            return JSONResponse(document | {"theirs": theirs}, 409)
        raise HTTPException(409, document["problem"])
    await run_in_threadpool(_keep, club, session, throw, entered)
    if _wants_json(request):
        found = club.throw(throw.id)
        entry = entry_of(throw if found is None else found)
        return JSONResponse({"now": entry, **reading_of(club, entry["called"])})
    return go_to(request, f"throws/{session.id}/{throw.label}")


def _wants_json(request: Request) -> bool:
    return "application/json" in request.headers.get("Accept", "")


def entry_of(throw: Throw) -> dict[str, str]:
    """A coach's entry as the fields of its form."""
    return {
        "athlete": throw.athlete,
        "hand": throw.hand.value,
        "stone": throw.stone,
        "called": shown_call(throw.called),
        "made": next(word for word, value in MADE.items() if value is throw.made),
        "note": throw.note,
        "swept": throw.swept,
    }


def _keep(club: Club, session: Session, throw: Throw, entered: Mapping[str, str]) -> None:
    """Write the fields of an entry that have changed, and the session's files."""
    values: dict[str, object] = {k: entered[k] for k in ("called", "note", "swept") if k in entered}
    if "made" in entered:
        values["made"] = MADE[entered["made"]]
    with club.database.writing() as connection:
        for table in ("athlete", "stone"):
            if table in entered:
                values[f"{table}_id"] = named_row(connection, table, entered[table])
        athlete = values.get("athlete_id", throw.athlete_id)
        if "hand" in entered and athlete is not None:
            query = "update athlete set hand = ? where id = ?"
            connection.execute(query, (entered["hand"], athlete))
            # With another hand the handles of all their throws have other names.
            which = "id in (select session_id from throw where athlete_id = ?)"
            note_change(connection, which, athlete)
        if values:
            changed(connection, "throw", throw.id, **values)
        if "swept" in entered:  # the tracks say it, too
            changed(connection, "session", session.id, stale=1)
        note_change(connection, "id = ?", session.id)
    finish_files(club)


def _line(text: str) -> str:
    """Return typed text as one line of a table."""
    return " ".join("".join(c if c.isprintable() else " " for c in text).split())


def _asked_for(request: Request) -> tuple[Session, Throw]:
    """The session, and its throw by the number that people see."""
    session = session_of(request)
    throws = [] if session is None else club_of(request).throws(session)
    label = request.path_params["throw"]
    throw = next((one for one in throws if one.label == label), None)
    if session is None or throw is None:
        raise HTTPException(404, "That throw does not exist or was removed.")
    return session, throw


SCREEN = Screen(
    "throws",
    "Throws",
    show,
    [
        Route("/throws/read", read),
        Route("/throws/films/{film:int}", show_film),
        Route("/throws/films/{film:int}/copy", show_copy),
        Route("/throws/films/{film:int}/still", show_still),
        Route("/throws/films/{film:int}/copy", make_playable, methods=["POST"]),
        Route("/throws/{session:int}/{throw:int}", show_throw),
        Route("/throws/{session:int}/{throw:int}", enter, methods=["POST"]),
        Route("/throws/{session:int}/{throw:int}/track", show_track),
    ],
)
