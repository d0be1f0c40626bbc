"""What `curling bench` measures: the speed of this package on this machine.

Each measure repeats its work for long enough, three times, and keeps the best, because other work
of the machine can only slow it down. Packages declare their measures under the entry-point group
`curling.benchmarks`, as functions that yield them.
"""

from __future__ import annotations

import math
import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from numpy.typing import NDArray

from curling_env.ice import Ice, load_ice
from curling_env.sheet import HOG_LINE_Y, TEE_Y, Direction
from curling_env.throw import Throw
from curling_env.typing import Floats

REPEATS = 3
REPEAT_TIME = 0.4
"""Processor time of one repeat [s]."""


@dataclass(frozen=True, kw_only=True)
class Measure:
    """One measured speed.

    Parameters
    ----------
    name : name of the measure
    value : its value
    unit : unit of the value
    """

    name: str
    value: float
    unit: str


def rate(work: Callable[[], int], *, repeats: int = REPEATS, warm: bool = False) -> float:
    """Items per second on one core, in processor time.

    Parameters
    ----------
    work : does some items and returns their number
    repeats : how often to measure; the best counts
    warm : whether the work has been done before, so that everything is compiled
    """
    if not warm:
        work()
    best = 0.0
    for _ in range(repeats):
        done = 0
        start = time.process_time()
        while (spent := time.process_time() - start) < REPEAT_TIME:
            done += work()
        best = max(best, done / spent)
    return best


def wall_rates(*works: Callable[[], int]) -> list[float]:
    """Items per second by the clock on the wall, for work on several cores, done by turns.

    Other work of the machine slows them, so they need a quiet one.
    """
    best = [0.0] * len(works)
    for repeat in range(REPEATS + 1):
        for k, work in enumerate(works):
            start = time.perf_counter()
            done = work()
            if repeat > 0:  # the first warms up
                best[k] = max(best[k], done / (time.perf_counter() - start))
    return best


def memory_of_a_million() -> float:
    """Memory for a million throws without paths, releases and results included [MB].

    The stones are slow, to save time: a slide keeps nothing, so its length does not matter.
    """
    import tracemalloc

    from curling_env.physics.batch import RELEASE_DTYPE, throw_batch

    def throw(count: int) -> object:
        table = np.zeros(count, dtype=RELEASE_DTYPE)
        table["vy"], table["omega"] = 0.05, 0.1
        return throw_batch(load_ice("standard"), table)

    throw(10)
    tracemalloc.start()
    try:
        kept = throw(1_000_000)
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    del kept
    return 1e-6 * peak


def import_time() -> float:
    """Processor time that importing the package takes in a new process, the best of three [ms]."""
    program = (
        "import time; begun = time.process_time(); import curling_env; "
        "print(time.process_time() - begun)"
    )
    command = [sys.executable, "-c", program]
    return 1e3 * min(float(subprocess.check_output(command)) for _ in range(3))


def first_steps() -> Iterator[Measure]:
    """Processor time until an environment's first step where nothing was ever compiled [s]."""
    program = """
import sys, time
import gymnasium, curling_env
make, id = sys.argv[1:]
env = gymnasium.make(id) if make == "make" else gymnasium.make_vec(id, num_envs=64)
env.action_space.seed(0)
env.reset(seed=0)
env.step(env.action_space.sample())
print(time.process_time())
"""
    for make, kind in (("make", ""), ("make_vec", "vector_")):
        for name in ("Sheet", "End"):
            with TemporaryDirectory() as empty:
                told = subprocess.check_output(
                    [sys.executable, "-c", program, make, f"Curling{name}-v0"],
                    env={**os.environ, "NUMBA_CACHE_DIR": empty},
                    stderr=subprocess.DEVNULL,
                )
            value = float(told)
            yield Measure(name=f"first_step_{kind}{name.lower()}_s", value=value, unit="s")


def mapped_ice(rng: np.random.Generator) -> Ice:
    """Standard ice with a different friction in every cell, rougher than any real ice."""
    ice = load_ice("standard")
    mu = ice.friction.mu * np.exp(0.04 * rng.standard_normal(ice.friction.mu.shape))
    return replace(ice, friction=replace(ice.friction, mu=mu))


def draws_and_hits(rng: np.random.Generator, n: int, hits: float) -> NDArray[Any]:
    """Releases towards the away house; a share `hits` of them at take-out weight."""
    from curling_env.physics.batch import RELEASE_DTYPE

    table = np.zeros(n, dtype=RELEASE_DTYPE)
    spin = rng.choice([-1.5, 1.5], n)
    hit = rng.random(n) < hits
    speed = np.where(hit, rng.uniform(2.5, 3.2, n), rng.normal(2.09, 0.02, n))
    # Aimed off by what the stone curls: 1.4 m for a draw, 0.7 m at take-out weight.
    aim = rng.normal(0.0, 0.5, n) + np.sign(spin) * np.where(hit, 0.7, 1.4)
    angle = -aim / (HOG_LINE_Y + TEE_Y)
    table["y"] = -HOG_LINE_Y
    table["vx"], table["vy"] = -speed * np.sin(angle), speed * np.cos(angle)
    table["omega"] = spin
    return table


def houses(rng: np.random.Generator, n: int, stones: int = 8) -> Floats:
    """Positions of stones that lie in the away house, (n, stones, 2) [m]."""
    found = np.empty((n, stones, 2))
    for position in found:
        k = 0
        while k < stones:
            radius, turn = 1.8 * math.sqrt(rng.random()), rng.uniform(0, 2 * np.pi)
            place = np.array([radius * math.sin(turn), TEE_Y + radius * math.cos(turn)])
            if k == 0 or np.hypot(*(position[:k] - place).T).min() > 0.3:
                position[k] = place
                k += 1
    return found


def measures() -> Iterator[Measure]:
    """The measures of this package: batches, environments, and pymunk for comparison."""
    yield Measure(name="import_ms", value=import_time(), unit="ms")
    yield from _batch()
    yield from first_steps()
    yield from _environment()
    yield from _ends()
    yield _clones_of_a_state()
    yield from _pymunk_only()


def _batch() -> Iterator[Measure]:
    from curling_env.physics.batch import play_batch, throw_batch
    from curling_env.physics.slides import play_bounds

    rng = np.random.default_rng(1)
    ice = mapped_ice(rng)
    draws = draws_and_hits(rng, 20_000, hits=0.0)
    yield Measure(
        name="batch_throws_per_s_empty",
        value=rate(lambda: len(throw_batch(ice, draws).x)),
        unit="throws/s",
    )
    yield Measure(
        name="batch_throws_per_s_empty_uniform_ice",
        value=rate(lambda: len(throw_batch(load_ice("standard"), draws).x)),
        unit="throws/s",
    )
    one, two = wall_rates(*(lambda n=n: len(throw_batch(ice, draws, workers=n).x) for n in (1, 2)))
    yield Measure(name="batch_throws_per_s_empty_2_cores", value=two, unit="throws/s")
    yield Measure(name="batch_two_core_ratio", value=two / one, unit="1")
    yield Measure(name="batch_memory_mb_per_million_throws", value=memory_of_a_million(), unit="MB")
    mixed, stones = draws_and_hits(rng, 5_000, hits=0.5), houses(rng, 5_000)
    bounds = play_bounds(ice, Direction.AWAY)
    for name, sheet in (("", ice), ("_uniform_ice", load_ice("standard"))):

        def play(sheet: Ice = sheet) -> int:
            return len(play_batch(sheet, stones, mixed, bounds=bounds, tabulated=True).time)

        yield Measure(name=f"batch_throws_per_s_8_stones{name}", value=rate(play), unit="throws/s")


def _environment() -> Iterator[Measure]:
    import gymnasium

    rng = np.random.default_rng(2)
    ice = mapped_ice(rng)
    for name, stones in (("empty", 0), ("8_stones", houses(rng, 1)[0] - [0.0, TEE_Y])):
        env = gymnasium.make("CurlingSheet-v0", ice=ice, stones=stones)
        yield Measure(
            name=f"env_throws_per_s_{name}",
            value=rate(lambda env=env: _steps(env)),
            unit="throws/s",
        )
        env.close()
    sheets = 256
    for name, stones in (("", 0), ("_8_stones", houses(rng, 1)[0] - [0.0, TEE_Y])):
        # Reset within the step, so that every step is a throw.
        envs: Any = gymnasium.make_vec(
            "CurlingSheet-v0", num_envs=sheets, ice=ice, stones=stones, autoreset_mode="SameStep"
        )
        envs.action_space.seed(0)
        envs.reset(seed=0)

        def step_all(envs: Any = envs) -> int:
            envs.step(envs.action_space.sample())
            return sheets

        yield Measure(name=f"vector_env_throws_per_s{name}", value=rate(step_all), unit="throws/s")
        envs.close()


def _ends() -> Iterator[Measure]:
    """Deliveries of both teams in the vector environment of ends, beginnings included."""
    import gymnasium

    ends = 64
    for opponent in ("draw", "rulebased"):
        envs: Any = gymnasium.make_vec(
            "CurlingEnd-v0", num_envs=ends, opponent=opponent, autoreset_mode="SameStep"
        )
        envs.action_space.seed(0)
        envs.reset(seed=0)

        def step_all(envs: Any = envs) -> int:
            for _ in range(8):
                envs.step(envs.action_space.sample())
            return 8 * ends * 2

        value = rate(step_all)
        yield Measure(
            name=f"vector_end_deliveries_per_s_{opponent}", value=value, unit="deliveries/s"
        )
        envs.close()


def _steps(env: Any, n: int = 20) -> int:
    """Steps of an environment with random actions, resets included."""
    env.action_space.seed(0)
    env.reset(seed=0)
    for _ in range(n):
        _, _, ended, cut, _ = env.step(env.action_space.sample())
        if ended or cut:
            env.reset()
    return n


def _clones_of_a_state() -> Measure:
    """How often a search can clone the state of an end."""
    from copy import deepcopy

    from curling_env.game import TYPICAL_EVOLUTION, Call, GameSimulator

    simulator = GameSimulator(ice_evolution=TYPICAL_EVOLUTION)
    begun = simulator.begin_end(simulator.new_game(0))
    state, _ = simulator.play(begun, Call(throw=Throw(speed=2.0)))

    def work() -> int:
        for _ in range(2000):
            deepcopy(state)
        return 2000

    return Measure(name="end_state_clones_per_s", value=rate(work), unit="clones/s")


def _pymunk_only() -> Iterator[Measure]:
    rng = np.random.default_rng(3)
    ice = mapped_ice(rng)
    for name, hits, stones in (
        ("empty", 0.0, np.empty((8, 0, 2))),
        ("8_stones", 0.5, houses(rng, 8)),
    ):
        throws = draws_and_hits(rng, 8, hits)

        def work(throws: NDArray[Any] = throws, stones: Floats = stones) -> int:
            for throw, position in zip(throws[:2], stones[:2], strict=True):
                _throw_in_pymunk(ice, throw, position)
            return 2

        yield Measure(name=f"pymunk_only_throws_per_s_{name}", value=rate(work), unit="throws/s")


def _throw_in_pymunk(ice: Ice, throw: Any, stones: Floats, rate_hz: float = 60.0) -> Floats:
    """Pymunk moves every stone and a Python callback slows it, 60 times per second."""
    import pymunk

    from curling_env.physics.motion import GRAVITY

    stone, sheet = ice.stone, ice.sheet
    mu, cell = ice.friction.mu, sheet.cell_size
    exponent = float(ice.effects[0].parameters["exponent"])
    curl = float(ice.effects[2].parameters["strength"])

    def slow(body: pymunk.Body, gravity: Any, damping: float, dt: float) -> None:
        vx, vy = body.velocity
        speed = math.hypot(vx, vy)
        if speed < 1e-9:
            return
        x, y = body.position
        row = min(max(int((y + sheet.length / 2) / cell), 0), mu.shape[0] - 1)
        column = min(max(int((x + sheet.width / 2) / cell), 0), mu.shape[1] - 1)
        loss = (GRAVITY * mu[row, column] * speed**-exponent + 9.5e-4 * speed * speed) * dt
        if loss >= speed:
            body.velocity = (0.0, 0.0)
            body.angular_velocity = 0.0
            return
        left = math.copysign(curl * speed**0.2 * dt, body.angular_velocity)
        keep = 1.0 - loss / speed
        body.velocity = (vx * keep - vy / speed * left, vy * keep + vx / speed * left)

    space = pymunk.Space()
    bodies: list[pymunk.Body] = []
    for place in [*stones, (throw["x"], throw["y"])]:
        body = pymunk.Body(stone.mass, stone.inertia)
        body.position = (float(place[0]), float(place[1]))
        body.velocity_func = slow
        shape = pymunk.Circle(body, stone.radius)
        shape.elasticity, shape.friction = stone.restitution**0.5, stone.stone_friction**0.5
        space.add(body, shape)
        bodies.append(body)
    bodies[-1].velocity = (float(throw["vx"]), float(throw["vy"]))
    bodies[-1].angular_velocity = float(throw["omega"])
    for _ in range(int(60 * rate_hz)):
        space.step(1.0 / rate_hz)
        if all(body.velocity.length < 1e-3 for body in bodies):
            break
    return np.array([tuple(body.position) for body in bodies])
