"""Measures of `curling bench`: the speed of this package on this machine.

Each measure repeats its work for 0.4 s, three times, and keeps the best, because other work of the
machine can only slow it down. Packages declare their measures under the entry-point group
`curling.benchmarks`, as functions that yield them.
"""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from curling_env.ice import Ice, load_ice
from curling_env.sheet import TEE_Y, Direction

REPEATS = 3
REPEAT_TIME = 0.4
"""Processor time of one repeat [s]."""


@dataclass(frozen=True, kw_only=True)
class Measure:
    """Measured speed.

    Parameters
    ----------
    name : name of the measure
    value : its value
    unit : unit of the value
    """

    name: str
    value: float
    unit: str


def rate(work: Callable[[], int], *, repeats: int = REPEATS) -> float:
    """Return items per second on one core, in processor time.

    Parameters
    ----------
    work : function that does some items and returns their number
    repeats : number of measurements; the best counts
    """
    work()  # compiles
    best = 0.0
    for _ in range(repeats):
        done = 0
        start = time.process_time()
        while (spent := time.process_time() - start) < REPEAT_TIME:
            done += work()
        best = max(best, done / spent)
    return best


def import_time() -> float:
    """Return the processor time of importing the package in a new process, the best of three
    [ms].
    """
    program = (
        "import time; begun = time.process_time(); import curling_env; "
        "print(time.process_time() - begun)"
    )
    command = [sys.executable, "-c", program]
    return 1e3 * min(float(subprocess.check_output(command)) for _ in range(3))


def first_steps() -> Iterator[Measure]:
    """Return the processor time until an environment's first step with nothing compiled [s]."""
    program = """
import sys, time
import gymnasium, curling_env
env = getattr(gymnasium, sys.argv[1])(sys.argv[2])
env.action_space.seed(0)
env.reset(seed=0)
env.step(env.action_space.sample())
print(time.process_time())
"""
    for name, words in (
        ("sheet", ("make", "CurlingSheet-v0")),
        ("vector_end", ("make_vec", "CurlingEnd-v0")),
    ):
        with TemporaryDirectory() as empty:
            printed = subprocess.check_output(
                [sys.executable, "-c", program, *words],
                env={**os.environ, "NUMBA_CACHE_DIR": empty},
                stderr=subprocess.DEVNULL,
            )
        yield Measure(name=f"first_step_{name}_s", value=float(printed), unit="s")


def measures() -> Iterator[Measure]:
    """Measure batches, environments, and pymunk for comparison."""
    yield Measure(name="import_ms", value=import_time(), unit="ms")
    yield from batch_rates()
    yield from first_steps()
    yield from environment_rates()


def batch_rates() -> Iterator[Measure]:
    """Return throws per second in a batch, on an empty sheet and among stones."""
    from curling_env.benchmarks.throws import draws_and_hits, houses, mapped_ice
    from curling_env.physics.batch import play_batch, throw_batch
    from curling_env.physics.slides import play_bounds

    rng = np.random.default_rng(1)
    ice = mapped_ice(rng)
    draws = draws_and_hits(rng, 20_000, hits=0.0)
    yield _throws("batch_throws_per_s_empty", lambda: len(throw_batch(ice, draws).x))
    mixed, stones = draws_and_hits(rng, 5_000, hits=0.5), houses(rng, 5_000)
    bounds = play_bounds(ice, Direction.AWAY)
    for name, sheet in (("", ice), ("_uniform_ice", load_ice("standard"))):

        def play(sheet: Ice = sheet) -> int:
            return len(play_batch(sheet, stones, mixed, bounds=bounds, tabulated=True).time)

        yield _throws(f"batch_throws_per_s_8_stones{name}", play)


def environment_rates() -> Iterator[Measure]:
    """Return throws per second of the environments, and of pymunk alone for comparison."""
    import gymnasium

    from curling_env.benchmarks.plain_pymunk import throw_in_pymunk
    from curling_env.benchmarks.throws import draws_and_hits, houses, mapped_ice

    rng = np.random.default_rng(2)
    ice = mapped_ice(rng)
    for name, stones in (("empty", 0), ("8_stones", houses(rng, 1)[0] - [0.0, TEE_Y])):
        env = gymnasium.make("CurlingSheet-v0", ice=ice, stones=stones)
        yield _throws(f"env_throws_per_s_{name}", lambda env=env: steps(env))
        env.close()
    yield _throws("vector_env_throws_per_s", vector_steps(ice=ice))
    draws = draws_and_hits(rng, 2, hits=0.0)

    def throw_all() -> int:
        for draw in draws:
            throw_in_pymunk(ice, draw)
        return len(draws)

    yield _throws("pymunk_only_throws_per_s_empty", throw_all)


def _throws(name: str, work: Callable[[], int]) -> Measure:
    return Measure(name=name, value=rate(work), unit="throws/s")


def vector_steps(
    sheets: int = 256, name: str = "CurlingSheet-v0", **options: Any
) -> Callable[[], int]:
    """Return work that makes a throw on every sheet of a vector environment.

    Parameters
    ----------
    sheets : number of sheets
    name : name of the environment
    options : its options
    """
    import gymnasium

    # Reset within the step, so that every step is a throw.
    envs: Any = gymnasium.make_vec(name, num_envs=sheets, autoreset_mode="SameStep", **options)
    envs.action_space.seed(0)
    envs.reset(seed=0)

    def step_all() -> int:
        envs.step(envs.action_space.sample())
        return sheets

    return step_all


def steps(env: Any, n: int = 20) -> int:
    """Return steps of an environment with random actions, resets included."""
    env.action_space.seed(0)
    env.reset(seed=0)
    for _ in range(n):
        _, _, ended, cut, _ = env.step(env.action_space.sample())
        if ended or cut:
            env.reset()
    return n
