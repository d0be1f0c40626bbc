"""Removing sessions, films and throws, bringing them back, and deleting them for good."""

from __future__ import annotations

from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route

from agents.app.club.records import State
from agents.app.club.removal import KINDS, Kind, bring_back, delete_for_good, remove
from agents.app.pages import club_of, form_of, go_to, number_in, work_of
from agents.app.work.jobs import OPEN
from curling_env.errors import InputError

DEEDS = {"remove": remove, "bring-back": bring_back, "delete": delete_for_good}


async def deal(request: Request) -> Response:
    """Remove what the form names, once the work on it has ended; or bring it back, or delete it."""
    club, form = club_of(request), await form_of(request)
    kind: Kind | None = next((one for one in KINDS if one == form.get("kind")), None)
    if kind is None:
        raise InputError("expected a session, a film or a throw")
    number = number_in(form.get("id", ""), f"a {kind}")
    page = number if kind == "session" else number_in(form.get("session", ""), "a session")
    deed = request.url.path.rpartition("/")[2]
    if deed == "remove" and kind != "throw":
        film = club.film(number) if kind == "film" else None
        if kind == "session" or (film is not None and film.state is State.RUNNING):
            _end_work(request, page, "" if film is None else "track")
    await run_in_threadpool(DEEDS[deed], club, kind, number)
    there = club.session(page)
    return go_to(request, f"practice/{there.id}#removed" if there else "practice#removed")


def _end_work(request: Request, number: int, kind: str) -> None:
    """End the work on a session, or that of one kind, which then goes on with the rest."""
    session, work = club_of(request).session(number), work_of(request)
    jobs = [] if session is None else work.jobs(session)
    ended = [job for job in jobs if job.state in OPEN and kind in ("", job.kind)]
    for job in ended:
        work.cancel(job.id)
    if session is not None and kind and ended:
        work.submit(kind, session)


REMOVING = [Route(f"/practice/{deed}", deal, methods=["POST"], name=deed) for deed in DEEDS]
