"""The screen *Athletes*: bias and spread of each, over sessions, and a report of one to send."""

from __future__ import annotations

from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import FileResponse, Response
from starlette.routing import Route

from agents.app.pages import Screen, club_of, page, session_of
from agents.app.views.hands import hands_of
from agents.app.work.causes import ComingError, errors_of, sessions_with_causes
from agents.app.work.jobs import REPORT, requested
from agents.app.work.report import report_path

POLICY = (
    "default-src 'none'; style-src 'unsafe-inline'; img-src data:; media-src data:; "
    "frame-ancestors 'none'"
)
"""Content security policy of a report: it holds all that it shows."""


def show(request: Request) -> Response:
    """Show how the club's athletes throw, over the latest sessions."""
    club, session = club_of(request), session_of(request)
    sessions = sessions_with_causes(club)
    errors, coming = errors_of(club, sessions)
    named = [one for one in errors if one.name]
    if not named:
        text = (
            "Two throws with a called target show how an athlete throws. Enter who threw, and what "
            "was called, on the page Throws."
        )
        return page(
            request, "empty.html", session=session, heading="Athletes", text=text, next="throws"
        )
    return page(
        request,
        "athletes.html",
        session=session,
        sessions=len(sessions),
        coming=coming[0] if coming else None,
        athletes=hands_of(club, sessions, named),
    )


def report(request: Request) -> Response:
    """Show an athlete's evening as one file with clips, which is made when someone asks for it.

    Raises
    ------
    ComingError : it is being made
    """
    club, session = club_of(request), session_of(request)
    number = request.path_params["athlete"]
    athlete = next((one for one in club.athletes() if one.id == number), None)
    if session is None or athlete is None:
        raise HTTPException(404, f"Athlete {number} does not exist in this session of the club.")
    path = report_path(club, session, athlete)
    if not path.exists():
        raise ComingError([requested(club, REPORT, session, str(number))])
    kind = "attachment" if "save" in request.query_params else "inline"
    return FileResponse(
        path,
        media_type="text/html",
        filename=f"{athlete.name}, {session.day}.html",
        content_disposition_type=kind,
        headers={"Content-Security-Policy": POLICY},
    )


REPORT_ADDRESS = Route("/athletes/{session:int}/{athlete:int}/report", report)
SCREEN = Screen("athletes", "Athletes", show, [REPORT_ADDRESS])
