"""Vector environments in the form of stable-baselines3.

Needs stable-baselines3: ``pip install 'curling-sheet[train]'``.
"""

# stable-baselines3 leaves parts untyped.
# pyright: reportUnknownMemberType=false, reportMissingTypeStubs=false

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv
from stable_baselines3.common.monitor import Monitor
from stable_baselines3.common.vec_env import VecEnv

from curling_env.envs.core import PART
from curling_env.envs.options import whole_number
from curling_env.envs.vector import EnvsTogether
from curling_env.errors import InputError
from curling_env.typing import Flags, Floats

EnvIndices = None | int | Iterable[int]

INFO_KEYS = ("distance_m", "status", "success", "score", "reward_parts", "action_mask")
"""Parts of an environment's `info` that are passed on, if present."""


class CurlingVecEnv(VecEnv):
    """Vector environment of sheets or ends, simulated together, for stable-baselines3.

    ``PPO("MlpPolicy", CurlingVecEnv("CurlingSheet-v0", n_envs=256, skill="club"))``

    Parameters
    ----------
    envs : ``"CurlingSheet-v0"`` or ``"CurlingEnd-v0"``; or such a vector environment, made with
        ``autoreset_mode="SameStep"``
    n_envs : number of environments, where a name is given
    seed : seed of the first of them at the first reset; the others count up
    info_keywords : names of the parts of `info` that are passed on
    options : options of the environment, where a name is given

    Raises
    ------
    InputError : other environments, ones that begin an episode in another step, or an
        invalid option

    Notes
    -----
    At the end of an episode ``infos`` also holds `terminal_observation`, what `Monitor` adds, so
    that no monitor is needed, and for a sheet `is_success`, from which stable-baselines3 computes
    its `success_rate`. `infos` of a step that ends an episode are those of the episode that ended.
    """

    def __init__(
        self,
        envs: str | VectorEnv[Any, Any, Any] = "CurlingSheet-v0",
        n_envs: int | None = None,
        *,
        seed: int | None = None,
        info_keywords: Sequence[str] = INFO_KEYS,
        **options: Any,
    ) -> None:
        if isinstance(envs, str):
            number = whole_number("n_envs", 1 if n_envs is None else n_envs, least=1)
            envs = gymnasium.make_vec(
                envs, num_envs=number, autoreset_mode=AutoresetMode.SAME_STEP, **options
            )
        elif options or n_envs is not None:
            raise InputError("give options and n_envs together with a name, not with environments")
        inner = envs.unwrapped
        if not isinstance(inner, EnvsTogether):
            raise InputError(f"expected CurlingSheet-v0 or CurlingEnd-v0, got {envs}")
        if inner.metadata["autoreset_mode"] is not AutoresetMode.SAME_STEP:
            raise InputError("make the environments with autoreset_mode='SameStep'")
        self.sheets: Any = inner
        self._info_keys = tuple(info_keywords)
        self._actions: Any = None
        self._rewards = np.zeros(inner.num_envs)
        self._lengths = np.zeros(inner.num_envs, dtype=np.int64)
        super().__init__(inner.num_envs, inner.single_observation_space, inner.single_action_space)
        if seed is not None:
            self.seed(seed)

    def reset(self) -> Any:
        """Begin all episodes."""
        observations, _ = self.sheets.reset(seed=list(self._seeds), options=self._asked())
        self._reset_seeds()
        self._reset_options()
        self._rewards[:], self._lengths[:] = 0.0, 0
        return observations

    def _asked(self) -> dict[str, Any] | None:
        """Return the options of a reset, which all environments share.

        Raises
        ------
        InputError : options that differ from environment to environment
        """
        first = self._options[0] if self._options else {}
        if any(options != first for options in self._options):
            raise InputError("expected the same reset options for all environments")
        return first or None

    def step_async(self, actions: Any) -> None:
        """Take the actions of all environments."""
        self._actions = actions

    def step_wait(self) -> tuple[Any, Floats, Flags, list[Any]]:
        """Make a step in every environment."""
        seen, rewards, over, _, info = self.sheets.step(self._actions)
        self._rewards += rewards
        self._lengths += 1
        infos: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
        for source, mask in ((info, ~over), (info.get("final_info", {}), over)):
            rows: list[int] = np.flatnonzero(mask).tolist()
            for name in self._info_keys:
                if name in source:
                    _share_out(infos, rows, name, source)
            if "reward_parts" in self._info_keys:
                parts = [name for name in source if name.startswith(PART)]
                for i in rows if parts else ():
                    infos[i]["reward_parts"] = {
                        name.removeprefix(PART): source[name][i] for name in parts
                    }
        for i in np.flatnonzero(over).tolist():
            if "success" in infos[i]:
                infos[i]["is_success"] = bool(infos[i]["success"])
            infos[i]["terminal_observation"] = info["final_obs"][i]
            infos[i]["TimeLimit.truncated"] = False
            infos[i]["episode"] = {"r": float(self._rewards[i]), "l": int(self._lengths[i])}
        self._rewards[over], self._lengths[over] = 0.0, 0
        return seen, rewards, over, infos

    def close(self) -> None:
        """Close the environments."""
        self.sheets.close()

    def get_attr(self, attr_name: str, indices: EnvIndices = None) -> list[Any]:
        """Return an attribute of the environments, the same for all."""
        return [getattr(self.sheets, attr_name) for _ in self._get_indices(indices)]

    def set_attr(self, attr_name: str, value: Any, indices: EnvIndices = None) -> None:
        """Not possible: the environments share their attributes."""
        raise InputError("attributes are shared by all environments; make new environments")

    def env_method(
        self, method_name: str, *method_args: Any, indices: EnvIndices = None, **method_kwargs: Any
    ) -> list[Any]:
        """Return the result of a method: `action_masks` of each, others of all together."""
        result = getattr(self.sheets, method_name)(*method_args, **method_kwargs)
        of_each = method_name == "action_masks"
        return [result[i] if of_each else result for i in self._get_indices(indices)]

    def env_is_wrapped(self, wrapper_class: type, indices: EnvIndices = None) -> list[bool]:
        """Return whether a wrapper is built in: only `Monitor` is."""
        return [issubclass(wrapper_class, Monitor) for _ in self._get_indices(indices)]


def _share_out(
    infos: list[dict[str, Any]], rows: list[int], name: str, source: dict[str, Any]
) -> None:
    """Distribute a part of `info` to the environments that have it."""
    value: Any = source[name]
    there = source[f"_{name}"]
    for i in rows:
        if there[i]:
            infos[i][name] = value[i]
