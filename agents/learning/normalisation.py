"""What a policy sees, centred and scaled by its spread over the ices and targets of a task.

The numbers of `CurlingSheet-v0` are scaled to lie within ±1 on any ice anywhere; the friction of
sheets that are one event's differs by a few hundredths on that scale, which a network would have to
magnify first. Centre and spread belong to the policy and are saved with its weights.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import torch
from gymnasium import spaces
from numpy.typing import NDArray
from stable_baselines3.common.torch_layers import BaseFeaturesExtractor

FARTHEST = 5.0
"""Spreads from the centre beyond which a number counts no further."""
STILL = 1e-4
"""A number whose spread is smaller never changes, and is left out."""


class Standardised(BaseFeaturesExtractor):
    """Observations less their centre, over their spread.

    Parameters
    ----------
    space : of the observations
    centre, spread : of each number; without them, observations pass as they are
    """

    def __init__(
        self,
        space: spaces.Box,
        centre: NDArray[np.float32] | None = None,
        spread: NDArray[np.float32] | None = None,
    ) -> None:
        size = int(np.prod(space.shape))
        super().__init__(space, size)
        first = np.zeros(size, dtype=np.float32) if centre is None else centre
        scale = np.ones(size, dtype=np.float32)
        if spread is not None:
            scale = np.where(spread > STILL, 1.0 / np.maximum(spread, STILL), 0.0)
        self.register_buffer("centre", torch.as_tensor(first, dtype=torch.float32))
        self.register_buffer("scale", torch.as_tensor(scale, dtype=torch.float32))

    def forward(self, observations: torch.Tensor) -> torch.Tensor:
        """(n, size) observations as the network takes them."""
        centre: Any = self.centre
        scale: Any = self.scale
        return ((observations - centre) * scale).clamp(-FARTHEST, FARTHEST)
