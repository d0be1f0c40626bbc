"""A value network fitted to how ends were scored."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from agents.playing.league.self_play import PlayedEnds
from agents.playing.league.tuning import DELIVERIES_PER_STEP, NETWORK_WIDTHS
from agents.playing.search.positions import MAX_POINTS, SCORES, SLOTS
from agents.playing.search.value_network import (
    POSITION_FEATURES,
    STONE_FEATURES,
    ValueNetwork,
    position_features,
    stone_features,
)
from curling_env.game.rules.lines import Lines
from curling_env.typing import (
    Flags,
    Floats,
    Indices,
    Integers,
    Progress,
    no_progress,
    with_progress,
)


class _Row(NamedTuple):
    """Features of a batch's positions after one delivery, and how the ends were scored."""

    stones: NDArray[np.float32]
    places: Indices
    positions: NDArray[np.float32]
    score: Integers


def fit_value_network(
    lines: Lines,
    experience: Iterable[PlayedEnds],
    rng: np.random.Generator,
    *,
    layers: Sequence[int] = NETWORK_WIDTHS,
    epochs: int = 8,
    learning_rate: float = 3e-3,
    begin: ValueNetwork | None = None,
    progress: Progress = no_progress,
) -> ValueNetwork:
    """Fit the network that best predicts how ends were scored; each is also seen mirrored.

    The first weights are those of a network to begin with, or come from torch's own generator,
    which the caller seeds.

    Parameters
    ----------
    lines : lines of the sheet
    experience : ends that were played
    rng : source of the order of training
    layers : units of the hidden layers: two for a stone, two for the position
    epochs : passes through the experience
    learning_rate : highest learning rate of the schedule
    begin : a network to begin with, whose layers have these units; None for random weights
    progress : called after each epoch
    """
    import torch
    from torch import nn

    rows = [row for ends in experience for row in _rows_of(lines, ends)]
    a, b, c, d = layers
    stone = nn.Sequential(nn.Linear(STONE_FEATURES, a), nn.ReLU(), nn.Linear(a, b), nn.ReLU())
    position = nn.Sequential(
        *(nn.Linear(2 * b + POSITION_FEATURES, c), nn.ReLU(), nn.Linear(c, d), nn.ReLU()),
        nn.Linear(d, len(SCORES)),
    )
    linear = [module for module in (*stone, *position) if isinstance(module, nn.Linear)]
    if begin is not None:
        with torch.no_grad():
            for module, (weights, offset) in zip(linear, begin.layers, strict=True):
                module.weight.copy_(torch.from_numpy(weights.T.copy()))
                module.bias.copy_(torch.from_numpy(offset.copy()))
    steps = epochs * -(-len(rows) // DELIVERIES_PER_STEP)
    optimiser = torch.optim.AdamW([*stone.parameters(), *position.parameters()], weight_decay=1e-3)
    schedule = torch.optim.lr_scheduler.OneCycleLR(optimiser, learning_rate, total_steps=steps + 1)
    for _ in with_progress(range(epochs), "learning", progress):
        order = rng.permutation(len(rows))
        for first in range(0, len(rows), DELIVERIES_PER_STEP):
            some = [rows[k] for k in order[first : first + DELIVERIES_PER_STEP]]
            begins = np.cumsum([0, *(SLOTS * len(row.score) for row in some)])
            team = np.concatenate([r.places + at for r, at in zip(some, begins, strict=False)])
            team //= SLOTS // 2
            ends = sum(len(row.score) for row in some)
            looked = stone(torch.from_numpy(np.concatenate([row.stones for row in some])))
            teams = torch.zeros(2 * ends, b).index_add(0, torch.from_numpy(team), looked)
            whole = torch.from_numpy(np.concatenate([row.positions for row in some]))
            logits = position(torch.cat([teams.reshape(ends, -1), whole], dim=1))
            score = torch.from_numpy(np.concatenate([row.score for row in some]))
            loss = nn.functional.cross_entropy(logits, score)
            optimiser.zero_grad()
            loss.backward()
            optimiser.step()
            schedule.step()
    return ValueNetwork(
        layers=tuple(
            (m.weight.detach().numpy().T.copy(), m.bias.detach().numpy().copy()) for m in linear
        )
    )


def negative_log_likelihood(network: ValueNetwork, lines: Lines, ends: PlayedEnds) -> float:
    """Mean over positions of minus the log of the probability of the score that came."""
    losses: list[Floats] = []
    for left, stones, here, score in _positions_of(ends):
        skill = np.broadcast_to(ends.skill, len(here))[here]
        shares = network.score_probabilities(lines, stones, left, ends.score_values[here], skill)
        losses.append(-np.log(shares[np.arange(len(score)), score] + 1e-9))
    return float(np.concatenate(losses).mean())


def _positions_of(ends: PlayedEnds) -> Iterator[tuple[int, Floats, Flags, Integers]]:
    """After each delivery that was not random: stones left, positions, their ends and scores."""
    deliveries = len(ends.stones)
    score = np.clip(ends.score, -MAX_POINTS, MAX_POINTS) + MAX_POINTS
    for delivered in range(deliveries - 1):
        here = np.broadcast_to(ends.greedy_from, len(score)) <= delivered
        stones = ends.stones[delivered][here].astype(np.float64)
        yield deliveries - 1 - delivered, stones, here, score[here]


def _rows_of(lines: Lines, ends: PlayedEnds) -> Iterator[_Row]:
    for left, stones, here, score in _positions_of(ends):
        skill = np.broadcast_to(ends.skill, len(here))[here]
        for mirror in (1.0, -1.0):
            mirrored = stones * np.array([mirror, 1.0])
            features, places = stone_features(lines, mirrored)
            whole = position_features(lines, mirrored, left, ends.score_values[here], skill)
            yield _Row(features, places, whole, score)
