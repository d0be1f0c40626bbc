"""Lessons for a network that calls shots: positions, and the value of every shot in them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from agents.playing.learned.values import ShotValues
from agents.playing.learned.views import views_of
from agents.playing.search.positions import SLOTS
from curling_env.envs.game.shots import SHOTS
from curling_env.game import GameSimulator
from curling_env.typing import Integers, Progress, Singles, no_progress


@dataclass(frozen=True, kw_only=True)
class Lessons:
    """Values of shots in positions.

    Parameters
    ----------
    observations : (n, k) flat observations of `CurlingEnd-v0`
    once : (n, 201) points after each shot, thrown once without error; NaN for an unavailable shot
    expected : (n, 201) expected points, with execution errors
    """

    observations: Singles
    once: Singles
    expected: Singles

    def __len__(self) -> int:
        return len(self.observations)

    def __getitem__(self, part: slice) -> Lessons:
        return Lessons(
            observations=self.observations[part],
            once=self.once[part],
            expected=self.expected[part],
        )


def lessons_of(
    observations: ArrayLike, simulator: GameSimulator, *, progress: Progress = no_progress
) -> Lessons:
    """Return lessons in positions, by simulation.

    Parameters
    ----------
    observations : (n, k) flat observations of `CurlingEnd-v0`
    simulator : ice, rules and hands of the game that they are of
    progress : called after every position

    Raises
    ------
    InputError : observations of another kind
    """
    views = views_of(observations, simulator, seed=0)
    once, expected = ShotValues().once_and_expected(views, progress=progress)
    seen = np.asarray(observations, dtype=np.float32)
    return Lessons(observations=seen, once=once, expected=expected)


def mirrored(lessons: Lessons) -> Lessons:
    """Return the same lessons with left and right exchanged: stones, handles, sides of hits."""
    observations = lessons.observations.copy()
    observations[:, -3 * SLOTS + 1 :: 3] *= -1
    return Lessons(
        observations=observations,
        once=lessons.once[:, _MIRROR],
        expected=lessons.expected[:, _MIRROR],
    )


def _mirror() -> Integers:
    """Return, for each shot of the list, the index of its mirror image."""
    by_look = {_look(k, 1.0): k for k in range(len(SHOTS))}
    return np.array([by_look[_look(k, -1.0)] for k in range(len(SHOTS))])


def _look(k: int, side: float) -> tuple[Any, ...]:
    shot = SHOTS[k]
    x, y = shot.place
    return (shot.kind, side * x, y, side * shot.handle, shot.stone, shot.weight, side * shot.off)


_MIRROR = _mirror()
