"""Vectorised `CurlingSheet-v0` environments for training with stable-baselines3."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode
from stable_baselines3.common.monitor import Monitor
from stable_baselines3.common.vec_env import VecEnv

from agents.learning.random_ice import RandomIces
from curling_env.envs.sheet.vector_env import CurlingSheetVectorEnv
from curling_env.envs.stable_baselines import CurlingVecEnv
from curling_env.errors import InputError
from curling_env.throw import Skill, skill_named
from curling_env.typing import Flags, Floats, Singles

EnvIndices = None | int | Iterable[int]

INFO_KEYS = ("distance_m", "status", "success")
"""Keys of an environment's `info` that are passed on."""


class SheetVecEnv(CurlingVecEnv):
    """Environments of `CurlingSheet-v0` whose throws have the execution errors of a player.

    The errors come from a separate generator, in opposite pairs as the trainers have always drawn
    them; the option `skill` of the environments draws each from the sheet's.

    Parameters
    ----------
    envs : environments that begin an episode in the step that ends the one before
    skill : player whose execution error is added to the actions

    Raises
    ------
    InputError : other environments, or ones that begin an episode in the next step

    Notes
    -----
    ``infos`` has `distance_m`, `status` and `success` of each environment, and what
    `CurlingVecEnv` adds at the end of an episode.
    """

    def __init__(
        self, envs: gymnasium.vector.VectorEnv[Any, Any, Any], skill: Skill | str = "none"
    ):
        if not isinstance(envs.unwrapped, CurlingSheetVectorEnv):
            raise InputError(f"expected environments of CurlingSheet-v0, got {envs}")
        self._skill = skill_named(skill)
        self._rng = np.random.default_rng()
        super().__init__(envs, told=INFO_KEYS)

    def seed(self, seed: int | None = None) -> Sequence[int | None]:
        """Seed the execution errors now and the environments at the next reset: s, s + 1, …"""
        if seed is not None:
            self._rng = np.random.default_rng(np.random.SeedSequence(seed).spawn(1)[0])
        return super().seed(seed)

    def step_async(self, actions: Singles) -> None:
        """Take the actions and add the player's errors."""
        if not self._skill.is_exact:
            throws = self.sheets.throw_range
            # Errors come in pairs of opposite sign; half of twice as many are independent.
            errors = self._skill.errors(2 * self.num_envs, self._rng)[: self.num_envs]
            actions = throws.actions_of(throws.numbers_of(actions) + errors)
        super().step_async(actions)


class RandomIceVecEnv(VecEnv):
    """Groups of environments, each with an ice that is drawn again every few throws.

    Parameters
    ----------
    num_envs : total number of environments
    ices : distribution of the ices
    knows : the agent's knowledge of them, see `agents.learning.random_ice.KNOWLEDGE`
    skill : player whose execution error is added to the actions
    groups : number of ices at a time; it divides `num_envs`
    throws_on_one : throws in every environment before the ices are drawn again
    settings : settings of `CurlingSheetEnv`. An episode has one throw, and `throw_range` must be
        given, because one made for an ice would reveal it

    Raises
    ------
    InputError : environments that cannot be divided evenly, or impossible settings
    """

    def __init__(
        self,
        num_envs: int,
        *,
        ices: RandomIces,
        knows: str = "map",
        skill: Skill | str = "none",
        groups: int,
        throws_on_one: int = 2,
        **settings: Any,
    ) -> None:
        if groups < 1 or num_envs % groups:
            raise InputError(f"{num_envs} sheets cannot be shared out evenly to {groups} ices")
        if settings.get("throw_range") is None:
            raise InputError("on random ices the range of throws must be given: throw_range")
        self._ices, self._knows, self._skill = ices, knows, skill
        self._settings = settings
        self._each, self._throws_on_one = num_envs // groups, throws_on_one
        self._rng = np.random.default_rng()
        self._age = 0
        self.groups = [self._group() for _ in range(groups)]
        first = self.groups[0]
        super().__init__(num_envs, first.observation_space, first.action_space)

    def _group(self) -> SheetVecEnv:
        """Make environments on one more ice, seeded from the randomness of the ices."""
        ice, known = self._ices.draw(self._rng, self._knows)
        sheets = SheetVecEnv(
            CurlingSheetVectorEnv(
                self._each,
                ice=ice,
                known_ice=known,
                autoreset_mode=AutoresetMode.SAME_STEP,
                **self._settings,
            ),
            self._skill,
        )
        sheets.seed(int(self._rng.integers(2**31)))
        return sheets

    def seed(self, seed: int | None = None) -> Sequence[int | None]:
        """Seed all randomness, from the next reset on."""
        if seed is not None:
            self._rng = np.random.default_rng(seed)
        return [seed] * self.num_envs

    def reset(self) -> Singles:
        """Begin all episodes, on new ices."""
        self._age = 0
        self.groups = [self._group() for _ in self.groups]
        return np.concatenate([group.reset() for group in self.groups])

    def step_async(self, actions: Singles) -> None:
        """Take the actions of all environments."""
        for group, some in zip(self.groups, np.split(actions, len(self.groups)), strict=True):
            group.step_async(some)

    def step_wait(self) -> tuple[Singles, Floats, Flags, list[Any]]:
        """Throw in every environment."""
        parts = [group.step_wait() for group in self.groups]
        seen, rewards, over = (
            np.concatenate(column) for column in list(zip(*parts, strict=True))[:3]
        )
        infos = [info for part in parts for info in part[3]]
        self._age += 1
        if self._age >= self._throws_on_one:
            seen = self.reset()
        return seen, rewards, over, infos

    def close(self) -> None:
        """Close the environments."""
        for group in self.groups:
            group.close()

    def get_attr(self, attr_name: str, indices: EnvIndices = None) -> list[Any]:
        """Return an attribute of each group's environments."""
        of_each = [value for group in self.groups for value in group.get_attr(attr_name)]
        return [of_each[i] for i in self._get_indices(indices)]

    def set_attr(self, attr_name: str, value: Any, indices: EnvIndices = None) -> None:
        """Refuse: the environments of a group share their attributes."""
        raise InputError("environments side by side share their attributes; make new ones")

    def env_method(
        self, method_name: str, *method_args: Any, indices: EnvIndices = None, **method_kwargs: Any
    ) -> list[Any]:
        """Return the results of a method of each group's single environment."""
        results = [
            value
            for group in self.groups
            for value in group.env_method(method_name, *method_args, **method_kwargs)
        ]
        return [results[i] for i in self._get_indices(indices)]

    def env_is_wrapped(self, wrapper_class: type, indices: EnvIndices = None) -> list[bool]:
        """Return whether the wrapper's work is done here: only that of `Monitor`."""
        return [issubclass(wrapper_class, Monitor) for _ in self._get_indices(indices)]
