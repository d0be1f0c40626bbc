"""The network that calls shots as PyTorch trains it, and learning from recorded shots.

Needs PyTorch: ``pip install 'curling-sheet[train]'``. What has been learnt needs only NumPy.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import torch
from torch import nn

from agents.playing.learned.features import Seen, features_of
from agents.playing.learned.imitation import KINSHIP, Lessons, mirrored
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

FIRST = {"prospects": 4.0, "blocked": -2.0}
"""By how much a point that a shot promises, and a stone on its way, change its worth at first."""

FIRST_SHARE = 0.1
"""What else is seen begins to count this share of what PyTorch makes it."""


class ShotModule(nn.Module):
    """The same network with gradients, and a value beside it.

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
            for name, first in FIRST.items():
                one: Any = self.layers[name]
                one.weight.fill_(first)
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
        """Worths of the shots (n, 201), and the value of each position (n,)."""
        of_stones, there, of_places, of_whole, promised, ways = map(torch.as_tensor, seen)
        n = len(of_whole)
        stones = self._relu("stone 2", self._relu("stone 1", of_stones)) * there[:, :, None]
        teams = stones.reshape(n, 2, STONES_PER_TEAM, STONE_UNITS).sum(2).reshape(n, -1)
        whole = self._relu("whole 1", torch.cat([teams, of_whole], 1))
        whole = self._relu("whole 2", whole)

        def head(name: str, each: torch.Tensor, shots: slice) -> torch.Tensor:
            beside = whole[:, None].expand(-1, each.shape[1], -1)
            of_each = [part[:, shots].reshape(n, each.shape[1], -1) for part in (promised, ways)]
            x = torch.cat([each, *of_each, beside], 2)
            return self.layers[f"{name} 2"](self._relu(f"{name} 1", x))

        shots = head("shots of a stone", stones, ABOUT_STONES)
        worths = torch.cat(
            [
                head("draws", of_places, ABOUT_PLACES).reshape(n, -1),
                shots.masked_fill(there[:, :, None] == 0, IMPOSSIBLE).reshape(n, -1),
                self.layers["through"](whole),
            ],
            1,
        )
        layers: Any = self.layers
        gains = [layers[name].weight[0, 0] for name in ("prospects", "blocked")]
        return worths + gains[0] * promised + gains[1] * ways, self.value(whole)[:, 0]

    def network(self) -> ShotNetwork:
        """The weights as they are, for NumPy."""
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
    epochs: int = 6,
    batch: int = 256,
    learning_rate: float = 1e-3,
    held_out: float = 0.05,
    seed: int = 0,
    progress: Progress = no_progress,
) -> tuple[ShotNetwork, Mapping[str, float]]:
    """A network that calls the shots that were called (behaviour cloning).

    Parameters
    ----------
    lessons : which shot was called in which position; each also serves mirrored, and speaks a
        little for shots that are nearly the same
    epochs, batch, learning_rate : of the learning; the rate falls to zero
    held_out : share of the lessons that only measure, the last ones
    seed : seed of everything random
    progress : called after every epoch

    Returns
    -------
    the network; and of the lessons held out the mean `loss` and the share called `alike`
    """
    torch.manual_seed(seed)
    torch.set_num_threads(1)
    rng = np.random.default_rng(seed)
    kept = max(int(len(lessons) * (1 - held_out)), 1)
    first = part_of(lessons, slice(kept))
    seen, shots = _tensors(first, mirrored(first))
    kinship = torch.from_numpy(KINSHIP)
    module = ShotModule()
    steps = epochs * -(-len(shots) // batch)
    optimiser = torch.optim.AdamW(module.parameters(), lr=learning_rate, weight_decay=0.01)
    schedule = torch.optim.lr_scheduler.LambdaLR(optimiser, lambda k: max(1 - k / steps, 0.0))
    for epoch in range(epochs):
        for rows in np.array_split(rng.permutation(len(shots)), -(-len(shots) // batch)):
            worths, _ = module(tuple(part[rows] for part in seen))
            wanted = kinship[shots[rows]] * (worths > IMPOSSIBLE / 2)
            wanted = wanted / wanted.sum(1, keepdim=True).clamp_min(1e-9)
            logs = torch.log_softmax(worths, 1).clamp_min(-30.0)
            loss = -(wanted * logs).sum(1).mean()
            optimiser.zero_grad()
            loss.backward()
            optimiser.step()
            schedule.step()
        progress("epochs", epoch + 1, epochs)
    rest = part_of(lessons, slice(kept, None))
    return module.network(), _measured(module, rest) if len(rest) else {}


def part_of(lessons: Lessons, part: slice) -> Lessons:
    """Some of the lessons."""
    return Lessons(observations=lessons.observations[part], shots=lessons.shots[part])


def _measured(module: ShotModule, lessons: Lessons) -> dict[str, float]:
    seen, shots = _tensors(lessons)
    with torch.no_grad():
        worths, _ = module(seen)
        loss = nn.functional.cross_entropy(worths, shots)
    alike = (worths.argmax(1) == shots).float().mean()
    return {"loss": float(loss), "alike": float(alike)}


def _tensors(*several: Lessons) -> tuple[tuple[torch.Tensor, ...], torch.Tensor]:
    """Features and shots of lessons, one after the other."""
    each = [features_of(lessons.observations) for lessons in several]
    seen = tuple(torch.from_numpy(np.concatenate(part)) for part in zip(*each, strict=True))
    return seen, torch.from_numpy(np.concatenate([lessons.shots for lessons in several]))
