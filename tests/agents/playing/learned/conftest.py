"""Ends in which shots of the list were called."""

from __future__ import annotations

from typing import NamedTuple

import gymnasium
import numpy as np
import pytest

import curling_env  # noqa: F401
from agents.playing import ShotNetwork
from agents.playing.learned.network import SIZES


class Called(NamedTuple):
    """Observations, possible shots, the called one, and its throw."""

    observations: np.ndarray
    masks: np.ndarray
    shots: np.ndarray
    calls: list


@pytest.fixture(scope="package")
def called() -> Called:
    """Shots called at random in a few ends."""
    env = gymnasium.make("CurlingEnd-v0", opponent="rulebased", actions="shots").unwrapped
    rng = np.random.default_rng(0)
    seen, masks, shots, calls = [], [], [], []
    for seed in range(12):
        observation, info = env.reset(seed=seed)
        over = False
        while not over:
            seen.append(observation)
            masks.append(info["action_mask"])
            shots.append(rng.choice(np.flatnonzero(masks[-1])))
            calls.append(env.call_of(shots[-1]))
            observation, _, over, _, info = env.step(shots[-1])
    return Called(np.stack(seen), np.stack(masks), np.array(shots), calls)


@pytest.fixture(scope="package")
def network() -> ShotNetwork:
    """Return an untrained network."""
    rng = np.random.default_rng(1)
    layers = {
        name: (
            (rng.normal(size=size) / np.sqrt(size[0])).astype(np.float32),
            rng.normal(size=size[1]).astype(np.float32),
        )
        for name, size in SIZES.items()
    }
    return ShotNetwork(layers=layers)
