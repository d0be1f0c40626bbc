"""The screen *At the rink*: the throw of this moment in large numbers, drills and their scores."""

from __future__ import annotations

from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route

from agents.app.club.club import changed, named_row
from agents.app.club.session_files import SWEPT
from agents.app.pages import Screen, club_of, form_of, go_to, page, session_of, text_in
from agents.app.screens.throws import entry_of, reading_of
from agents.app.views.progress import state_of
from agents.app.views.throws import sheets_of
from agents.app.work.jobs import running
from agents.coaching.calls import shown_call, typed_call
from agents.coaching.scores import ELSEWHERE, HIT, POINTS, leaderboard

LONGEST = 300
"""Letters of a drill's call, and of a list of athletes."""


def show(request: Request) -> Response:
    """Show the latest throw, whose turn is next, and the leaderboard; of `?drill=CALL` alone."""
    club, session = club_of(request), session_of(request)
    if session is None:
        text = "Begin a session on the page Practice, and start a camera there."
        return page(request, "empty.html", heading="At the rink", text=text)
    throws, camera = club.throws(session), club.camera(session.camera_id)
    made = {throw.number: throw.made for throw in throws}
    sheets = sheets_of(club, session)
    drills = list(dict.fromkeys(sheet.note.called for sheet in sheets if sheet.call is not None))
    chosen = request.query_params.get("drill", "")
    return page(
        request,
        "rink.html",
        session=session,
        state=state_of(club, session),
        filming=running(club, "record", session),
        marked=camera is not None and bool(camera.scene),
        latest=throws[-1] if throws else None,
        entry=entry_of(throws[-1]) if throws else {},
        athletes=club.athletes(),
        stones=club.stones(),
        targets=club.targets(),
        swept=SWEPT,
        reading=reading_of(club, session.drill),
        scores=leaderboard(
            (sheet, made[sheet.throw]) for sheet in sheets if chosen in ("", sheet.note.called)
        ),
        drills=drills,
        chosen=chosen,
        drill=shown_call(session.drill),
        rules=(POINTS, ELSEWHERE, HIT),
    )


async def plan(request: Request) -> Response:
    """Enter whose throws come next, in turn, and what is called of them."""
    club, session, form = club_of(request), session_of(request), await form_of(request)
    assert session is not None  # the address names one
    names = [" ".join(name.split()) for name in text_in(form, "lineup", LONGEST).split(",")]
    lineup, drill = ", ".join(filter(None, names)), typed_call(text_in(form, "drill", LONGEST))
    with club.database.writing() as connection:
        for name in filter(None, names):
            named_row(connection, "athlete", name)
        changed(connection, "session", session.id, lineup=lineup, drill=drill)
    return go_to(request, f"rink/{session.id}")


PLAN = Route("/rink/{session:int}", plan, methods=["POST"])
SCREEN = Screen("rink", "At the rink", show, [PLAN])
