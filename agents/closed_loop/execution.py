"""Planned throws carried out on the hidden ice, alone or into other stones."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np

from agents.closed_loop.hidden_ice import HiddenIce
from agents.closed_loop.integrator import comes_to_rest, run_stone
from agents.planning import Plan
from agents.planning.rollouts import Rollouts
from curling_env.ice import Ice
from curling_env.physics.batch import play_batch
from curling_env.physics.engine import is_hogged
from curling_env.physics.slides import SlideEnd, play_bounds, slide
from curling_env.sheet import Direction
from curling_env.throw import Release, Throw
from curling_env.typing import Flags, Floats


@dataclass(frozen=True, kw_only=True)
class ExecutedThrows:
    """The outcome of n throws that were planned on one ice and made on another.

    Parameters
    ----------
    miss : (n,) for a throw that should rest, its distance from the target; for a hit, how far
        beside the planned line it passes the stone that it should hit [m]
    success : (n,) whether the task was done
    ends : (n, 2) where the thrown stones ended, sheet frame [m]
    """

    miss: Floats
    success: Flags
    ends: Floats


def execute_plan(
    hidden: HiddenIce, truth: Ice, assumed: Ice, plan: Plan, errors: Floats
) -> ExecutedThrows:
    """Make a plan's throw on the hidden ice, once for each execution error.

    A stone slides by `integrator.run_stone` until it meets another; from there the batch engine
    moves the stones over the true ice.

    Parameters
    ----------
    hidden, truth : the hidden ice, and the same ice in cells
    assumed : ice that the plan was made on
    errors : (n, 3) errors of speed [m/s], angle [rad] and spin [rad/s]
    """
    objective, throw = plan.objective, plan.best.throw
    outcomes: list[Rollouts] = []
    beside: list[float] = []
    for error in errors:
        made = Throw(
            speed=max(throw.speed + float(error[0]), 0.05),
            angle=throw.angle + float(error[1]),
            spin=throw.spin + float(error[2]),
            x=throw.x,
        )
        release = made.release(objective.direction)
        outcomes.append(_play(hidden, truth, release, objective.stones, objective.direction))
        if not objective.comes_to_rest:
            beside.append(_distance_beside(hidden, assumed, release, plan))
    ended = Rollouts(
        **{f.name: np.concatenate([getattr(r, f.name) for r in outcomes]) for f in fields(Rollouts)}
    )
    judged = objective.judge(ended, truth.stone.radius)
    miss = judged.miss if objective.comes_to_rest else np.array(beside)
    return ExecutedThrows(miss=miss, success=judged.success, ends=ended.xy)


def _play(
    hidden: HiddenIce, truth: Ice, release: Release, stones: Floats, direction: Direction
) -> Rollouts:
    """One throw into resting stones (k, 2)."""
    path = run_stone(hidden, release, stones)
    t, x, y, vx, vy, theta, omega = (float(value) for value in path[-1])
    still = comes_to_rest(path)
    met = len(stones) and np.hypot(*(stones - [x, y]).T).min() < 2 * truth.stone.radius + 1e-3
    if met and not still:
        here = replace(release, x=x, y=y, vx=vx, vy=vy, theta=theta, omega=omega)
        after = play_batch(truth, stones[None], [here], bounds=play_bounds(truth, direction))
        return Rollouts(
            xy=after.last[:, -1],
            end=np.array([SlideEnd.CONTACT], dtype=np.int64),
            in_play=~np.isnan(after.xy[:, -1, 0]),
            time=after.time + t,
            stones=after.xy[:, :-1],
        )
    low, high, short, far = play_bounds(truth, direction)
    inside = low < x < high and short < y < far
    lies = still and inside and not is_hogged(y, direction, truth.stone.radius)
    return Rollouts(
        xy=np.array([[x, y]]),
        end=np.array([SlideEnd.REST if still and inside else SlideEnd.LEFT_BOUNDS], dtype=np.int64),
        in_play=np.array([lies]),
        time=np.array([t]),
        stones=stones[None].copy(),
    )


def _distance_beside(hidden: HiddenIce, assumed: Ice, release: Release, plan: Plan) -> float:
    """How far beside the planned line a hit passes its stone [m].

    For a throw that stops before it, the whole distance to the stone.
    """
    height = float(plan.target[1]) * plan.direction
    path = run_stone(hidden, release)
    along = plan.direction * path[:, 2]
    if along[-1] < height:
        return float(np.hypot(*(path[-1, 1:3] - plan.target)))
    planned = slide(
        assumed,
        plan.best.throw.release(plan.direction),
        bounds=play_bounds(assumed, plan.direction),
        fps=50,
    ).trajectory
    assert planned is not None  # a rate was given
    x = np.interp(height, along, path[:, 1])
    return float(abs(x - np.interp(height, plan.direction * planned.xy[:, 1], planned.xy[:, 0])))
