"""Planned throws made on the hidden ice, alone or into other stones."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import NDArray

from agents.closed_loop.hidden_ice import HiddenIce, run
from agents.planning import Plan
from agents.planning.objective import Judged
from agents.planning.rollouts import Rollouts
from curling_env.ice import Ice
from curling_env.physics.batch import play_batch
from curling_env.physics.engine import is_hogged
from curling_env.physics.one_stone.slide import SlideEnd, play_bounds, slide
from curling_env.sheet import Direction
from curling_env.throw import Release, Throw
from curling_env.typing import Floats


@dataclass(frozen=True, kw_only=True)
class Made:
    """How throws went that were planned on one ice and made on another.

    Parameters
    ----------
    miss : (n,) of a throw that was to rest: its distance from the target; of a hit: how far beside
        the planned line it passed the stone it was to hit [m]
    success : (n,) whether the task was done
    ends : (n, 2) where the thrown stones ended, sheet frame [m]
    """

    miss: Floats
    success: NDArray[np.bool_]
    ends: Floats


def make(hidden: HiddenIce, truth: Ice, believed: Ice, plan: Plan, errors: Floats) -> Made:
    """Make a plan's throw on the hidden ice, once for each of the hand's errors.

    A stone slides under `hidden.run` until it meets another; from there the batch engine takes the
    stones on over the true ice.

    Parameters
    ----------
    hidden, truth : the ice, and the same in cells
    believed : ice it was planned on
    errors : (n, 3) in speed [m/s], angle [rad] and spin [rad/s]
    """
    wanted, throw = plan.wanted, plan.best.throw
    rolled: list[Rollouts] = []
    lines: list[float] = []
    for error in errors:
        made = Throw(
            speed=max(throw.speed + float(error[0]), 0.05),
            angle=throw.angle + float(error[1]),
            spin=throw.spin + float(error[2]),
            x=throw.x,
        )
        release = made.release(wanted.direction)
        rolled.append(_one(hidden, truth, release, wanted.stones, wanted.direction))
        if not wanted.rests:
            lines.append(_beside(hidden, believed, release, throw, plan))
    ended = Rollouts(
        **{f.name: np.concatenate([getattr(r, f.name) for r in rolled]) for f in fields(Rollouts)}
    )
    judged: Judged = wanted.judge(ended, truth.stone.radius)
    miss = judged.miss if wanted.rests else np.array(lines)
    return Made(miss=miss, success=judged.success, ends=ended.xy)


def _one(
    hidden: HiddenIce, truth: Ice, release: Release, stones: Floats, direction: Direction
) -> Rollouts:
    path = run(hidden, release, stones)
    t, x, y, vx, vy, theta, omega = (float(value) for value in path[-1])
    still = np.hypot(vx, vy) < 1e-3
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


def _beside(hidden: HiddenIce, believed: Ice, release: Release, meant: Throw, plan: Plan) -> float:
    """How far beside the planned line a hit passes its stone; its whole distance if it stops."""
    height = float(plan.target[1]) * plan.direction
    path = run(hidden, release)
    along = plan.direction * path[:, 2]
    if along[-1] < height:
        return float(np.hypot(*(path[-1, 1:3] - plan.target)))
    planned = slide(
        believed,
        meant.release(plan.direction),
        bounds=play_bounds(believed, plan.direction),
        fps=50,
    ).trajectory
    assert planned is not None  # a rate was given
    x = np.interp(height, along, path[:, 1])
    return float(abs(x - np.interp(height, plan.direction * planned.xy[:, 1], planned.xy[:, 0])))
