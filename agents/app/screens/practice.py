"""The screen *Practice*: sessions, their cameras and films, and the work on them."""

from __future__ import annotations

from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route

from agents.app.pages import club_of, page, session_of
from agents.app.screens.screen import Screen


def show(request: Request) -> Response:
    """A session's films and how far they are; the latest session without a number."""
    session = session_of(request)
    return page(request, "practice.html", session=session, sessions=club_of(request).sessions())


SCREEN = Screen(
    name="practice",
    title="Practice",
    routes=[Route("/practice", show), Route("/practice/{session:int}", show)],
)
