"""How well throws get where they were meant to: agents beside the planner, on the same targets."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import gymnasium
import numpy as np
from numpy.typing import ArrayLike, NDArray

import curling_env  # noqa: F401  (registers the environments)
from agents.planning import plan
from agents.planning.expectation import end_in_play
from agents.planning.search import direction_to
from curling_env.envs.action import ThrowRange
from curling_env.ice import Ice
from curling_env.physics.slide import NO_OBSTACLES
from curling_env.sheet import HOUSE_RADIUS, Direction, to_delivery, to_sheet
from curling_env.skill import Skill
from curling_env.throw import MAX_SPEED, Throw

Floats = NDArray[np.float64]
Through = Callable[[Iterable[Any], str], Iterable[Any]]
"""Passes items on and shows how far it is: (items, label) -> the same items."""

TRIALS = 64
"""Throws with execution error at each target."""


class Policy(Protocol):
    """Anything that turns an observation into an action: a stable-baselines3 policy or model."""

    def predict(self, observation: Any, *, deterministic: bool = False) -> tuple[Any, Any]:
        """The action, and a state that is not used."""
        ...


@dataclass(frozen=True, kw_only=True)
class Misses:
    """How far one who throws missed the same targets.

    Parameters
    ----------
    exact : (n,) distance from each target without execution error [m]
    with_error : (n, trials) the same with it [m]
    """

    exact: Floats
    with_error: Floats

    def as_dict(self) -> dict[str, float]:
        """Mean and median of both [m]."""
        return {
            "mean_miss_m": float(self.exact.mean()),
            "median_miss_m": float(np.median(self.exact)),
            "mean_miss_with_error_m": float(self.with_error.mean()),
            "median_miss_with_error_m": float(np.median(self.with_error)),
        }


def rest_in_env(ice: Ice, throw: Throw, target: ArrayLike) -> Floats:
    """Where a throw rests in `CurlingSheet-v0` on an ice, (2,) sheet frame [m].

    Parameters
    ----------
    target : sheet frame [m]; its half of the sheet is the end played to
    """
    direction = direction_to(np.asarray(target))
    # Actions are single precision: a range close around the throw keeps it to a micrometre.
    around = ThrowRange(
        speed=(0.9 * throw.speed, min(1.1 * throw.speed, MAX_SPEED)),
        angle=(throw.angle - 0.01, throw.angle + 0.01),
        spin=(throw.spin - 0.1, throw.spin + 0.1),
    )
    env = gymnasium.make(
        "CurlingSheet-v0",
        ice=ice,
        throw_range=around,
        direction=direction,
        target=tuple(to_delivery(target, direction)),
    )
    env.reset(seed=0)
    *_, info = env.step(env.unwrapped.action_of(throw))  # pyright: ignore[reportAttributeAccessIssue]
    stone = info["outcome"].delivered
    env.close()
    return np.array([stone.x, stone.y])


def house_targets(n: int, rng: np.random.Generator) -> Floats:
    """Targets spread evenly over the away house, (n, 2) sheet frame [m]."""
    radius = HOUSE_RADIUS * np.sqrt(rng.random(n))
    angle = 2 * np.pi * rng.random(n)
    return to_sheet(np.column_stack([radius * np.cos(angle), radius * np.sin(angle)]),
                    Direction.AWAY)  # fmt: skip


def policy_throws(policy: Policy, env: gymnasium.Env[Any, Any], targets: Floats) -> Floats:
    """What a policy throws at each target, (n, 4); see `rollouts.states_of`.

    Parameters
    ----------
    env : `CurlingSheet-v0` with the observations and actions the policy knows
    targets : (n, 2) in the away house, sheet frame [m]
    """
    throws: list[tuple[float, ...]] = []
    for place in to_delivery(targets, Direction.AWAY):
        observation, _ = env.reset(options={"target": tuple(place)})
        action, _ = policy.predict(observation, deterministic=True)
        throw: Throw = env.unwrapped.throw_of(action)  # pyright: ignore[reportAttributeAccessIssue]
        throws.append((throw.speed, throw.angle, throw.spin, throw.x))
    return np.array(throws)


def planner_throws(
    ice: Ice,
    targets: Floats,
    skill: str | Skill,
    through: Through = lambda items, label: items,
) -> Floats:
    """What the planner throws at each target, (n, 4)."""
    throws: list[tuple[float, ...]] = []
    for target in through(targets, "planning"):
        throw = plan(ice, target, skill=skill).best.throw
        throws.append((throw.speed, throw.angle, throw.spin, throw.x))
    return np.array(throws)


def misses(ice: Ice, throws: Floats, targets: Floats, skill: Skill, *, seed: int) -> Misses:
    """How far throws end from their targets, with and without execution error.

    The same seed gives everyone the same errors. A stone that leaves play counts where it left.
    """
    errors = skill.errors(TRIALS, np.random.default_rng(seed))
    exact: list[float] = []
    with_error: list[Sequence[float]] = []
    for throw, target in zip(throws, targets, strict=True):
        trials = np.repeat(throw[None], TRIALS + 1, axis=0)
        trials[1:, :3] += errors
        trials[:, 0] = np.clip(trials[:, 0], 1e-3, MAX_SPEED)
        ends = end_in_play(ice, trials, direction_to(target), NO_OBSTACLES).xy
        distance = np.hypot(*(ends - target).T)
        exact.append(float(distance[0]))
        with_error.append(distance[1:].tolist())
    return Misses(exact=np.array(exact), with_error=np.array(with_error))
