"""Network that calls shots in PyTorch, and its training on values of shots."""

from __future__ import annotations

from typing import Any

import numpy as np
import torch
from torch import nn

from agents.playing.learned.features import Seen, features_of
from agents.playing.learned.network import (
    ABOUT_PLACES,
    ABOUT_STONES,
    IMPOSSIBLE,
    SIZES,
    STONE_UNITS,
    WHOLE_UNITS,
    ShotNetwork,
)
from curling_env.game.rules.teams import STONES_PER_TEAM
from curling_env.typing import Progress, Singles, no_progress
from learn.lessons import Lessons, mirrored

FIRST = 4.0
"""Initial weight of the points that a shot promises in its value."""

FIRST_SHARE = 0.1
"""Factor on PyTorch's initial weights of all other inputs."""

NEARLY_AS_GOOD, ALIKE = 0.1, 0.05
"""Maximum loss of a shot that counts as nearly the best [points], and weight of the likelihood of
those shots against the points lost."""
LEARNING_RATE = 4e-3
"""Initial learning rate; it falls to zero."""
PART = 2000
"""Number of positions whose features are computed together."""


class ShotModule(nn.Module):
    """The same network with gradients, and a value head.

    Parameters
    ----------
    network : where the weights begin; by default at random
    """

    def __init__(self, network: ShotNetwork | None = None) -> None:
        super().__init__()
        self.layers = nn.ModuleDict(
            {name: nn.Linear(inputs, outputs) for name, (inputs, outputs) in SIZES.items()}
        )
        self.value = nn.Linear(WHOLE_UNITS, 1)
        with torch.no_grad():
            promises: Any = self.layers["prospects"]
            promises.weight.fill_(FIRST)
            for name in ("shots of a stone 2", "draws 2", "through"):
                head: Any = self.layers[name]
                head.weight.mul_(FIRST_SHARE)
                head.bias.zero_()
        if network is not None:
            with torch.no_grad():
                for name, (weights, offset) in network.layers.items():
                    layer: Any = self.layers[name]
                    layer.weight.copy_(torch.from_numpy(weights.T.copy()))
                    layer.bias.copy_(torch.from_numpy(offset.copy()))

    def forward(self, seen: Seen | tuple[torch.Tensor, ...]) -> tuple[torch.Tensor, torch.Tensor]:
        """Return values of the shots (n, 201) and of the positions (n,)."""
        of_stones, there, of_places, of_whole, possible, promised = map(torch.as_tensor, seen)
        n = len(of_whole)
        stones = self._relu("stone 2", self._relu("stone 1", of_stones)) * there[:, :, None]
        teams = stones.reshape(n, 2, STONES_PER_TEAM, STONE_UNITS).sum(2).reshape(n, -1)
        whole = self._relu("whole 1", torch.cat([teams, of_whole], 1))
        whole = self._relu("whole 2", whole)

        def head(name: str, each: torch.Tensor, shots: slice) -> torch.Tensor:
            beside = whole[:, None].expand(-1, each.shape[1], -1)
            of_each = promised[:, shots].reshape(n, each.shape[1], -1)
            x = torch.cat([each, of_each, beside], 2)
            return self.layers[f"{name} 2"](self._relu(f"{name} 1", x))

        worths = torch.cat(
            [
                head("draws", of_places, ABOUT_PLACES).reshape(n, -1),
                head("shots of a stone", stones, ABOUT_STONES).reshape(n, -1),
                self.layers["through"](whole),
            ],
            1,
        )
        promises: Any = self.layers["prospects"]
        worths = worths + promises.weight[0, 0] * promised
        return worths.masked_fill(~possible, IMPOSSIBLE), self.value(whole)[:, 0]

    def network(self) -> ShotNetwork:
        """Return the current weights as a NumPy network."""
        layers: dict[str, tuple[Singles, Singles]] = {}
        for name in SIZES:
            layer: Any = self.layers[name]
            layers[name] = (layer.weight.detach().numpy().T.copy(), layer.bias.detach().numpy())
        return ShotNetwork(layers=layers)

    def _relu(self, name: str, x: torch.Tensor) -> torch.Tensor:
        return torch.relu(self.layers[name](x))


def clone(
    lessons: Lessons,
    *,
    epochs: int = 20,
    batch: int = 256,
    held_out: float = 0.05,
    progress: Progress = no_progress,
) -> tuple[ShotNetwork, float]:
    """Train a network to call the most valuable shots (behaviour cloning with soft labels).

    Parameters
    ----------
    lessons : values of every shot in positions; each is also used mirrored
    epochs, batch : passes through the lessons, and positions for each step
    held_out : share of the lessons that only measure, the last ones
    progress : called after every epoch

    Returns
    -------
    the network, and `points_lost` in the lessons held out
    """
    torch.manual_seed(0)
    torch.set_num_threads(1)
    rng = np.random.default_rng(0)
    kept = max(int(len(lessons) * (1 - held_out)), 1)
    first = lessons[:kept]
    both = _tensors(first), _tensors(mirrored(first))
    seen = tuple(torch.cat(part) for part in zip(both[0][0], both[1][0], strict=True))
    lost = torch.cat([both[0][1], both[1][1]])
    wanted = torch.softmax(-lost / NEARLY_AS_GOOD, 1)
    module = ShotModule()
    steps = epochs * -(-len(lost) // batch)
    optimiser = torch.optim.AdamW(module.parameters(), lr=LEARNING_RATE, weight_decay=0.01)
    schedule = torch.optim.lr_scheduler.LambdaLR(optimiser, lambda k: max(1 - k / steps, 0.0))
    for epoch in range(epochs):
        for rows in np.array_split(rng.permutation(len(lost)), -(-len(lost) // batch)):
            worths, _ = module(tuple(part[rows] for part in seen))
            logs = torch.log_softmax(worths, 1)
            points = (logs.exp() * lost[rows].nan_to_num(posinf=0.0)).sum(1).mean()
            unlike = -(wanted[rows] * logs.clamp_min(-40.0)).sum(1).mean()
            loss = points + ALIKE * unlike
            optimiser.zero_grad()
            loss.backward()
            optimiser.step()
            schedule.step()
        progress("epochs", epoch + 1, epochs)
    return module.network(), points_lost(module, lessons[kept:])


def points_lost(module: ShotModule, lessons: Lessons) -> float:
    """Return the mean of the points that the called shots lose to the best ones."""
    seen, lost = _tensors(lessons)
    with torch.no_grad():
        worths, _ = module(seen)
    return float(lost[torch.arange(len(lost)), worths.argmax(1)].mean())


def _tensors(lessons: Lessons) -> tuple[tuple[torch.Tensor, ...], torch.Tensor]:
    """Return observed features and the loss of each shot to the best; infinite without a shot."""
    some = [lessons[k : k + PART] for k in range(0, len(lessons), PART)]
    parts = [features_of(part.observations, part.once) for part in some]
    seen = tuple(torch.from_numpy(np.concatenate(part)) for part in zip(*parts, strict=True))
    lost = np.nanmax(lessons.expected, axis=1, keepdims=True) - lessons.expected
    return seen, torch.from_numpy(np.nan_to_num(lost, nan=np.inf))
