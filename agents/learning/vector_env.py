"""Many sheets of `CurlingSheet-v0` side by side, as stable-baselines3 trains on them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode
from numpy.typing import NDArray
from stable_baselines3.common.monitor import Monitor
from stable_baselines3.common.vec_env import VecEnv

from agents.learning.random_ice import RandomIces
from curling_env.envs.sheet.vector_env import CurlingSheetVectorEnv
from curling_env.errors import InputError
from curling_env.throw import Skill, skill_named
from curling_env.typing import Floats

Indices = None | int | Iterable[int]

TOLD = ("distance_m", "status", "success")
"""What is passed on of a sheet's `info`."""


class Sheets(VecEnv):
    """A `CurlingSheetVectorEnv` behind stable-baselines3's interface.

    Parameters
    ----------
    envs : that begins an episode in the step that ends the one before, as stable-baselines3 does
    skill : of the hand that carries out what the agent means

    Raises
    ------
    InputError : other environments, or ones that begin at the next step

    Notes
    -----
    ``infos`` holds for each sheet `distance_m`, `status` and `success`; at the end of an episode
    also what `Monitor` tells, so that none is needed, `terminal_observation`, and `is_success`,
    from which stable-baselines3 makes its `success_rate`.
    """

    def __init__(
        self, envs: gymnasium.vector.VectorEnv[Any, Any, Any], skill: Skill | str = "none"
    ):
        sheets = envs.unwrapped
        if not isinstance(sheets, CurlingSheetVectorEnv):
            raise InputError(f"expected environments of CurlingSheet-v0, got {envs}")
        if sheets.metadata["autoreset_mode"] is not AutoresetMode.SAME_STEP:
            raise InputError("make the environments with autoreset_mode='SameStep'")
        self.sheets = sheets
        self._skill = skill_named(skill)
        self._rng = np.random.default_rng()
        self._actions = np.zeros((sheets.num_envs, 3), dtype=np.float32)
        self._rewards = np.zeros(sheets.num_envs)
        self._lengths = np.zeros(sheets.num_envs, dtype=np.int64)
        super().__init__(
            sheets.num_envs, sheets.single_observation_space, sheets.single_action_space
        )

    def seed(self, seed: int | None = None) -> Sequence[int | None]:
        """Seed the hand and, at the next reset, the sheets: s, s + 1, …"""
        if seed is not None:
            self._rng = np.random.default_rng(np.random.SeedSequence(seed).spawn(1)[0])
        return super().seed(seed)

    def reset(self) -> NDArray[np.float32]:
        """Begin all episodes."""
        observations, _ = self.sheets.reset(seed=list(self._seeds))
        self._reset_seeds()
        self._reset_options()
        self._rewards[:], self._lengths[:] = 0.0, 0
        return observations

    def step_async(self, actions: NDArray[np.float32]) -> None:
        """What is to be thrown; the hand adds its errors."""
        self._actions = actions
        if not self._skill.is_exact:
            throws = self.sheets.single.throw_range
            # They come in opposite pairs; half of twice as many are independent.
            errors = self._skill.errors(2 * self.num_envs, self._rng)[: self.num_envs]
            self._actions = throws.actions_of(throws.numbers_of(actions) + errors)

    def step_wait(self) -> tuple[NDArray[np.float32], Floats, NDArray[np.bool_], list[Any]]:
        """Throw on every sheet."""
        seen, rewards, over, _, told = self.sheets.step(self._actions)
        self._rewards += rewards
        self._lengths += 1
        infos: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
        for source, mask in ((told, ~over), (told.get("final_info", {}), over)):
            for i in np.flatnonzero(mask):
                for name in TOLD:
                    infos[i][name] = source[name][i]
        for i in np.flatnonzero(over):
            infos[i]["is_success"] = bool(infos[i]["success"])
            infos[i]["terminal_observation"] = told["final_obs"][i]
            infos[i]["TimeLimit.truncated"] = False
            infos[i]["episode"] = {"r": float(self._rewards[i]), "l": int(self._lengths[i])}
        self._rewards[over], self._lengths[over] = 0.0, 0
        return seen, rewards, over, infos

    def close(self) -> None:
        """Nothing is kept open."""
        self.sheets.close()

    def get_attr(self, attr_name: str, indices: Indices = None) -> list[Any]:
        """An attribute of the sheets; it is the same for all."""
        return [getattr(self.sheets, attr_name) for _ in self._get_indices(indices)]

    def set_attr(self, attr_name: str, value: Any, indices: Indices = None) -> None:
        """Refused: the sheets share their attributes."""
        raise InputError("sheets side by side share their attributes; make new ones")

    def env_method(
        self, method_name: str, *method_args: Any, indices: Indices = None, **method_kwargs: Any
    ) -> list[Any]:
        """What a method of a single environment says; the same for all."""
        said = getattr(self.sheets.single, method_name)(*method_args, **method_kwargs)
        return [said for _ in self._get_indices(indices)]

    def env_is_wrapped(self, wrapper_class: type, indices: Indices = None) -> list[bool]:
        """Whether episodes are told of as a wrapper does: `Monitor` only."""
        return [issubclass(wrapper_class, Monitor) for _ in self._get_indices(indices)]


class SheetsOnManyIces(VecEnv):
    """Groups of sheets, each on an ice of its own, which is another one every few throws.

    Parameters
    ----------
    num_envs : sheets in all
    ices : that are drawn
    knows : what the agent is told of them, see `agents.learning.random_ice.KNOWN`
    skill : of the hand
    groups : ices at once; divides `num_envs`
    throws_on_one : throws on every sheet before the ices are drawn anew
    settings : as for `CurlingSheetEnv`; an episode has one throw, and `throw_range` must be given:
        one made for an ice would tell of it

    Raises
    ------
    InputError : sheets that cannot be shared out evenly, or settings that make no sense
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
        self._each, self._lasts = num_envs // groups, throws_on_one
        self._rng = np.random.default_rng()
        self._age = 0
        self.groups = [self._group() for _ in range(groups)]
        first = self.groups[0]
        super().__init__(num_envs, first.observation_space, first.action_space)

    def _group(self) -> Sheets:
        """Some sheets on one more ice; its luck follows from the ices' randomness."""
        ice, known = self._ices.draw(self._rng, self._knows)
        sheets = Sheets(
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
        """Seed everything, from the next reset on."""
        if seed is not None:
            self._rng = np.random.default_rng(seed)
        return [seed] * self.num_envs

    def reset(self) -> NDArray[np.float32]:
        """Begin all episodes, on new ices."""
        self._age = 0
        self.groups = [self._group() for _ in self.groups]
        return np.concatenate([group.reset() for group in self.groups])

    def step_async(self, actions: NDArray[np.float32]) -> None:
        """What is to be thrown on each sheet."""
        for group, some in zip(self.groups, np.split(actions, len(self.groups)), strict=True):
            group.step_async(some)

    def step_wait(self) -> tuple[NDArray[np.float32], Floats, NDArray[np.bool_], list[Any]]:
        """Throw on every sheet."""
        parts = [group.step_wait() for group in self.groups]
        seen, rewards, over = (
            np.concatenate(column) for column in list(zip(*parts, strict=True))[:3]
        )
        infos = [info for part in parts for info in part[3]]
        self._age += 1
        if self._age >= self._lasts:
            seen = self.reset()
        return seen, rewards, over, infos

    def close(self) -> None:
        """Nothing is kept open."""
        for group in self.groups:
            group.close()

    def get_attr(self, attr_name: str, indices: Indices = None) -> list[Any]:
        """An attribute of the groups' sheets."""
        of_each = [value for group in self.groups for value in group.get_attr(attr_name)]
        return [of_each[i] for i in self._get_indices(indices)]

    def set_attr(self, attr_name: str, value: Any, indices: Indices = None) -> None:
        """Refused: the sheets of a group share their attributes."""
        raise InputError("sheets side by side share their attributes; make new ones")

    def env_method(
        self, method_name: str, *method_args: Any, indices: Indices = None, **method_kwargs: Any
    ) -> list[Any]:
        """What a method of the groups' single environments says."""
        said = [
            value
            for group in self.groups
            for value in group.env_method(method_name, *method_args, **method_kwargs)
        ]
        return [said[i] for i in self._get_indices(indices)]

    def env_is_wrapped(self, wrapper_class: type, indices: Indices = None) -> list[bool]:
        """Whether episodes are told of as a wrapper does: `Monitor` only."""
        return [issubclass(wrapper_class, Monitor) for _ in self._get_indices(indices)]
