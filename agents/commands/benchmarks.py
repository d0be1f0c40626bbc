"""Measures of the speed of ends, on one core."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import gymnasium
import numpy as np

import curling_env  # noqa: F401  (registers the environments)
from agents.commands.page_benchmarks import page_measures
from curling_env.benchmarks.measures import Measure, rate
from curling_env.envs.game.end_env import CurlingEndEnv
from curling_env.envs.game.end_vector_env import CurlingEndVectorEnv

SIDE_BY_SIDE = 256


def measures() -> Iterator[Measure]:
    """Measure ends against the draw player, and the latency of the app's sheet."""
    yield Measure(name="end_env_ends_per_s", value=rate(end_alone()), unit="ends/s")
    yield Measure(name="end_vector_env_ends_per_s", value=rate(ends_together()), unit="ends/s")
    yield from page_measures()


def end_alone() -> Callable[[], int]:
    """Return work that plays an end in which both teams draw to the button and collide."""
    env = gymnasium.make("CurlingEnd-v0", opponent="draw").unwrapped
    assert isinstance(env, CurlingEndEnv)
    env.reset(seed=0)
    action = env.action_of(env.opponent.call(env.simulator.view(env.state)))

    def work() -> int:
        env.reset()
        over = False
        while not over:
            over = env.step(action)[2]
        return 1

    return work


def ends_together() -> Callable[[], int]:
    """Return work that steps ends of the vector environment until some are over."""
    env = gymnasium.make_vec(
        "CurlingEnd-v0",
        num_envs=SIDE_BY_SIDE,
        vectorization_mode="vector_entry_point",
        opponent="draw",
    )
    assert isinstance(env, CurlingEndVectorEnv)
    env.reset(seed=0)
    view = env.usual.simulator.view(env.states[0])
    action = env.action_of(env.opponents[0].call(view))
    actions = np.tile(action, (SIDE_BY_SIDE, 1))

    def work() -> int:
        ends = 0
        while ends == 0:
            ends = int(env.step(actions)[2].sum())
        return ends

    return work
