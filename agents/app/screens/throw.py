"""The screen *Plan*: a target, a throw by hand, a position and its best call, a game."""

from __future__ import annotations

from collections.abc import Callable
from statistics import median
from typing import Any

from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import JSONResponse, Response
from starlette.routing import Route

from agents.app.club import Club
from agents.app.club.club import named
from agents.app.club.records import Position
from agents.app.club.session_files import finish_files, measures_of
from agents.app.club.targets import keep_target, remove_target
from agents.app.pages import Screen, club_of, document_of, page, session_of
from agents.app.sheet import games, throws
from agents.app.sheet.choices import errors_named, ice_named, ices_of, skill_of, skills_of
from agents.app.sheet.forms import (
    CallsForm,
    GameForm,
    PlanForm,
    PositionNameForm,
    RunForm,
    TargetForm,
    asked,
)
from curling_env.units import side

LEAST_SPLITS = 5
"""Measured splits from which the relation of split and speed is measured."""
USUAL_SPLIT = 7.7
"""The product of split and speed at the hog line on most ice [m]."""


def show(request: Request) -> Response:
    """The sheet, on the ice of a session; the latest session without a number."""
    club, session = club_of(request), session_of(request)
    ices = ices_of(club, session)
    return page(
        request,
        "throw.html",
        session=session,
        ices=[(key, label) for key, label, _ in ices],
        skills=skills_of(club),
        kept=_kept(club),
        sizes=[
            {
                "length": ice.sheet.length,
                "width": ice.sheet.width,
                "radius": ice.stone.radius,
                **_split_of(club, key),
            }
            for key, _, ice in ices
        ],
    )


def _split_of(club: Club, key: str) -> dict[str, Any]:
    """The product of split and speed at the hog line on an ice [m], and if throws measured it."""
    session = club.session(int(key)) if key.isdecimal() else None
    throws = [] if session is None else club.throws(session)
    measured = [measures_of(throw.measures) for throw in throws]
    products = [
        one.back_to_hog.value * one.speed.value
        for one in measured
        if one is not None and one.back_to_hog is not None and one.speed is not None
    ]
    return {
        "split": median(products) if len(products) >= LEAST_SPLITS else USUAL_SPLIT,
        "split_measured": len(products) >= LEAST_SPLITS,
    }


def _plan(club: Club, form: PlanForm) -> dict[str, Any]:
    found = throws.planned(ice_named(club, form.ice), skill_of(club, form.skill), form)
    return found | {"habit": _habit(club, form.skill, found["call"]["hog_to_hog_s"])}


def _habit(club: Club, key: str, seconds: float | None) -> str:
    """Advice against an athlete's usual error; empty for other hands, and where none is seen."""
    errors = errors_named(club, key)
    if errors is None or errors.seconds_per_speed is None or seconds is None:
        return ""
    words: list[str] = []
    (value, low, high), (right, left_end, right_end) = errors.overall.bias[:2]
    if low * high > 0:
        late = -errors.seconds_per_speed * value
        kind = "heavy" if value > 0 else "light"
        words.append(f"usually {abs(late):.1f} s {kind}: aim for {seconds + late:.1f} s")
    if left_end * right_end > 0:
        words.append(f"usually {side(right)}: aim {side(-right)} of the broom")
    return f"{errors.name} is {', and '.join(words)}." if words else ""


def _playing(answer: Callable[..., dict[str, Any]]) -> Callable[[Club, GameForm], dict[str, Any]]:
    """Give a question about a game its ice and the hands of both players."""

    def answered(club: Club, form: GameForm) -> dict[str, Any]:
        hands = skill_of(club, form.skill), skill_of(club, form.opponent_skill)
        return answer(ice_named(club, form.ice), hands, form)

    return answered


def _kept(club: Club) -> dict[str, Any]:
    """Targets and positions that are saved, for JSON."""
    positions = club.database.rows(Position, "select * from position order by name")
    return {
        "targets": [{"id": k.id, "name": k.name, "x": k.x, "y": k.y} for k in club.targets()],
        "positions": [{"id": k.id, "name": k.name, "address": k.address} for k in positions],
    }


def _keep(club: Club, form: TargetForm) -> dict[str, Any]:
    keep_target(club, form.name, form.place.x, form.place.y)
    finish_files(club)  # of sessions whose calls name it
    return _kept(club)


def _keep_position(club: Club, form: PositionNameForm) -> dict[str, Any]:
    query = (
        "insert into position (name, address) values (?, ?) "
        "on conflict (name) do update set address = excluded.address"
    )
    club.database.write(query, named(form.name, "a position"), form.address)
    return _kept(club)


async def forget(request: Request) -> Response:
    """Offer a target or a position no longer."""
    club, number = club_of(request), request.path_params["number"]
    if request.path_params["kind"] == "targets":
        await run_in_threadpool(remove_target, club, number)
    else:
        club.database.write("delete from position where id = ?", number)
    return JSONResponse(_kept(club))


def _answering(name: str, form: type[Any], answer: Callable[[Club, Any], dict[str, Any]]) -> Route:
    """An address that answers JSON with JSON, computed beside the other requests."""

    async def endpoint(request: Request) -> Response:
        wish = asked(await document_of(request), form)
        return JSONResponse(await run_in_threadpool(answer, club_of(request), wish))

    return Route(f"/throw/{name}", endpoint, methods=["POST"])


SCREEN = Screen(
    "throw",
    "Plan",
    show,
    [
        Route("/throw/{kind}/{number:int}/forget", forget, methods=["POST"]),
        _answering("run", RunForm, lambda club, k: throws.run(ice_named(club, k.ice), k)),
        _answering("plan", PlanForm, _plan),
        _answering(
            "calls",
            CallsForm,
            lambda club, k: games.called(ice_named(club, k.ice), skill_of(club, k.skill), k),
        ),
        _answering("game", GameForm, _playing(games.played)),
        _answering("advice", GameForm, _playing(games.advised)),
        _answering("targets", TargetForm, _keep),
        _answering("positions", PositionNameForm, _keep_position),
    ],
)
