"""Values learned backwards: the outcome of a good next stone, on average over its error."""

from __future__ import annotations

from typing import cast

import numpy as np
import pytest
from learn.backwards import lesson_before

from agents.playing import (
    SCORES,
    EndSimulator,
    Lesson,
    PlayedEnds,
    ValueNetwork,
    end_simulator,
    load_network,
    skill_feature,
)
from curling_env.throw import skill_named

ELITE = skill_named("elite")
USUAL = skill_feature(ELITE)


class AlwaysThree:
    """Network that is sure of three points, and records its queries."""

    def __init__(self) -> None:
        self.asked: list[int] = []

    def score_probabilities(self, lines, stones, left, score_values, skill) -> np.ndarray:
        self.asked.append(left)
        return np.tile((SCORES == 3).astype(float), (len(stones), 1))


@pytest.fixture(scope="module")
def simulator() -> EndSimulator:
    return end_simulator("standard", "world_curling_2024")


def empty_ends(n: int, skill: float) -> PlayedEnds:
    """Ends in which no stone stays in play."""
    nothing = np.full((16, n, 16, 2), np.nan, dtype=np.float32)
    values = np.tile((SCORES - SCORES[0]) / 12, (n, 1))
    return PlayedEnds(nothing, np.zeros(n, dtype=int), values, np.full(n, skill))


def lesson(simulator: EndSimulator, left: int, *, skill: float, network=None) -> Lesson:
    network = cast(ValueNetwork, network or load_network())
    rng = np.random.default_rng(5)
    return lesson_before(simulator, network, empty_ends(24, skill), left, ELITE, rng)


def test_the_last_stone_into_an_empty_house_nearly_always_counts_one(simulator) -> None:
    sure = lesson(simulator, 1, skill=USUAL)
    np.testing.assert_allclose(sure.shares.sum(axis=1), 1, atol=1e-6)
    one = SCORES == 1
    assert sure.shares[:24, one].mean() > 0.97
    unsure = lesson(simulator, 1, skill=USUAL + 2.5)
    assert unsure.shares[:24, one].mean() < 0.8


def test_alternatives_are_listed_with_the_played_positions(simulator) -> None:
    known = lesson(simulator, 1, skill=USUAL)
    # Three for each that was played; the stone before the last may lie there, and no other.
    assert known.stones.shape == (4 * 24, 16, 2)
    there = np.isfinite(known.stones[:, :, 0])
    assert not there[:24].any()
    assert there[24:, simulator.slot(14)].mean() > 0.5
    assert not np.delete(there, simulator.slot(14), axis=1).any()
    # Where the opponent's stone lies in the house, the last one is worth less.
    points = (known.shares * SCORES).sum(axis=1)
    assert points[24:].mean() < points[:24].mean()


def test_earlier_positions_have_the_networks_value_one_stone_later(simulator) -> None:
    network = AlwaysThree()
    known = lesson(simulator, 6, skill=USUAL, network=network)
    np.testing.assert_allclose(known.shares[:, SCORES == 3], 1, atol=1e-6)
    # The positions with six stones to come are chosen among, and what a stone more leads to valued.
    assert set(network.asked) == {6, 5}
    first = lesson(simulator, 15, skill=USUAL, network=AlwaysThree())
    assert first.stones.shape == (24, 16, 2)
