"""The screen *Hand or ice?*: parts of a miss due to the release and to misread ice."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

import numpy as np
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route

from agents.app.club import Club, Session
from agents.app.club.planned_ice import believed_ice, earlier_sessions
from agents.app.pages import club_of, number_in, page, session_of
from agents.app.screens.screen import Screen
from agents.app.work.causes import causes_of
from agents.coaching import Part, Pattern, SessionCauses, ThrowCauses
from agents.coaching.misses.causes import CAUSES, INTERVAL
from curling_env.sheet import Direction, to_sheet
from curling_env.units import side
from friction_estimation.tracks.measured import Measured

TITLES = {
    "weight": "Weight",
    "line": "Line",
    "rotation": "Rotation",
    "ice": "Ice read wrong",
    "sweeping": "Sweeping",
    "neither": "Neither explains",
}
LEADS = {
    "weight": "Most was lost by the weight",
    "line": "Most was lost by the line",
    "rotation": "Most was lost by the rotation",
    "ice": "Most was lost because the ice was read wrong",
    "sweeping": "Most was lost by the sweeping",
    "neither": "Neither hand nor ice explains most of it",
}
EITHER = "goes either way"
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
        text = "Why throws missed is shown once the throws and the ice of the session are known."
        return page(request, "empty.html", session=session, heading=heading, text=text)
    found = answer.kept.found
    athlete = request.query_params.get("athlete", "")
    patterns = {pattern.athlete: pattern for pattern in found.athletes}
    if athlete and athlete not in patterns:
        raise HTTPException(404, "Nobody of that name has thrown to a called target here.")
    shown = [one for one in found.throws if not athlete or one.athlete == athlete]
    chosen = _chosen(request, shown)
    there = {one.number for one in club.throws(session)}
    return page(
        request,
        "hand_or_ice.html",
        session=session,
        heading=heading,
        coming=answer.job,
        titles={cause: TITLES[cause] for cause in CAUSES if _has(found, cause)},
        pattern=_pattern(patterns[athlete] if athlete else found.pattern),
        athletes=sorted(name for name in patterns if name),
        athlete=athlete,
        throws=[_row(one, there) for one in shown],
        chosen=None if chosen is None else _row(chosen, there),
        picture=None if chosen is None else _picture(chosen),
        believed=believed,
        earlier=earlier_sessions(club, session),
        left_out=[(number + 1, why) for number, why in found.left_out.items()],
        remarks=found.remarks,
    )


def _believed(request: Request, club: Club, session: Session) -> Session | None:
    wanted = request.query_params.get("believed")
    if wanted is None:
        return believed_ice(club, session)
    number = number_in(wanted, "a session")
    found = next((one for one in earlier_sessions(club, session) if one.id == number), None)
    if number and found is None:
        raise HTTPException(404, "There is no such earlier ice on this sheet.")
    return found


def _chosen(request: Request, shown: list[ThrowCauses]) -> ThrowCauses | None:
    if "throw" not in request.query_params:
        return max(shown, key=lambda one: one.distance, default=None)
    number = number_in(request.query_params["throw"], "a throw") - 1
    found = next((one for one in shown if one.throw == number), None)
    if found is None:
        raise HTTPException(404, "That throw has no called target, or was not seen to rest.")
    return found


def _has(found: SessionCauses, cause: str) -> bool:
    return any(cause in one.parts for one in found.throws) or cause != "sweeping"


def _row(one: ThrowCauses, there: Collection[int]) -> dict[str, Any]:
    return {
        "number": one.throw + 1,
        "is_there": one.throw in there,
        "athlete": one.athlete,
        "called": one.call.text,
        "miss": _words(Measured(float(one.miss[0]), None), Measured(float(one.miss[1]), None)),
        "distance_m": one.distance,
        "main": one.main,
        "parts": {cause: _part(part) for cause, part in one.parts.items()},
    }


def _part(part: Part) -> dict[str, Any]:
    return {
        "words": _words(part.right, part.past),
        "share": _share(part.share),
        "half": f"± {100 * INTERVAL * (part.share.sigma or 0.0):.0f}",
        "size": part.size,
    }


def _share(share: Measured) -> str:
    return f"{round(100 * share.value)} %".replace("-", "−")


def _words(right: Measured, past: Measured) -> str:
    """Return the direction and size of a part, with its 95 % interval; empty where it is small."""
    told: list[str] = []
    for one, words in ((past, "past"), (right, "right")):
        if abs(one.value) < SMALL:
            continue
        half = "" if one.sigma is None else f" ± {100 * INTERVAL * one.sigma:.0f}"
        length = side(one.value, right=words).replace("past", "long")
        told.append(f"{length}{half}")
    return ", ".join(told)


def _pattern(pattern: Pattern | None) -> dict[str, Any] | None:
    if pattern is None:
        return None
    rows: list[dict[str, Any]] = []
    for cause in CAUSES:
        if cause not in pattern.shares:
            continue
        share, (right, past) = pattern.shares[cause], pattern.mean[cause]
        rows.append(
            {
                "cause": cause,
                "title": TITLES[cause],
                "share": _share(share),
                "half": f"± {100 * INTERVAL * (share.sigma or 0.0):.0f}",
                "width": max(100 * share.value, 0.0),
                "mean": _words(right, past) or EITHER,
            }
        )
    main = max(rows, key=lambda row: row["width"])
    begin = 0.0
    for row in rows:
        row["x"] = begin
        begin += row["width"]
    return {
        "throws": pattern.throws,
        "miss": f"{pattern.typical_miss:.2f} m",
        "rows": rows,
        "whole": max(begin, 1.0),
        "lead": f"{LEADS[main['cause']]}, on average {main['mean']}."
        if main["mean"] != EITHER
        else f"{LEADS[main['cause']]}, to either side.",
    }


def _picture(one: ThrowCauses) -> dict[str, Any]:
    """The way from the target to the rest, cause by cause, sheet frame."""
    direction = Direction.AWAY
    place = one.target.copy()
    steps: list[dict[str, Any]] = []
    for cause in CAUSES:
        part = one.parts.get(cause)
        if part is None:
            continue
        after = place + np.array([part.right.value, part.past.value])
        ends = [to_sheet(place, direction), to_sheet(after, direction)]
        steps.append(
            {
                "kind": f"cause {cause}",
                "x": [round(float(end[0]), 3) for end in ends],
                "y": [round(float(end[1]), 3) for end in ends],
            }
        )
        place = after
    target, rest = (to_sheet(xy, direction) for xy in (one.target, one.rest))
    return {
        "steps": steps,
        "target": {"x": round(float(target[0]), 3), "y": round(float(target[1]), 3)},
        "rest": {"x": round(float(rest[0]), 3), "y": round(float(rest[1]), 3)},
    }


SCREEN = Screen(
    name="hand-or-ice",
    title="Hand or ice?",
    routes=[Route("/hand-or-ice", show), Route("/hand-or-ice/{session:int}", show)],
)
