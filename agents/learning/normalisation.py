"""Normaliser of observations by their mean and standard deviation over the task.

`CurlingSheet-v0` scales its numbers to within ±1 on any ice. On that scale the friction of the
sheets of one event differs by a few hundredths, which a network would have to magnify first. Mean
and standard deviation belong to the policy and are saved with its weights.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import torch
from gymnasium import spaces
from stable_baselines3.common.torch_layers import BaseFeaturesExtractor

from agents.learning.actor import MAX_DEVIATION
from curling_env.typing import Singles

CONSTANT_BELOW = 1e-4
"""Standard deviation below which a number counts as constant and is dropped."""


class ObservationNormaliser(BaseFeaturesExtractor):
    """Observations minus their mean, over their standard deviation.

    Parameters
    ----------
    space : space of the observations
    mean, deviation : mean and standard deviation of each number, (size,); without them,
        observations pass unchanged
    """

    def __init__(
        self,
        space: spaces.Box,
        mean: Singles | None = None,
        deviation: Singles | None = None,
    ) -> None:
        size = int(np.prod(space.shape))
        super().__init__(space, size)
        first = np.zeros(size, dtype=np.float32) if mean is None else mean
        scale = np.ones(size, dtype=np.float32)
        if deviation is not None:
            varies = deviation > CONSTANT_BELOW
            scale = np.where(varies, 1.0 / np.maximum(deviation, CONSTANT_BELOW), 0.0)
        self.register_buffer("centre", torch.as_tensor(first, dtype=torch.float32))
        self.register_buffer("scale", torch.as_tensor(scale, dtype=torch.float32))

    def forward(self, observations: torch.Tensor) -> torch.Tensor:
        """Return normalised observations, (n, size)."""
        centre: Any = self.centre
        scale: Any = self.scale
        return ((observations - centre) * scale).clamp(-MAX_DEVIATION, MAX_DEVIATION)
