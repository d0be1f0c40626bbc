"""The screen *Hand or ice?*: parts of a miss due to the release and to misread ice."""

from __future__ import annotations

from typing import Any

import numpy as np
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import Response

from agents.app.club import Club, Session
from agents.app.pages import Screen, club_of, number_in, page, session_of
from agents.app.sheet.choices import centre_of_session
from agents.app.sheet.forms import rounded
from agents.app.work.causes import believed_ice, causes_of, earlier_sessions
from agents.coaching import Pattern, ThrowCauses
from agents.coaching.draw_weight import compared_in_words
from agents.coaching.in_words import CAUSE_WORDS, offset, part_in_words
from agents.coaching.misses.causes import CAUSES, INTERVAL, Cause
from curling_env.sheet import Direction, to_sheet
from curling_env.typing import Floats

LEADS = {
    **{cause: f"{cause.capitalize()} cost the most" for cause in ("weight", "line", "rotation")},
    "ice": "Misread ice cost the most",
    "sweeping": "Sweeping cost the most",
    "neither": "Neither hand nor ice explains most of the misses",
}
SMALL = 0.05
"""A shorter part is not shown [m]."""


def show(request: Request) -> Response:
    """Show why the throws of a session missed; the latest session without a number.

    `?believed=NUMBER` says whose ice the team planned with (0: not known), `?athlete=NAME`
    whose throws are shown, and `?throw=NUMBER` which of them is drawn.
    """
    club, session = club_of(request), session_of(request)
    heading = "Hand or ice?"
    if session is None:
        return page(request, "empty.html", heading=heading, text="No throws yet.")
    believed = _believed(request, club, session)
    answer = causes_of(club, session, believed)
    if answer is None:
        text = "Causes of misses are shown once the throws and the ice of the session are known."
        return page(request, "empty.html", session=session, heading=heading, text=text)
    found = answer.kept.found
    athlete = request.query_params.get("athlete", "")
    patterns = {pattern.athlete: pattern for pattern in found.athletes}
    if athlete and athlete not in patterns:
        raise HTTPException(
            404, "No athlete of that name has thrown to a called target in this session."
        )
    shown = [one for one in found.throws if not athlete or one.athlete == athlete]
    chosen = _chosen(request, shown)
    there = {one.number for one in club.throws(session)}
    causes: list[Cause] = [
        c for c in CAUSES if c != "sweeping" or any(c in one.parts for one in found.throws)
    ]
    return page(
        request,
        "hand_or_ice.html",
        session=session,
        heading=heading,
        coming=answer.job,
        titles={cause: CAUSE_WORDS[cause].capitalize() for cause in causes},
        pattern=_pattern(patterns[athlete] if athlete else found.pattern),
        athletes=sorted(name for name in patterns if name),
        athlete=athlete,
        throws=[_row(one, there) for one in shown],
        longest=max((sum(p.size for p in one.parts.values()) for one in shown), default=1.0),
        chosen=None if chosen is None else _row(chosen, there),
        picture=None if chosen is None else _picture(chosen),
        compared=believed
        and compared_in_words(*(centre_of_session(club, one) for one in (session, believed))),
        believed=believed,
        earlier=earlier_sessions(club, session),
        found=found,
        small=SMALL,
    )


def _believed(request: Request, club: Club, session: Session) -> Session | None:
    wanted = request.query_params.get("believed")
    if wanted is None:
        return believed_ice(club, session)
    number = number_in(wanted, "a session")
    found = next((one for one in earlier_sessions(club, session) if one.id == number), None)
    if number and found is None:
        raise HTTPException(
            404, "That session has no earlier ice of this sheet; choose one from the list."
        )
    return found


def _chosen(request: Request, shown: list[ThrowCauses]) -> ThrowCauses | None:
    if "throw" not in request.query_params:
        return max(shown, key=lambda one: one.distance, default=None)
    number = number_in(request.query_params["throw"], "a throw") - 1
    found = next((one for one in shown if one.throw == number), None)
    if found is None:
        raise HTTPException(404, "That throw has no called target, or was not seen to rest.")
    return found


def _row(one: ThrowCauses, there: set[int]) -> dict[str, Any]:
    parts = {
        cause: {
            "words": part_in_words(part) if part.size >= SMALL else "",
            "size": part.size,
            "share": part.share.value,
            "half": INTERVAL * (part.share.sigma or 0.0),
        }
        for cause, part in one.parts.items()
    }
    miss = offset(*one.miss.tolist()) if one.distance >= SMALL else ""
    return {"throw": one, "is_there": one.throw in there, "miss": miss, "parts": parts}


def _pattern(pattern: Pattern | None) -> dict[str, Any] | None:
    """The pattern of throws, with the places of its causes in a bar of all of them."""
    if pattern is None:
        return None
    rows: list[dict[str, Any]] = []
    begin = 0.0
    for cause, share in sorted(pattern.shares.items(), key=lambda one: CAUSES.index(one[0])):
        right, past = (way.value for way in pattern.mean[cause])
        width = max(100 * share.value, 0.0)
        rows.append(
            {
                "cause": cause,
                "share": share.value,
                "half": INTERVAL * (share.sigma or 0.0),
                "x": begin,
                "width": width,
                "mean": offset(right, past) if np.hypot(right, past) >= SMALL else "",
            }
        )
        begin += width
    main = max(rows, key=lambda row: row["width"])
    usual = f"on average {main['mean']}" if main["mean"] else "with no usual side"
    lead = f"{LEADS[main['cause']]}, {usual}."
    return {"found": pattern, "rows": rows, "whole": max(begin, 1.0), "lead": lead}


def _picture(one: ThrowCauses) -> dict[str, Any]:
    """The way from the target to the rest, cause by cause, sheet frame."""

    def on_sheet(place: Floats) -> list[float]:
        return rounded(to_sheet(place, Direction.AWAY))

    place = one.target.copy()
    steps: list[dict[str, Any]] = []
    for cause in CAUSES:
        part = one.parts.get(cause)
        if part is None:
            continue
        after = place + np.array([part.right.value, part.past.value])
        x, y = zip(on_sheet(place), on_sheet(after), strict=True)
        steps.append({"kind": f"cause {cause}", "x": x, "y": y})
        place = after
    target, rest = (dict(zip("xy", on_sheet(k), strict=True)) for k in (one.target, one.rest))
    return {"steps": steps, "target": target, "rest": rest}


SCREEN = Screen("hand-or-ice", "Hand or ice?", show)
