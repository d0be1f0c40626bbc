"""A throw on an ice, with the paths of all stones that it moves; and the throw for a target."""

from __future__ import annotations

from typing import Any

import numpy as np

from agents.app.sheet.forms import PlanForm, RunForm, own_of, places_of, rounded
from agents.planning import Plan, PlannedThrow, plan_throw
from agents.planning.description import Description, describe
from agents.planning.error_costs import error_costs
from agents.planning.monte_carlo import Trials
from agents.planning.request import check_stones
from agents.planning.tuning import SPINS
from curling_env.ice import Ice
from curling_env.physics.engine import Engine, Outcome, StoneState
from curling_env.sheet import TEE_Y, Direction, tee
from curling_env.throw import FROM_HOG_LINE, Skill, Throw
from curling_env.trajectory import Trajectory
from curling_env.typing import Floats
from curling_env.units import brooms, short_length

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
    return {
        **call.as_dict(),
        "broom": {"x": round(direction * call.broom_m, 4), "y": direction * TEE_Y},
        "ice_in_brooms": brooms(call.ice_m),
        "ice_side": "right" if call.ice_on_the_right else "left",
        "turns": round(call.turns, 1),
        "turns_way": "counter-clockwise" if throw.spin > 0 else "clockwise",
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


CLOUD = 160
"""Trials that are drawn."""
HIT_CANDIDATES = 8000
"""Throws in the grid for a hit, so that it takes less than a second on one core."""
HALF = 1.1774
"""Standard deviations within which half of a two-dimensional normal distribution lies."""
LEAST_TRIALS = 20
"""Trials in play from which an ellipse is drawn."""


def planned(ice: Ice, skill: Skill, form: PlanForm) -> dict[str, Any]:
    """The best throw for a target.

    Parameters
    ----------
    ice, skill : the ice, and the hand that throws
    form : what was asked

    Raises
    ------
    InputError : no stone can rest there, or no throw gets there
    """
    target, stones = (form.target.x, form.target.y), places_of(form.stones)
    spins = {
        "either": SPINS,
        "clockwise": [spin for spin in SPINS if spin < 0],
        "counter-clockwise": [spin for spin in SPINS if spin > 0],
    }[form.handle]
    if form.hit:
        found = plan_throw(
            ice,
            "takeout",
            target,
            stones=stones,
            own=own_of(form.stones),
            skill=skill,
            spins=spins[:2] if form.handle == "either" else spins[:1],
            candidates=HIT_CANDIDATES,
        )
    else:
        found = plan_throw(ice, target, stones=stones, skill=skill, spins=spins)
    return document(ice, found)


def document(ice: Ice, found: Plan) -> dict[str, Any]:
    """A plan as the page draws and describes it."""
    best, second = found.best, found.second
    return {
        **_one(ice, found, best),
        "target": {"x": float(found.target[0]), "y": float(found.target[1])},
        "second": None if second is None else _one(ice, found, second),
        "skill": {
            "name": found.skill.name,
            "sigma_speed": found.skill.sigma_speed,
            "sigma_angle": found.skill.sigma_angle,
        },
        "remarks": found.remarks,
    }


def _one(ice: Ice, found: Plan, one: PlannedThrow) -> dict[str, Any]:
    run = thrown(ice, one.throw, found.stones, found.direction, sweep=one.sweep)
    trials = one.trials
    return {
        **run,
        "throw": throw_document(one.throw),
        "call": call_document(one.description, one.throw, found.direction),
        "sweep": None if one.sweep is None else [one.sweep[0], min(one.sweep[1], one.time)],
        "expectation": found.expectation(one),
        "chance": round(float(trials.success.mean()), 3),
        "success_means": found.objective.success_means,
        "miss": _misses(found, one),
        "ellipse": _ellipse(trials),
        "cloud": rounded(trials.ends[:: max(len(trials.ends) // CLOUD, 1)], 2),
        "costs": [
            {"words": cost.words(), "rest": rounded(cost.rest), "success": cost.success}
            for cost in error_costs(ice, one.throw, found.objective, sweep=one.sweep)
        ],
    }


def _misses(found: Plan, one: PlannedThrow) -> dict[str, Any] | None:
    """Return the expected miss: in all, by the hand alone and by the ice alone."""
    if found.objective.miss_means is None:
        return None
    nine = float(np.quantile(one.trials.miss, 0.9))
    return {
        "expected_m": round(one.trials.expected_miss, 3),
        "nine_of_ten_m": round(nine, 3),
        "by_the_hand_m": round(one.player_trials.expected_miss, 3),
        "by_the_ice_m": round(one.ice_trials.expected_miss, 3) if found.ice_is_uncertain else None,
        "words": f"{short_length(one.trials.expected_miss)} on average, "
        f"nine of ten within {short_length(nine)}",
    }


def _ellipse(trials: Trials) -> dict[str, float] | None:
    """The ellipse that holds half of the trials in play, sheet frame [m, degrees]."""
    rested = trials.ends[trials.in_play]
    if len(rested) < LEAST_TRIALS:
        return None
    values, axes = np.linalg.eigh(trials.covariance)
    long, short = HALF * np.sqrt(np.maximum(values[::-1], 0.0))
    x, y = rested.mean(axis=0)
    turn = float(np.degrees(np.arctan2(axes[1, 1], axes[0, 1])))
    return {
        "x": round(float(x), 4),
        "y": round(float(y), 4),
        "rx": round(float(long), 4),
        "ry": round(float(short), 4),
        "turn": round(turn, 2),
    }
