"""The throw for a target: how it is thrown, how far it is expected to miss, what errors cost."""

from __future__ import annotations

from typing import Any

import numpy as np

from agents.app.sheet.forms import PlanForm, own_of, places_of, rounded
from agents.app.sheet.runs import call_document, throw_document, thrown
from agents.planning import Plan, PlannedThrow, plan_throw
from agents.planning.error_costs import error_costs
from agents.planning.monte_carlo import Trials
from agents.planning.tuning import SPINS
from curling_env.ice import Ice
from curling_env.throw import Skill
from curling_env.units import short_length

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
    """A plan as the page draws and tells it."""
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
