"""Draws planned on the discovered ice and thrown on the true one, by an elite player.

Each is compared with the draw that the same player, with the same spin, would plan on the true ice.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from agents.planning import plan_throw
from blind.sessions import TrueIce, true_ice
from curling_env.errors import CurlingError
from curling_env.ice import Ice
from curling_env.sheet import TEE_Y, Direction
from curling_env.throw import Throw, skill_named
from curling_env.typing import Floats

SKILL = skill_named("elite")
TARGETS = 6
"""Number of draws, to targets on a circle around the tee."""
RADIUS = 1.2
"""Radius of that circle [m]."""
ERRORS = 50
"""Number of sampled errors for each draw."""
STRIDE = 1.5
"""Step of the response to execution errors, in their standard deviations."""
CLOSE = 1e-3
"""Maximum distance from its target of a draw planned on the true ice [m]."""
Rest = Callable[[Floats], Floats]
"""Place of rest (2,) of a throw of speed, angle and spin."""


def draws_on_truth(ice: Ice, sealed: dict[str, Any], *, direction: float) -> dict[str, float]:
    """Return the mean miss of draws planned on an ice and thrown on the true one, and of the best
    plans.

    Parameters
    ----------
    ice : the discovered ice
    sealed : the truth
    direction : the end of the house: -1 for the home end

    Returns
    -------
    ``miss`` and ``miss_on_truth``, mean over targets and execution errors of draws planned on the
    discovered ice and on the true one [m]
    """
    truth = true_ice(sealed)
    errors = SKILL.errors(ERRORS, np.random.default_rng(0))
    misses: list[tuple[float, float]] = []
    for turn in np.arange(TARGETS) * 2.0 * np.pi / TARGETS:
        target = np.array([RADIUS * np.cos(turn), direction * TEE_Y + RADIUS * np.sin(turn)])
        try:
            planned = plan_throw(ice, target, skill=SKILL).best
        except CurlingError:
            continue
        chosen, sweep = planned.throw, planned.sweep or (0.0, 0.0)
        throw = np.array([chosen.speed, chosen.angle, chosen.spin])

        def rest(throw: Floats, sweep: tuple[float, float] = sweep) -> Floats:
            return rest_on(truth, throw, sweep, direction)

        right = solve(rest, throw, target)
        if right is None:
            continue
        made = rests_with_errors(rest, throw, errors) - target
        meant = rests_with_errors(rest, right, errors) - target
        misses.append((float(np.hypot(*made.T).mean()), float(np.hypot(*meant.T).mean())))
    if not misses:
        return {}
    miss, on_truth = np.mean(misses, axis=0).tolist()
    return {"miss": miss, "miss_on_truth": on_truth}


def rest_on(truth: TrueIce, throw: Floats, sweep: tuple[float, float], direction: float) -> Floats:
    """Return the place of rest of a throw of speed, angle and spin, (2,) [m]."""
    speed, angle, spin = throw.tolist()
    thrown = Throw(speed=speed, angle=angle, spin=spin)
    return truth.path(thrown.release(Direction(round(direction)), sweep=sweep))[-1, :2]


def solve(rest: Rest, throw: Floats, target: Floats) -> Floats | None:
    """Return the throw of the same spin that rests at the target; None if none does."""
    throw = throw.copy()
    away = rest(throw) - target
    for _ in range(12):
        if np.hypot(*away) < CLOSE:
            return throw
        steps = np.array([[1e-3, 0.0, 0.0], [0.0, 1e-4, 0.0]])
        slope = np.column_stack([(rest(throw + s) - target - away) / s.max() for s in steps])
        change = np.clip(-np.linalg.lstsq(slope, away, rcond=None)[0], [-0.2, -0.05], [0.2, 0.05])
        for damping in (1.0, 0.5, 0.25, 0.1):
            trial = throw + damping * np.array([*change, 0.0])
            left = rest(trial) - target
            if np.hypot(*left) < np.hypot(*away):
                throw, away = trial, left
                break
        else:
            return None
    return None


def rests_with_errors(rest: Rest, throw: Floats, errors: Floats) -> Floats:
    """Return places of rest of a throw with execution errors, (n, 2) [m], by a second-order
    response.

    Ten throws give the response; for such small errors the rest is nearly quadratic.

    Parameters
    ----------
    errors : (n, 3) errors of speed [m/s], angle [rad] and spin [rad/s]
    """
    sizes = STRIDE * np.array([SKILL.sigma_speed, SKILL.sigma_angle, SKILL.sigma_spin])

    def at(*units: float) -> Floats:
        return rest(throw + sizes * np.array(units))

    middle = at(0, 0, 0)
    unit = np.eye(3)
    more, less = [at(*unit[j]) for j in range(3)], [at(*-unit[j]) for j in range(3)]
    scaled = errors / sizes
    rests = np.tile(middle, (len(errors), 1))
    for j in range(3):
        rests += 0.5 * np.outer(scaled[:, j], more[j] - less[j])
        rests += 0.5 * np.outer(scaled[:, j] ** 2, more[j] + less[j] - 2.0 * middle)
        for k in range(j):
            bend = at(*(unit[j] + unit[k])) - more[j] - more[k] + middle
            rests += np.outer(scaled[:, j] * scaled[:, k], bend)
    return rests
