"""Positions become harder as the agent succeeds."""

from __future__ import annotations

import gymnasium
import numpy as np
import pytest

import curling_env  # noqa: F401  (registers the environments)
from curling_env.envs import (
    Curriculum,
    CurriculumProgress,
    CurriculumWrapper,
    VectorCurriculumWrapper,
)
from curling_env.errors import InputError
from curling_env.ice import load_ice
from curling_env.physics import Aim
from curling_env.sheet import Direction

SPIN = 1.5


AIM = Aim(load_ice("standard"), Direction.AWAY)


def test_a_curriculum_rises_with_success_and_falls_without():
    progress = CurriculumProgress(Curriculum(start=0.2, step=0.2, window=10))
    assert progress.update([True] * 9) == pytest.approx(0.2)
    assert progress.update([True]) == pytest.approx(0.4)
    assert progress.update([True, False] * 20) == pytest.approx(0.4)
    assert progress.update([False] * 30) < 0.2
    assert progress.update([True] * 200) == 1.0
    assert progress.update([False] * 200) == 0.0
    with pytest.raises(InputError, match="easier"):
        Curriculum(harder=0.2)
    with pytest.raises(InputError, match="window must be a whole number"):
        Curriculum(window=1.5)


def test_sheets_go_through_a_curriculum():
    env = CurriculumWrapper(
        gymnasium.make("CurlingSheet-v0", stones=3), Curriculum(step=0.5, window=2)
    )
    button = env.unwrapped.action_of(AIM.draw(0.0, 0.0, SPIN))
    for _ in range(2):
        env.reset(seed=0, options={"target": (0.0, 0.0), "stones": ()})
        env.step(button)
    assert env.progress.level == env.unwrapped.level == 0.5
    for mode in ("NextStep", "SameStep"):
        sheets = gymnasium.make_vec("CurlingSheet-v0", num_envs=4, autoreset_mode=mode)
        many = VectorCurriculumWrapper(sheets, Curriculum(step=0.5, window=4))
        many.reset(seed=0)
        on_button = many.unwrapped.action_of(AIM.draw(0.0, 0.0, SPIN))
        many.step(np.tile(on_button, (4, 1)))
        assert many.unwrapped.level == many.progress.level == 0.5
    with pytest.raises(InputError, match="CurlingSheet-v0"):
        CurriculumWrapper(gymnasium.make("CurlingEnd-v0"))
