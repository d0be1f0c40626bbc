"""The screen *Throws*: what each throw was, beside its film."""

from __future__ import annotations

from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route

from agents.app.pages import page, session_of
from agents.app.screens.screen import Screen


def show(request: Request) -> Response:
    """The throws of a session; the latest session without a number."""
    session = session_of(request)
    if session is None:
        return page(request, "empty.html", heading="Throws", text="Nobody has thrown yet.")
    return page(request, "throws.html", session=session)


SCREEN = Screen(
    name="throws",
    title="Throws",
    routes=[Route("/throws", show), Route("/throws/{session:int}", show)],
)
