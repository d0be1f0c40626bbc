"""A curriculum for `CurlingSheet-v0`: positions become harder as the agent succeeds.

The environment's `level` is the difficulty of its positions, from 0 to 1. The wrappers here raise
and lower it.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import gymnasium
import numpy as np
from gymnasium.vector import VectorEnv, VectorWrapper

from curling_env.envs.options import whole_number
from curling_env.envs.sheet.env import CurlingSheetEnv
from curling_env.envs.sheet.vector_env import CurlingSheetVectorEnv
from curling_env.errors import InputError


@dataclass(frozen=True, kw_only=True)
class Curriculum:
    """Rule of the difficulty of positions.

    Parameters
    ----------
    start : level of the first episode
    step : how much the level rises or falls
    window : number of episodes at one level before it is changed
    harder : share of successes at and above which the level rises
    easier : share of successes below which the level falls

    Raises
    ------
    InputError : numbers that make no curriculum
    """

    start: float = 0.0
    step: float = 0.1
    window: int = 100
    harder: float = 0.7
    easier: float = 0.3

    def __post_init__(self) -> None:
        whole_number("window", self.window, least=1)
        if not (0 <= self.start <= 1 and 0 < self.step <= 1):
            raise InputError(f"start and step must lie within 0 and 1: {self}")
        if not 0 <= self.easier < self.harder <= 1:
            raise InputError(f"easier must lie below harder, both within 0 and 1: {self}")


class CurriculumProgress:
    """Progress of a learner through a curriculum.

    Parameters
    ----------
    curriculum : the curriculum it goes through
    """

    def __init__(self, curriculum: Curriculum) -> None:
        self.curriculum = curriculum
        self.level = curriculum.start
        self._recent: deque[bool] = deque(maxlen=curriculum.window)

    def update(self, successes: Iterable[bool]) -> float:
        """Return the level after further episodes, each a success or a failure."""
        curriculum = self.curriculum
        for success in successes:
            self._recent.append(bool(success))
            if len(self._recent) < curriculum.window:
                continue
            share = sum(self._recent) / curriculum.window
            change = curriculum.step * ((share >= curriculum.harder) - (share < curriculum.easier))
            if change:
                # Successes at another level do not count for this one.
                self._recent.clear()
                self.level = min(max(round(self.level + change, 9), 0.0), 1.0)
        return self.level


class CurriculumWrapper(
    gymnasium.Wrapper[Any, Any, Any, Any], gymnasium.utils.RecordConstructorArgs
):
    """`CurlingSheet-v0` with a curriculum; `progress.level` is the current level.

    Parameters
    ----------
    env : `CurlingSheet-v0`
    curriculum : when the level rises and falls

    Raises
    ------
    InputError : another environment
    """

    def __init__(self, env: gymnasium.Env[Any, Any], curriculum: Curriculum | None = None) -> None:
        gymnasium.utils.RecordConstructorArgs.__init__(self, curriculum=curriculum)
        super().__init__(env)
        sheet = env.unwrapped
        if not isinstance(sheet, CurlingSheetEnv):
            raise InputError(f"expected CurlingSheet-v0, got {env}")
        self._sheet = sheet
        self.progress = CurriculumProgress(curriculum or Curriculum())
        self._sheet.level = self.progress.level

    def step(self, action: Any) -> tuple[Any, Any, bool, bool, dict[str, Any]]:
        """Throw a stone; the level may change when the episode ends."""
        observation, reward, terminated, truncated, info = self.env.step(action)
        if terminated:
            self._sheet.level = self.progress.update([info["success"]])
        return observation, reward, terminated, truncated, info


class VectorCurriculumWrapper(VectorWrapper[Any, Any, Any]):
    """Many sheets of `CurlingSheet-v0` that go through one curriculum together.

    Parameters
    ----------
    envs : the sheets
    curriculum : when the level rises and falls

    Raises
    ------
    InputError : other environments
    """

    def __init__(
        self, envs: VectorEnv[Any, Any, Any], curriculum: Curriculum | None = None
    ) -> None:
        super().__init__(envs)
        sheets = envs.unwrapped
        if not isinstance(sheets, CurlingSheetVectorEnv):
            raise InputError(f"expected sheets of CurlingSheet-v0, got {envs}")
        self._sheets = sheets
        self.progress = CurriculumProgress(curriculum or Curriculum())
        self._sheets.level = self.progress.level

    def step(self, actions: Any) -> tuple[Any, Any, Any, Any, dict[str, Any]]:
        """Throw a stone on every sheet; a new level applies to later episodes."""
        observations, rewards, terminated, truncated, info = self.env.step(actions)
        if np.any(terminated):
            ended = info.get("final_info", info)["success"]
            self._sheets.level = self.progress.update(ended[terminated].tolist())
        return observations, rewards, terminated, truncated, info
