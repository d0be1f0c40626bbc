"""The screen *Ice*: what the ice of a session is like, in a curler's words, on one printed page."""

from __future__ import annotations

import numpy as np
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import Response

from agents.app.club import Club, Session
from agents.app.club.club import digest_of_file
from agents.app.club.session_files import measures_of
from agents.app.pages import Screen, club_of, number_in, page, session_of
from agents.app.screens.practice import CONDITIONS
from agents.app.sheet.choices import centre_of_session, findings_of, ice_of, season_of
from agents.app.sheet.forms import rounded
from agents.app.sheet.ice_sheet import LANE_NAMES, MOSTLY_SEEN, EarlierIce, ice_document
from agents.app.work.causes import earlier_sessions
from agents.app.work.jobs import running
from agents.coaching.measured_ice import change_of_weight, curl_map
from curling_env.errors import InputError

MOST_EARLIER = 5
"""Earlier sessions that today's ice is compared with."""


def show(request: Request) -> Response:
    """The ice of a session; the latest session with one without a number.

    `?against=NUMBER` shows how the map changed since that session, `?hand=left` names handles for a
    left-hander.
    """
    club = club_of(request)
    session = session_of(request)
    if "session" not in request.path_params:
        session = next((s for s in club.sessions() if club.ice_of(s).exists()), session)
    ice = None if session is None else ice_of(club, session)
    if session is None or ice is None:
        text = (
            "No ice is known yet: estimate it from the throws of a session, on the page Practice."
        )
        return page(request, "empty.html", session=session, heading="Ice", text=text)
    trouble, found = "", None
    try:
        found = findings_of(club, session)
    except InputError as error:
        trouble = str(error)
    document = ice_document(ice, earlier=_earlier(club, session), found=found)
    against = None
    if "against" in request.query_params:
        wanted = number_in(request.query_params["against"], "a session")
        against = next((one for one in document["earlier"] if one["id"] == wanted), None)
        if against is None:
            raise HTTPException(
                404, "That session has no earlier ice of this sheet; choose one from the list."
            )
    throws = [measures_of(one.measures) for one in club.throws(session)]
    curl = curl_map(ice.sheet, throws)
    hand = "left" if request.query_params.get("hand") == "left" else "right"
    return page(
        request,
        "ice.html",
        session=session,
        ice=document,
        against=against,
        hand=hand,
        lane_names=LANE_NAMES,
        mostly_seen=MOSTLY_SEEN,
        season=season_of(club, session),
        evening=change_of_weight(throws),
        conditions=CONDITIONS,
        trouble=trouble,
        can_look=club.tracks_of(session).exists(),
        looking=running(club, "discover", session),
        estimating=running(club, "estimate", session),
        stale=session.ice_of not in (None, digest_of_file(club.tracks_of(session))),
        picture={
            "sheet": document["sheet"],
            "radius": document["stone_radius"],
            "cells": document["cells"],
            "seconds": document["seconds_per_share"],
            "change": None if against is None else against["cells"],
            "curl": None
            if curl is None
            else {k: rounded(v) if np.ndim(v) else v for k, v in curl.items()},
        },
    )


def _earlier(club: Club, session: Session) -> list[EarlierIce]:
    """The ices of earlier sessions on the same sheet, the latest first."""
    found: list[EarlierIce] = []
    for other in earlier_sessions(club, session)[:MOST_EARLIER]:
        try:
            ice = ice_of(club, other)
        except InputError:
            continue  # a file that is not whole says so on its own page
        if ice is not None:
            name, centre = f"{other.name}, {other.day}", centre_of_session(club, other)
            found.append(EarlierIce(id=other.id, name=name, ice=ice, centre=centre))
    return found


SCREEN = Screen("ice", "Ice", show)
