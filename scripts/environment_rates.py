"""Steps per second of processor time: these environments beside HighwayEnv, pgx and Jumanji.

    python scripts/environment_rates.py                  # of the packages that are installed

Random actions; episodes that end begin again. What jax compiles is not counted. docs/for-rl.md has
the result. None of the other packages is needed for anything else: pip install highway-env
"jax[cpu]" pgx jumanji, in a separate environment.
"""

from __future__ import annotations

import importlib
import importlib.util
import time
from collections.abc import Callable
from typing import Any

SECONDS = 5.0
"""Processor time of a measurement."""
MANY = 1024
"""Environments in parallel with jax."""


def rate(steps: Callable[[], int]) -> float:
    """Steps per second of processor time; the function makes some and returns their number."""
    steps()  # compiles
    begun, done = time.process_time(), 0
    while time.process_time() - begun < SECONDS:
        done += steps()
    return done / (time.process_time() - begun)


def single(name: str, **options: Any) -> Callable[[], int]:
    import gymnasium

    env = gymnasium.make(name, **options)
    env.reset(seed=0)
    env.action_space.seed(0)

    def steps() -> int:
        for _ in range(20):
            _, _, terminated, truncated, _ = env.step(env.action_space.sample())
            if terminated or truncated:
                env.reset()
        return 20

    return steps


def vector(name: str, num_envs: int, **options: Any) -> Callable[[], int]:
    import gymnasium

    envs = gymnasium.make_vec(name, num_envs=num_envs, autoreset_mode="SameStep", **options)
    envs.reset(seed=0)
    envs.action_space.seed(0)

    def steps() -> int:
        for _ in range(8):
            envs.step(envs.action_space.sample())
        return 8 * num_envs

    return steps


def pgx_game(name: Any) -> Callable[[], int]:
    import jax  # pyright: ignore[reportMissingImports]
    import jax.numpy as jnp  # pyright: ignore[reportMissingImports]
    import pgx  # pyright: ignore[reportMissingImports]
    from pgx.experimental import auto_reset  # pyright: ignore[reportMissingImports]

    env = pgx.make(name)
    step = auto_reset(env.step, env.init)

    def one(state: Any, key: Any) -> Any:
        keys = jax.random.split(key, 2 * MANY)
        logits = jnp.log(state.legal_action_mask.astype(jnp.float32))
        actions = jax.vmap(jax.random.categorical)(keys[:MANY], logits)
        return jax.vmap(step)(state, actions, keys[MANY:]), None

    state = jax.vmap(env.init)(jax.random.split(jax.random.PRNGKey(0), MANY))
    return rolled(one, state)


def jumanji_game(name: str) -> Callable[[], int]:
    import jax  # pyright: ignore[reportMissingImports]
    import jumanji  # pyright: ignore[reportMissingImports]
    from jumanji.wrappers import VmapAutoResetWrapper  # pyright: ignore[reportMissingImports]

    env = VmapAutoResetWrapper(jumanji.make(name))
    highest = env.action_spec.num_values

    def one(state: Any, key: Any) -> Any:
        return env.step(state, jax.random.randint(key, (MANY,), 0, highest))[0], None

    return rolled(one, env.reset(jax.random.split(jax.random.PRNGKey(0), MANY))[0])


def rolled(one: Callable[[Any, Any], Any], state: Any, length: int = 20) -> Callable[[], int]:
    """Steps of all environments, in one compiled loop."""
    import jax  # pyright: ignore[reportMissingImports]

    roll = jax.jit(lambda now, key: jax.lax.scan(one, now, jax.random.split(key, length))[0])
    kept = [state, jax.random.PRNGKey(1)]

    def steps() -> int:
        kept[1], key = jax.random.split(kept[1])
        kept[0] = jax.block_until_ready(roll(kept[0], key))
        return MANY * length

    return steps


RATES: dict[str, tuple[str, Callable[[], Callable[[], int]]]] = {
    "CurlingSheet-v0, one": ("curling_env", lambda: single("CurlingSheet-v0")),
    "CurlingSheet-v0, 256": ("curling_env", lambda: vector("CurlingSheet-v0", 256)),
    "CurlingSheet-v0, 256, every ice another": (
        "curling_env",
        lambda: vector("CurlingSheet-v0", 256, ices="random"),
    ),
    "CurlingEnd-v0, 64, against `rulebased`": ("curling_env", lambda: vector("CurlingEnd-v0", 64)),
    "HighwayEnv highway-fast-v0, one": ("highway_env", lambda: single("highway-fast-v0")),
    "HighwayEnv parking-v0, one": ("highway_env", lambda: single("parking-v0")),
    "pgx connect_four, 1024": ("pgx", lambda: pgx_game("connect_four")),
    "pgx backgammon, 1024": ("pgx", lambda: pgx_game("backgammon")),
    "pgx go_9x9, 1024": ("pgx", lambda: pgx_game("go_9x9")),
    "Jumanji Snake-v1, 1024": ("jumanji", lambda: jumanji_game("Snake-v1")),
    "Jumanji Game2048-v1, 1024": ("jumanji", lambda: jumanji_game("Game2048-v1")),
}
"""Measurements by name: the package needed, and the maker of its steps."""


def main() -> None:
    for package in ("curling_env", "highway_env"):
        if importlib.util.find_spec(package):
            importlib.import_module(package)  # registers its environments
    for name, (package, made) in RATES.items():
        if importlib.util.find_spec(package):
            print(f"{name:42} {rate(made()):>12,.0f}", flush=True)


if __name__ == "__main__":
    main()
