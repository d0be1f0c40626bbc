"""The screen *Athletes*: bias and spread of each, by handle and weight, over sessions."""

from __future__ import annotations

from typing import Any

from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route

from agents.app.club import Club, Session
from agents.app.club.planned_ice import sessions_with_causes
from agents.app.pages import club_of, page, session_of
from agents.app.screens.screen import Screen
from agents.app.views.coached import errors_of
from agents.app.views.pictures import hand_picture, reach_of
from agents.app.work.causes import ComingError
from agents.coaching import AthleteErrors, ErrorSummary
from agents.coaching.athletes import Interval
from agents.planning.description import seconds_per_speed
from curling_env.ice import Ice, load_ice
from curling_env.physics.aim import Aim
from curling_env.sheet import Direction
from curling_env.throw import Throw


def show(request: Request) -> Response:
    """Show how the club's athletes throw, over the latest sessions."""
    club, session = club_of(request), session_of(request)
    sessions = sessions_with_causes(club)
    errors, coming = errors_of(club, sessions)
    named = [one for one in errors if one.name]
    if not named:
        text = (
            "Enter on the page Throws who threw, and what was called: two throws with a called "
            "target show how an athlete throws."
        )
        return page(request, "empty.html", session=session, heading="Athletes", text=text)
    slope = _seconds_per_speed(load_ice(club.ice_of(sessions[0])))
    reach = reach_of([(one.errors, one.overall) for one in named])
    ids = {one.name: one.id for one in club.athletes()}
    return page(
        request,
        "athletes.html",
        session=session,
        sessions=len(sessions),
        seconds=slope is not None,
        coming=coming[0] if coming else None,
        athletes=[
            {
                "name": one.name,
                "id": ids.get(one.name),
                "sessions": one.sessions,
                "rows": [_row(group, slope) for group in (one.overall, *one.groups)],
                "sentence": _sentence(one, slope),
                "picture": _picture(one, slope, reach),
                "over": _over_sessions(club, one.name, sessions, slope),
            }
            for one in named
        ],
    )


def _seconds_per_speed(ice: Ice) -> float | None:
    """Change of the hog-to-hog time per unit of speed, at draw weight [s per m/s]."""
    speed = Aim(ice, Direction.AWAY).draw_weight()
    return None if speed is None else seconds_per_speed(ice, Throw(speed=speed), Direction.AWAY)


def _row(group: ErrorSummary, slope: float | None) -> dict[str, Any]:
    kind = " ".join(filter(None, (group.handle, group.weight))) or "all throws"
    return {
        "kind": kind,
        "throws": group.throws,
        "weight_bias": _weight(group.bias[0], slope, ("light", "heavy")),
        "weight_spread": _weight(group.spread[0], slope, None),
        "line_bias": _told(group.bias[1], 100, "cm", ("left", "right")),
        "line_spread": _told(group.spread[1], 100, "cm", None),
        "spin_bias": _told(group.bias[2], 1, "rad/s", ("less", "more"), digits=2),
        "spin_spread": _told(group.spread[2], 1, "rad/s", None, digits=2),
    }


def _weight(one: Interval, slope: float | None, words: tuple[str, str] | None) -> tuple[str, str]:
    """A speed as a time from hog line to hog line where that is known."""
    if slope is None:
        return _told(one, 100, "cm/s", words, digits=1)
    return _told(one, abs(slope), "s", words, digits=2)


def _told(
    one: Interval,
    factor: float,
    unit: str,
    words: tuple[str, str] | None,
    *,
    digits: int = 0,
) -> tuple[str, str]:
    """A number in words, and its 95 % interval."""
    value, low, high = (factor * end for end in one)
    if words is None:
        return f"{value:.{digits}f} {unit}", f"{low:.{digits}f} to {high:.{digits}f}"
    told = f"{abs(value):.{digits}f} {unit} {words[int(value > 0)]}"
    if low < 0 < high:
        told = "none seen"
    return told, f"{low:+.{digits}f} to {high:+.{digits}f}".replace("-", "−")


def _sentence(one: AthleteErrors, slope: float | None) -> str:
    """Summary of an athlete's throws, in one sentence."""
    group = _row(one.overall, slope)
    biases = [group[name][0] for name in ("weight_bias", "line_bias")]
    seen = [bias for bias in biases if bias != "none seen"]
    usual = " and ".join(seen) if seen else "neither light nor heavy, neither left nor right"
    return (
        f"On average {usual}; two of three throws within {group['weight_spread'][0]} of that weight"
        f" and {group['line_spread'][0]} of that line."
    )


def _picture(one: AthleteErrors, slope: float | None, reach: tuple[float, float]) -> dict[str, Any]:
    made = hand_picture(one.errors, one.overall, reach)
    speed = float(made["speed"])
    faster = f"{100 * speed:.0f} cm/s" if slope is None else f"{abs(slope) * speed:.2f} s"
    return {**made, "faster": faster}


def _over_sessions(
    club: Club, name: str, sessions: list[Session], slope: float | None
) -> list[dict[str, Any]]:
    """Return the spread of an athlete's weight and line in each session, the latest first."""
    if len(sessions) < 2:
        return []
    rows: list[dict[str, Any]] = []
    for session in sessions:
        try:
            errors, _ = errors_of(club, [session], only_kept=True)
        except ComingError:
            continue
        found = next((one for one in errors if one.name == name), None)
        if found is not None:
            rows.append({"session": f"{session.name}, {session.day}"} | _row(found.overall, slope))
    return rows


SCREEN = Screen(
    name="athletes",
    title="Athletes",
    routes=[Route("/athletes", show), Route("/athletes/{session:int}", show)],
)
