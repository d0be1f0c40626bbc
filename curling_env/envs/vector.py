"""Vector environment in Gymnasium's form: a view of a core with many episodes."""

# Gymnasium leaves the spaces of a VectorEnv partly untyped.
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, cast

import numpy as np
from gymnasium import spaces
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from curling_env.envs.core import Core, Episodes, Part, gathered, row_of
from curling_env.envs.options import brief, is_whole_number, whole_number
from curling_env.errors import InputError
from curling_env.typing import Flags, Floats, Indices


class EnvsTogether(Core[Episodes], VectorEnv[Any, Any, Any]):
    """Many episodes with throws simulated together.

    A subclass calls `place` before it reads the options of its core.
    """

    def place(
        self, num_envs: int, autoreset_mode: AutoresetMode | str, render_mode: str | None
    ) -> None:
        """Set the arguments of vector environments.

        Raises
        ------
        InputError : no number of environments, a mode that Gymnasium has not, or a render mode
        """
        self.num_envs = whole_number("num_envs", num_envs, least=1)
        self.autoreset_mode = _autoreset_mode(autoreset_mode)
        if render_mode is not None:
            raise InputError(
                "many environments at once have no render_mode and are not shown: make a single one"
            )

    def __init__(
        self,
        observation_space: spaces.Space[Any],
        action_space: spaces.Space[Any],
        render_mode: str | None,
    ) -> None:
        super().__init__(observation_space, action_space, render_mode)
        self.metadata = {"render_modes": [], "autoreset_mode": self.autoreset_mode}
        self.observation_space = batch_space(observation_space, self.num_envs)
        self.action_space = batch_space(action_space, self.num_envs)
        self._episodes = self.blank(self.num_envs)
        self._rngs: list[np.random.Generator] = []
        self._seeds: list[int | None] = [None] * self.num_envs
        self._all_rows = np.arange(self.num_envs)

    @property
    def np_random_seed(self) -> tuple[int | None, ...]:  # pyright: ignore[reportIncompatibleMethodOverride]
        """Seed of each environment's last reset; None without a given one."""
        return tuple(self._seeds)

    @property
    def np_random(self) -> tuple[np.random.Generator, ...]:  # pyright: ignore[reportIncompatibleMethodOverride]
        """Random generators of the environments.

        Raises
        ------
        InputError : before the first reset
        """
        if not self._rngs:
            raise InputError("call reset() before the first step")
        return tuple(self._rngs)

    def reset(
        self, *, seed: Any = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Begin all episodes, or some.

        Parameters
        ----------
        seed : one for each environment, or the first of consecutive seeds
        options : those of a single environment, and `reset_mask` (num_envs,) to begin only some

        Raises
        ------
        InputError : an unknown option, or an invalid value
        """
        n = self.num_envs
        seeds = _seeds(seed, n)
        given: Any = options
        mask = np.ones(n, dtype=np.bool_)
        if isinstance(given, Mapping) and "reset_mask" in given:
            given = dict(cast("Mapping[str, Any]", given))
            mask = _reset_mask(given.pop("reset_mask"), n)
        asked = self.asked(given, n)
        if not self._rngs:
            self._rngs = [np.random.default_rng() for _ in range(n)]
            mask[:] = True
        rows = np.flatnonzero(mask)
        for i in rows.tolist():
            if seeds[i] is not None:
                self._rngs[i] = np.random.Generator(np.random.PCG64(seeds[i]))
                self._seeds[i] = seeds[i]
        self._episodes = self.begun(self._episodes, rows, self._rngs, asked)
        info = gathered([self._report(rows)], mask)
        return self.observed(self._episodes), info

    def step(self, actions: Any) -> tuple[Any, Floats, Flags, Flags, dict[str, Any]]:
        """Make a step in every environment.

        Raises
        ------
        InputError : before the first reset, invalid actions, or with the mode "Disabled" an
            episode that is over
        """
        if not self._rngs:
            raise InputError("call reset() before the first step")
        n, rows = self.num_envs, self._all_rows
        actions = np.asarray(actions)
        if actions.shape != self.action_space.shape:
            raise InputError(
                f"expected actions of shape {self.action_space.shape}, got {actions.shape}"
            )
        waited = self.are_over(self._episodes)
        if self.autoreset_mode is AutoresetMode.DISABLED and waited.any():
            raise InputError(
                f"the episode of environment {int(np.argmax(waited))} is over; begin it with "
                "reset(options={'reset_mask': …})"
            )
        going, all_rows = np.flatnonzero(~waited), np.ones(n, dtype=np.bool_)
        rewards, never = np.zeros(n), np.zeros(n, dtype=np.bool_)
        episodes, rewards[going], parts = self.played(
            self._episodes, going, self._rngs, actions[going]
        )
        self._episodes = self.begun(episodes, np.flatnonzero(waited), self._rngs)
        over, seen = self.are_over(self._episodes), self.observed(self._episodes)
        parts = [self._report(rows), *((some, self.returned(facts)) for some, facts in parts)]
        if self.autoreset_mode is not AutoresetMode.SAME_STEP or not over.any():
            return seen, rewards, over, never, gathered(parts, all_rows)
        ended = np.flatnonzero(over)
        final = np.full(n, None, dtype=object)
        for i in ended.tolist():
            final[i] = row_of(seen, i)
        info: dict[str, Any] = {"final_obs": final, "_final_obs": over.copy()}
        info |= {"final_info": gathered(parts, over), "_final_info": over.copy()}
        self._episodes = self.begun(self._episodes, ended, self._rngs)
        parts[0] = self._report(rows)
        info |= gathered(parts[:1], all_rows) | gathered(parts[1:], ~over)
        return self.observed(self._episodes), rewards, over, never, info

    def _report(self, rows: Indices) -> Part:
        return rows, self.returned(self.reported(self._episodes, rows))


def _autoreset_mode(mode: AutoresetMode | str) -> AutoresetMode:
    found = next((m for m in AutoresetMode if mode in (m, m.value)), None)
    if found is None:
        modes = ", ".join(repr(m.value) for m in AutoresetMode)
        raise InputError(f"autoreset_mode must be one of {modes}, got {brief(mode)}")
    return found


def _seeds(seed: Any, count: int) -> list[int | None]:
    """Return a seed for each environment: none, consecutive ones, or the given ones.

    Raises
    ------
    InputError : something else
    """
    if seed is None:
        return [None] * count
    if is_whole_number(seed):
        first = whole_number("seed", seed, least=0)
        return [first + k for k in range(count)]
    if isinstance(seed, str | Mapping) or not isinstance(seed, Iterable):
        raise InputError(
            f"seed must be a whole number, or one for each of {count} environments, got "
            f"{brief(seed)}"
        )
    each: list[Any] = list(cast("Iterable[Any]", seed))
    if len(each) != count:
        raise InputError(f"expected a seed for each of {count} environments, got {len(each)}")
    return [None if one is None else whole_number("seed", one, least=0) for one in each]


def _reset_mask(mask: Any, count: int) -> Flags:
    """Return the environments of a `reset`: a boolean for each, at least one of them True."""
    if mask is None:
        return np.ones(count, dtype=np.bool_)
    mask = np.asarray(mask)
    if mask.shape != (count,) or mask.dtype != np.bool_ or not mask.any():
        raise InputError(
            f"reset_mask must have a boolean for each of {count} environments, one of them True"
        )
    return mask.copy()
