"""A throw on an ice: the paths of all stones that it moves, and its times."""

from __future__ import annotations

from typing import Any

import numpy as np

from agents.app.sheet.forms import RunForm, places_of, rounded
from agents.planning.description import Description, describe
from agents.planning.request import check_stones
from curling_env.ice import Ice
from curling_env.physics.engine import Engine, Outcome, StoneState
from curling_env.sheet import TEE_Y, Direction, tee
from curling_env.throw import FROM_HOG_LINE, Throw
from curling_env.trajectory import Trajectory
from curling_env.typing import Floats
from curling_env.units import brooms

FPS = 12.0
"""Samples a second of a path: the page draws straight lines between them."""
ENDS = {
    "rest": "comes to rest",
    "out_side": "touches the side line",
    "out_back": "runs over the back line",
    "hogged": "stops before the hog line",
}


def run(ice: Ice, form: RunForm) -> dict[str, Any]:
    """Throw a stone among others.

    Parameters
    ----------
    ice : the ice
    form : what was asked

    Raises
    ------
    InputError : stones that cannot lie there, a throw that cannot be, ice on which a stone never
        stops
    """
    return thrown(ice, form.throw.throw, places_of(form.stones), Direction[form.to.upper()])


def thrown(
    ice: Ice,
    throw: Throw,
    stones: Floats,
    direction: Direction,
    *,
    sweep: tuple[float, float] | None = None,
) -> dict[str, Any]:
    """A throw without error among stones (k, 2), as the page draws it."""
    check_stones(ice, stones)
    # With a separate identifier, which is none of the stones that a session knew.
    outcome = Engine(ice).play(
        throw.release(direction, stone=len(stones), sweep=sweep or (0.0, 0.0)),
        [StoneState(x=x, y=y, stone=k) for k, (x, y) in enumerate(stones.tolist())],
        fps=FPS,
    )
    rest = np.array([outcome.delivered.x, outcome.delivered.y])
    status = outcome.delivered_status
    call = describe(ice, throw, tee(direction), direction)
    return {
        "throw": throw_document(throw),
        "to": direction.name.lower(),
        "weight_s": call.hog_to_hog_s,
        "time_s": round(outcome.time, 2),
        "rest": {"x": round(float(rest[0]), 4), "y": round(float(rest[1]), 4)},
        "in_play": status.in_play,
        "ends": ENDS[status.value],
        "call": call_document(call, throw, direction),
        "paths": paths_of(outcome),
        "stones": [
            {"x": round(s.x, 4), "y": round(s.y, 4)} if state.in_play else None
            for s, state in zip(outcome.stones[:-1], outcome.status, strict=False)
        ],
        "contacts": len(outcome.contacts),
    }


def throw_document(throw: Throw) -> dict[str, float]:
    """A throw with the digits that games keep."""
    return {
        "speed": round(throw.speed, 5),
        "angle": round(throw.angle, 5),
        "spin": round(throw.spin, 5),
    }


def call_document(call: Description, throw: Throw, direction: Direction) -> dict[str, Any]:
    """A throw as a skip calls it, and where the broom is drawn."""
    broom = call.broom_m
    return {
        "hog_to_hog_s": None if call.hog_to_hog_s is None else round(call.hog_to_hog_s, 2),
        "broom": {"x": round(direction * broom, 4), "y": direction * TEE_Y},
        "broom_m": round(broom, 3),
        "ice_m": round(call.ice_m, 3),
        "ice_in_brooms": brooms(call.ice_m),
        "ice_side": "right" if call.ice_on_the_right else "left",
        "turns": round(call.turns, 1),
        "turns_way": "counter-clockwise" if throw.spin > 0 else "clockwise",
        "right_hander": call.right_hander,
        "left_hander": call.left_hander,
        "from": {"x": 0.0, "y": round(-direction * FROM_HOG_LINE.line_y, 4)},
        "sentence": call.call_in(),
    }


def paths_of(outcome: Outcome) -> list[dict[str, Any]]:
    """The paths of the stones that moved; `stone` is null for the thrown one."""
    last = len(outcome.stones) - 1
    return [
        {
            "stone": None if k == last else k,
            "status": outcome.status[k].value,
            **_samples(path),
        }
        for k, path in zip(outcome.moved, outcome.trajectories, strict=True)
    ]


def _samples(path: Trajectory) -> dict[str, Any]:
    return {
        "t": rounded(path.t, 2),
        "x": rounded(path.xy[:, 0]),
        "y": rounded(path.xy[:, 1]),
        "theta": rounded(path.theta, 2),
    }
