"""Steps per second of processor time: these environments beside HighwayEnv, pgx and Jumanji.

    python scripts/environment_rates.py                  # of the packages that are installed

Actions are random and episodes restart; compilation by jax is excluded. docs/for-rl.md has the
result. Nothing else needs the other packages: pip install highway-env "jax[cpu]" pgx jumanji, in a
separate environment.
"""

# The other packages are not installed with the project.
# pyright: reportMissingImports=false

from __future__ import annotations

import importlib
import importlib.util
from collections.abc import Callable
from functools import partial
from typing import Any

from curling_env.benchmarks.measures import rate, steps, vector_steps

MANY = 1024
"""Environments in parallel with jax."""


def single(name: str) -> Callable[[], int]:
    import gymnasium

    return partial(steps, gymnasium.make(name))


def pgx_game(name: Any) -> Callable[[], int]:
    import jax
    import jax.numpy as jnp
    import pgx
    from pgx.experimental import auto_reset

    env = pgx.make(name)
    step = auto_reset(env.step, env.init)

    def one(state: Any, key: Any) -> Any:
        keys = jax.random.split(key, 2 * MANY)
        logits = jnp.log(state.legal_action_mask.astype(jnp.float32))
        actions = jax.vmap(jax.random.categorical)(keys[:MANY], logits)
        return jax.vmap(step)(state, actions, keys[MANY:]), None

    state = jax.vmap(env.init)(jax.random.split(jax.random.PRNGKey(0), MANY))
    return compiled_steps(one, state)


def jumanji_game(name: str) -> Callable[[], int]:
    import jax
    import jumanji
    from jumanji.wrappers import VmapAutoResetWrapper

    env = VmapAutoResetWrapper(jumanji.make(name))
    highest = env.action_spec.num_values

    def one(state: Any, key: Any) -> Any:
        return env.step(state, jax.random.randint(key, (MANY,), 0, highest))[0], None

    return compiled_steps(one, env.reset(jax.random.split(jax.random.PRNGKey(0), MANY))[0])


def compiled_steps(one: Callable[[Any, Any], Any], state: Any, n: int = 20) -> Callable[[], int]:
    """Return work that makes `n` steps of all environments in one compiled loop."""
    import jax

    roll = jax.jit(lambda now, key: jax.lax.scan(one, now, jax.random.split(key, n))[0])
    kept = [state, jax.random.PRNGKey(1)]

    def work() -> int:
        kept[1], key = jax.random.split(kept[1])
        kept[0] = jax.block_until_ready(roll(kept[0], key))
        return MANY * n

    return work


RATES: dict[str, tuple[str, Callable[[], Callable[[], int]]]] = {
    "CurlingSheet-v0, one": ("curling_env", partial(single, "CurlingSheet-v0")),
    "CurlingSheet-v0, 256": ("curling_env", vector_steps),
    "CurlingSheet-v0, 256, an ice for each throw": (
        "curling_env",
        partial(vector_steps, ices="random"),
    ),
    "CurlingEnd-v0, 64, against `rulebased`": (
        "curling_env",
        partial(vector_steps, 64, "CurlingEnd-v0"),
    ),
    "HighwayEnv highway-fast-v0, one": ("highway_env", partial(single, "highway-fast-v0")),
    "HighwayEnv parking-v0, one": ("highway_env", partial(single, "parking-v0")),
    "pgx connect_four, 1024": ("pgx", partial(pgx_game, "connect_four")),
    "pgx backgammon, 1024": ("pgx", partial(pgx_game, "backgammon")),
    "pgx go_9x9, 1024": ("pgx", partial(pgx_game, "go_9x9")),
    "Jumanji Snake-v1, 1024": ("jumanji", partial(jumanji_game, "Snake-v1")),
    "Jumanji Game2048-v1, 1024": ("jumanji", partial(jumanji_game, "Game2048-v1")),
}
"""Measurements by name: the package needed, and the maker of its steps."""


def main() -> None:
    for package in ("curling_env", "highway_env"):
        if importlib.util.find_spec(package):
            importlib.import_module(package)  # registers its environments
    for name, (package, made) in RATES.items():
        if importlib.util.find_spec(package):
            print(f"{name:45} {rate(made()):>12,.0f}", flush=True)


if __name__ == "__main__":
    main()
