"""Removing sessions, films and throws, bringing them back, and deleting them for good."""

from __future__ import annotations

from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route

from agents.app.club import Session
from agents.app.club.records import State
from agents.app.club.removal import KINDS, Kind, bring_back, delete_for_good, remove
from agents.app.pages import club_of, form_of, go_to, number_in, work_of
from agents.app.work.jobs import OPEN
from curling_env.errors import InputError


async def take_away(request: Request) -> Response:
    """Remove what the form names; work on it ends first."""
    kind, number, session = await _named(request)
    if kind == "session":
        _end_work(request, session, "")
    elif kind == "film" and session is not None:
        film = club_of(request).film(number)
        if (
            film is not None
            and film.state is State.RUNNING
            and _end_work(request, session, "track")
        ):
            work_of(request).submit("track", session)  # of the other films
    remove(club_of(request), kind, number)
    return _back(request, session)


async def bring(request: Request) -> Response:
    """Bring back what the form names."""
    kind, number, session = await _named(request)
    bring_back(club_of(request), kind, number)
    if kind == "session":
        return go_to(request, f"practice/{number}")
    return _back(request, session)


async def delete(request: Request) -> Response:
    """Delete what the form names, if it was removed before."""
    kind, number, session = await _named(request)
    delete_for_good(club_of(request), kind, number)
    return _back(request, session)


async def _named(request: Request) -> tuple[Kind, int, Session | None]:
    """Return the thing that a form names, and the session that its page was about."""
    form = await form_of(request)
    kind: Kind | None = next((one for one in KINDS if one == form.get("kind")), None)
    if kind is None:
        raise InputError("expected a session, a film or a throw")
    number = number_in(form.get("id", ""), f"a {kind}")
    page = number if kind == "session" else number_in(form.get("session", ""), "a session")
    return kind, number, club_of(request).session(page)


def _end_work(request: Request, session: Session | None, kind: str) -> bool:
    """End the work on a session, or that of one kind; whether there was any."""
    work = work_of(request)
    jobs = [] if session is None else work.jobs(session)
    ended = [job for job in jobs if job.state in OPEN and kind in ("", job.kind)]
    for job in ended:
        work.cancel(job.id)
    return bool(ended)


def _back(request: Request, session: Session | None) -> Response:
    there = None if session is None else club_of(request).session(session.id)
    return go_to(request, f"practice{'' if there is None else f'/{there.id}'}#removed")


REMOVING = [
    Route("/practice/remove", take_away, methods=["POST"]),
    Route("/practice/bring-back", bring, methods=["POST"]),
    Route("/practice/delete", delete, methods=["POST"]),
]
