"""The screen *Stones*: which stones run and curl alike, and which throws would distinguish them."""

from __future__ import annotations

from starlette.requests import Request
from starlette.responses import Response

from agents.app.pages import Screen, club_of, page, session_of
from agents.app.work.causes import believed_ice, causes_of
from agents.coaching.in_words import stones_rows

LEAST_REACH = 0.03
"""The least that a bar of factors reaches to either side."""


def show(request: Request) -> Response:
    """The stones of a session against the set; the latest session without a number."""
    club, session = club_of(request), session_of(request)
    if session is None:
        return page(request, "empty.html", heading="Stones", text="No throws yet.")
    answer = causes_of(club, session, believed_ice(club, session))
    found = None if answer is None else answer.kept.stones
    if answer is None or found is None:
        text, screen = "Stones are compared once throws and ice of a session are known.", "practice"
        if answer is not None:
            why = answer.kept.no_stones.replace("in throws.csv", "on the page Throws")
            text, screen = f"Stones cannot be compared yet: {why}.", "throws"
        return page(
            request, "empty.html", session=session, heading="Stones", text=text, next=screen
        )
    reach = {
        name: max([LEAST_REACH, *(abs(end - 1) for one in factors for end in (one.low, one.high))])
        for name, factors in (
            ("friction", [stone.friction for stone in found.stones]),
            ("curl", [stone.curl for stone in found.stones if stone.curl is not None]),
        )
    }
    return page(
        request,
        "stones.html",
        session=session,
        found=found,
        rows=stones_rows(found),
        reach=reach,
        coming=answer.job,
    )


SCREEN = Screen("stones", "Stones", show)
