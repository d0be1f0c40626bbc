"""The screen *Stones*: which stones run and curl alike, and which throws would tell them apart."""

from __future__ import annotations

from typing import Any

from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route

from agents.app.club.planned_ice import believed_ice
from agents.app.pages import club_of, page, session_of
from agents.app.screens.screen import Screen
from agents.app.views.hands import furthest, interval_bar
from agents.app.work.causes import causes_of
from agents.coaching import StoneFactor, StonePair
from agents.coaching.athletes import Interval
from curling_env.units import short_length

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
        text = "Stones are matched once the throws and the ice of a session are known."
        if answer is not None:
            text = f"These throws do not match stones: {answer.kept.no_stones}."
        return page(request, "empty.html", session=session, heading="Stones", text=text)
    ends = [one.friction.low - 1 for one in found.stones] + [
        one.friction.high - 1 for one in found.stones
    ]
    reach = furthest(ends, LEAST_REACH)
    curls = [one.curl for one in found.stones if one.curl is not None]
    curl_ends = [end - 1 for curl in curls for end in (curl.low, curl.high)]
    curl_reach = furthest(curl_ends, LEAST_REACH)
    return page(
        request,
        "stones.html",
        session=session,
        stones=[_row(one, reach, curl_reach) for one in found.stones],
        pairs=[_pair(pair) for pair in found.pairs],
        undecided=[_pair(pair) for pair in found.undecided],
        more=found.more_throws,
        curls=bool(curls),
        spread=f"{100 * found.spread:.1f} %",
        coming=answer.job,
        left_out=[(number + 1, why) for number, why in found.left_out.items()],
        remarks=found.remarks,
    )


def _row(one: StoneFactor, reach: float, curl_reach: float) -> dict[str, Any]:
    carry, curl = one.carry, one.curl
    words = "like the set"
    if carry.low > 0 or carry.high < 0:
        words = f"{short_length(carry.value)} {'further' if carry.value > 0 else 'shorter'}"
    return {
        "stone": one.stone,
        "throws": one.throws,
        "friction": _per_cent(one.friction),
        "bar": _bar(one.friction, reach),
        "carry": words,
        "carry_range": f"{carry.low:+.2f} to {carry.high:+.2f} m".replace("-", "−"),
        "curl": None if curl is None else _per_cent(curl),
        "curl_bar": None if curl is None else _bar(curl, curl_reach),
    }


def _bar(one: Interval, reach: float) -> dict[str, float]:
    return interval_bar(one.value - 1, one.low - 1, one.high - 1, reach)


def _per_cent(one: Interval) -> tuple[str, str]:
    value, low, high = (100 * (end - 1) for end in one)
    return (
        f"{value:+.1f} %".replace("-", "−"),
        f"{low:+.1f} to {high:+.1f}".replace("-", "−"),
    )


def _pair(pair: StonePair) -> dict[str, Any]:
    return {
        "stones": f"{pair.first} and {pair.second}",
        "friction": _per_cent(pair.friction),
        "curl": None if pair.curl is None else _per_cent(pair.curl),
        "apart": short_length(pair.apart),
        "verdict": pair.verdict,
        "more": pair.more,
    }


SCREEN = Screen(
    name="stones",
    title="Stones",
    routes=[Route("/stones", show), Route("/stones/{session:int}", show)],
)
