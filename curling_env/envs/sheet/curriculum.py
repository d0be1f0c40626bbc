"""Positions that grow harder as tasks are done: a curriculum for `CurlingSheet-v0`.

The environment's `level` says how hard positions are; here is what moves it.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import gymnasium
import numpy as np
from gymnasium.vector import VectorEnv, VectorWrapper

from curling_env.envs.sheet.env import CurlingSheetEnv
from curling_env.envs.sheet.vector_env import CurlingSheetVectorEnv
from curling_env.errors import InputError


@dataclass(frozen=True, kw_only=True)
class Curriculum:
    """When positions become harder, and when easier.

    Parameters
    ----------
    start : level of the first episode
    step : by which the level moves
    window : episodes at one level before it is judged
    harder, easier : shares of them done at and above which it rises, and below which it falls

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
        if not (0 <= self.start <= 1 and 0 < self.step <= 1 and self.window >= 1):
            raise InputError(f"start and step lie within 0 and 1 and window is at least 1: {self}")
        if not 0 <= self.easier < self.harder <= 1:
            raise InputError(f"easier must lie below harder, both within 0 and 1: {self}")


class CurriculumProgress:
    """Where a learner stands in a curriculum.

    Parameters
    ----------
    curriculum : that it goes through
    """

    def __init__(self, curriculum: Curriculum) -> None:
        self.curriculum = curriculum
        self.level = curriculum.start
        self._done: deque[bool] = deque(maxlen=curriculum.window)

    def update(self, successes: Iterable[bool]) -> float:
        """The level after some episodes more, each done or not."""
        plan = self.curriculum
        for success in successes:
            self._done.append(bool(success))
            if len(self._done) < plan.window:
                continue
            share = sum(self._done) / plan.window
            change = plan.step * ((share >= plan.harder) - (share < plan.easier))
            if change:
                # What was done at another level says nothing about this one.
                self._done.clear()
                self.level = min(max(round(self.level + change, 9), 0.0), 1.0)
        return self.level


class CurriculumWrapper(
    gymnasium.Wrapper[Any, Any, Any, Any], gymnasium.utils.RecordConstructorArgs
):
    """`CurlingSheet-v0` with a curriculum; `progress.level` says where it stands.

    Parameters
    ----------
    env : `CurlingSheet-v0`

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
        """Throw a stone; at an episode's end, perhaps change the level."""
        seen, reward, over, cut, info = self.env.step(action)
        if over:
            self._sheet.level = self.progress.update([info["success"]])
        return seen, reward, over, cut, info


class VectorCurriculumWrapper(VectorWrapper[Any, Any, Any]):
    """Many sheets that go through one curriculum together.

    Parameters
    ----------
    envs : of `CurlingSheet-v0`

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
        """Throw a stone on every sheet; the level changes for the episodes that begin later."""
        seen, rewards, over, cut, info = self.env.step(actions)
        if np.any(over):
            ended = info.get("final_info", info)["success"]
            self._sheets.level = self.progress.update(ended[over].tolist())
        return seen, rewards, over, cut, info
