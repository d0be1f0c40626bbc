"""The closed loop: hidden ice, practice, its estimate, and throws planned on the estimate.

Every throw is planned with four levels of knowledge of the same hidden ice and then made on it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from agents.planning import Plan, plan_throw
from curling_env.envs.sheet.reward import MAX_MISS
from curling_env.ice import Ice
from curling_env.physics.slides import play_bounds, slide
from curling_env.sheet import TEE_Y
from curling_env.throw import Release, Throw, skill_named
from curling_env.typing import Floats
from friction_estimation import estimate_ice
from measures.hidden_ice import (
    HiddenIce,
    draw_hidden_ice,
    mixed_practice,
    noisy_track,
)

KNOWLEDGE = ("uniform", "map", "map and effects", "truth")
"""Ices to plan on: one friction, the estimated map, map and effects, the true ice."""
SKILL = "elite"
Request = tuple[str, tuple[float, float]]
"""A task and its mark, sheet frame [m]."""


@dataclass(frozen=True, kw_only=True)
class ClosedLoop:
    """Mean misses of planned throws on one hidden ice.

    Parameters
    ----------
    exact, with_error : for each kind of knowledge (n,) mean miss of each planned throw, made
        without and with execution error [m]
    """

    exact: dict[str, Floats]
    with_error: dict[str, Floats]

    @property
    def excess(self) -> float:
        """Mean miss with execution error, planned on map and effects, over that on the truth."""
        return float(self.with_error["map and effects"].mean() / self.with_error["truth"].mean())

    @property
    def gain(self) -> float:
        """Mean miss without execution error, planned on one friction, over map and effects."""
        return float(self.exact["uniform"].mean() / self.exact["map and effects"].mean())


def run_loop(
    seed: int,
    *,
    effects: bool = True,
    draws: int = 10,
    guards: int = 5,
    takeouts: int = 5,
    trials: int = 24,
) -> ClosedLoop:
    """Run the whole loop on one hidden ice, with 20 practice throws measured to 5 mm.

    Parameters
    ----------
    seed : seed of the ice, the practice, the noise, the requests and the execution errors
    effects : whether the hidden ice has effects
    draws, guards, takeouts : number of planned throws of each kind
    trials : executions with error of each planned throw
    """
    ice_rng, practice_rng, camera_rng, request_rng, error_rng = (
        np.random.default_rng(s) for s in np.random.SeedSequence(seed).spawn(5)
    )
    hidden = draw_hidden_ice(ice_rng, effects=effects)
    releases = mixed_practice(20, practice_rng)
    tracks = [noisy_track(hidden, release, k, camera_rng) for k, release in enumerate(releases)]
    ices = {
        "uniform": estimate_ice(tracks, uniform=True).ice,
        "map": estimate_ice(tracks, effects="none").ice,
        "map and effects": estimate_ice(tracks, seed=seed).ice,
        "truth": hidden.truth(),
    }
    requests = _requests(request_rng, draws, guards, takeouts)
    errors = skill_named(SKILL).errors(trials, error_rng)
    exact: dict[str, Floats] = {}
    with_error: dict[str, Floats] = {}
    for knowledge, ice in ices.items():
        plans = [_plan(ice, request, seed) for request in requests]
        exact[knowledge] = np.array(
            [misses(hidden, ice, planned, np.zeros((1, 3))).mean() for planned in plans]
        )
        with_error[knowledge] = np.array(
            [misses(hidden, ice, planned, errors).mean() for planned in plans]
        )
    return ClosedLoop(exact=exact, with_error=with_error)


def _requests(rng: np.random.Generator, draws: int, guards: int, takeouts: int) -> list[Request]:
    """Return draws anywhere in the house, guards in front of it, and takeouts in the house."""

    def in_house() -> tuple[float, float]:
        radius, turn = 1.5 * np.sqrt(rng.random()), 2 * np.pi * rng.random()
        return float(radius * np.cos(turn)), float(TEE_Y + radius * np.sin(turn))

    def in_front() -> tuple[float, float]:
        return float(rng.uniform(-0.9, 0.9)), float(TEE_Y - rng.uniform(2.4, 4.2))

    return [
        *(("draw", in_house()) for _ in range(draws)),
        *(("guard", in_front()) for _ in range(guards)),
        *(("takeout", in_house()) for _ in range(takeouts)),
    ]


def _plan(ice: Ice, request: Request, seed: int) -> Plan:
    """Plan a request; draws and guards should rest at their marks."""
    task, mark = request
    if task == "takeout":
        return plan_throw(ice, task, mark, skill=SKILL, seed=seed)
    return plan_throw(ice, mark, skill=SKILL, seed=seed)


def misses(hidden: HiddenIce, assumed: Ice, planned: Plan, errors: Floats) -> Floats:
    """Return the misses of a planned throw on the hidden ice, (n,) [m].

    Of a throw that should rest, the distance from the target; of a hit, how far beside the planned
    line it passes the stone that it should hit.

    Parameters
    ----------
    assumed : ice that the plan was made on
    errors : (n, 3) errors of speed [m/s], angle [rad] and spin [rad/s]
    """
    throw, found = planned.best.throw, list[float]()
    for speed, angle, spin in errors:
        made = Throw(
            speed=max(throw.speed + float(speed), 0.05),
            angle=throw.angle + float(angle),
            spin=throw.spin + float(spin),
            x=throw.x,
        ).release(planned.direction)
        if planned.objective.comes_to_rest:
            off = hidden.path(made)[-1, :2] - planned.target
            found.append(min(float(np.hypot(*off)), MAX_MISS))
        else:
            found.append(_distance_beside(hidden, assumed, made, planned))
    return np.array(found)


def _distance_beside(hidden: HiddenIce, assumed: Ice, release: Release, planned: Plan) -> float:
    """Distance from the planned line at which a hit passes its stone [m].

    For a throw that stops before it, the whole distance to the stone.
    """
    height = float(planned.target[1]) * planned.direction
    path = hidden.path(release)
    along = planned.direction * path[:, 1]
    if along[-1] < height:
        return float(np.hypot(*(path[-1, :2] - planned.target)))
    line = slide(
        assumed,
        planned.best.throw.release(planned.direction),
        bounds=play_bounds(assumed, planned.direction),
        fps=50,
    ).trajectory
    assert line is not None  # a rate was given
    x = np.interp(height, along, path[:, 0])
    return float(abs(x - np.interp(height, planned.direction * line.xy[:, 1], line.xy[:, 0])))
