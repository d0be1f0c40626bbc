"""Value network fitted to positions and the scores of their ends."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from agents.playing.league.self_play import PlayedEnds, shares_of
from agents.playing.league.tuning import BATCH_SIZE_FACTOR, NETWORK_WIDTHS, PARALLEL_ENDS
from agents.playing.search.positions import SCORES, SLOTS
from agents.playing.search.value_network import (
    POSITION_FEATURES,
    STONE_FEATURES,
    ValueNetwork,
    position_features,
    stone_features,
)
from curling_env.game.rules.lines import Lines
from curling_env.typing import Floats, Indices, Integers, Progress, no_progress, with_progress


class Lesson(NamedTuple):
    """Positions with a number of stones to come, and the scores of their ends.

    Parameters
    ----------
    left : number of stones to come
    stones : (n, 16, 2) positions
    score_values : (n, 13) value of each score to the team with the hammer
    skill : (n,) skill of the players; see `value_network.skill_feature`
    shares : (n, 13) probability of each score; 1 for the actual score
    """

    left: int
    stones: NDArray[np.float32]
    score_values: Floats
    skill: Floats
    shares: Floats


class _Row(NamedTuple):
    """Features of some positions, and the scores of their ends."""

    stones: NDArray[np.float32]
    places: Indices
    positions: NDArray[np.float32]
    shares: NDArray[np.float32]


def fit_value_network(
    lines: Lines,
    lessons: Iterable[Lesson],
    rng: np.random.Generator,
    *,
    layers: Sequence[int] = NETWORK_WIDTHS,
    epochs: int = 8,
    learning_rate: float = 3e-3,
    begin: ValueNetwork | None = None,
    progress: Progress = no_progress,
) -> ValueNetwork:
    """Fit a network to predict the scores of ends; each position is also used mirrored.

    The initial weights are those of a given network, or come from torch's own generator, which the
    caller seeds.

    Parameters
    ----------
    lines : lines of the sheet
    lessons : positions and how ends are scored from them
    rng : source of the training order
    layers : units of the hidden layers: two for a stone, two for the position
    epochs : passes through the lessons
    learning_rate : highest learning rate of the schedule
    begin : initial network with layers of these sizes; None for random weights
    progress : called after each epoch
    """
    import torch
    from torch import nn

    rows = [row for lesson in lessons for row in _rows_of(lines, lesson)]
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
    steps = epochs * -(-len(rows) // BATCH_SIZE_FACTOR)
    optimiser = torch.optim.AdamW([*stone.parameters(), *position.parameters()], weight_decay=1e-3)
    schedule = torch.optim.lr_scheduler.OneCycleLR(optimiser, learning_rate, total_steps=steps + 1)
    for _ in with_progress(range(epochs), "learning", progress):
        order = rng.permutation(len(rows))
        for first in range(0, len(rows), BATCH_SIZE_FACTOR):
            some = [rows[k] for k in order[first : first + BATCH_SIZE_FACTOR]]
            begins = np.cumsum([0, *(SLOTS * len(row.shares) for row in some)])
            team = np.concatenate([r.places + at for r, at in zip(some, begins, strict=False)])
            team //= SLOTS // 2
            ends = sum(len(row.shares) for row in some)
            looked = stone(torch.from_numpy(np.concatenate([row.stones for row in some])))
            teams = torch.zeros(2 * ends, b).index_add(0, torch.from_numpy(team), looked)
            whole = torch.from_numpy(np.concatenate([row.positions for row in some]))
            logits = position(torch.cat([teams.reshape(ends, -1), whole], dim=1))
            shares = torch.from_numpy(np.concatenate([row.shares for row in some]))
            loss = nn.functional.cross_entropy(logits, shares)
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
    """Return the mean negative log-likelihood of the actual scores over positions."""
    losses: list[Floats] = []
    for left, stones, score_values, skill, came in lessons_of(ends):
        there = stones.astype(np.float64)
        shares = network.score_probabilities(lines, there, left, score_values, skill)
        losses.append(-np.log((shares * came).sum(axis=1) + 1e-9))
    return float(np.concatenate(losses).mean())


def shares_error(scores: Integers) -> float:
    """Return minus the mean log-probability of scores, if only their shares are known."""
    shares = shares_of(scores).mean(axis=0)
    return -float((shares[shares > 0] * np.log(shares[shares > 0])).sum())


def lessons_of(ends: PlayedEnds) -> Iterator[Lesson]:
    """Return the positions after each delivery that was not random, and the actual scores."""
    deliveries, n = len(ends.stones), len(ends.score)
    shares, skill = shares_of(ends.score), np.broadcast_to(ends.skill, n)
    for delivered in range(deliveries - 1):
        here = np.broadcast_to(ends.greedy_from, n) <= delivered
        stones = ends.stones[delivered][here]
        left = deliveries - 1 - delivered
        yield Lesson(left, stones, ends.score_values[here], skill[here], shares[here])


def _rows_of(lines: Lines, lesson: Lesson) -> Iterator[_Row]:
    left, stones, score_values, skill, shares = lesson
    for first in range(0, len(stones), PARALLEL_ENDS):
        some = slice(first, first + PARALLEL_ENDS)
        came = shares[some].astype(np.float32)
        for mirror in (1.0, -1.0):
            mirrored = stones[some].astype(np.float64) * np.array([mirror, 1.0])
            features, places = stone_features(lines, mirrored)
            whole = position_features(lines, mirrored, left, score_values[some], skill[some])
            yield _Row(features, places, whole, came)
