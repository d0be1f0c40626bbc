"""Values of positions, by the network and the ends to come."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from agents.playing import SCORES, SLOTS, PositionEvaluator, load_network
from curling_env.game import Lines, rule_set
from tests.agents.playing.search.random_positions import positions

FOURS = rule_set("world_curling_2024", ends=8)
LINES = Lines(width=4.5)


@pytest.fixture(scope="module")
def evaluator():
    return PositionEvaluator(load_network(), FOURS, LINES, 0.0)


def test_chances_to_win_are_those_of_curling(evaluator):
    table = [evaluator.game_odds.with_hammer(lead, 4) for lead in range(-4, 5)]
    assert all(a <= b for a, b in pairwise(table))
    assert evaluator.game_odds.with_hammer(0, 4) > 0.5
    assert evaluator.game_odds.with_hammer(-3, 1) < 0.1


def test_the_network_values_counting_stones(evaluator):
    """Before the last stone, of a stone alone on the button and of one that is the opponent's."""
    worth = evaluator.game_odds.by_score(0, 4)
    stones = np.full((3, SLOTS, 2), np.nan)
    stones[0, 0] = stones[1, 8] = 0.0, 0.1
    chances = evaluator.network.score_probabilities(LINES, stones, 1, worth, 0.0)
    assert chances.sum(axis=1) == pytest.approx(np.ones(3))
    points = chances @ SCORES
    assert points[0] > points[2] + 0.3 > points[1]
    early = evaluator.network.score_probabilities(LINES, stones, 12, worth, 0.0) @ SCORES
    assert points[0] - points[1] > early[0] - early[1]


def test_the_networks_input_does_not_depend_on_the_order_of_stones(evaluator):
    rng = np.random.default_rng(2)
    stones = positions(rng, 20, 12)
    shuffled = stones.copy()
    shuffled[:, :8] = stones[:, rng.permutation(8)]
    shuffled[:, 8:] = stones[:, 8 + rng.permutation(8)]
    worth = evaluator.game_odds.by_score(0, 4)
    np.testing.assert_allclose(
        evaluator.network.score_probabilities(LINES, stones, 4, worth, 0.0),
        evaluator.network.score_probabilities(LINES, shuffled, 4, worth, 0.0),
        atol=1e-5,
    )


def test_stones_that_the_opponent_piled_up_are_bad_news(evaluator):
    """Four counting stones of the opponent's and one to come: a position that no team like the
    network leaves, and that an untrained network takes for a good house.
    """
    stones = np.full((1, SLOTS, 2), np.nan)
    stones[0, 8:12] = [(0.0, -0.1), (0.15, 0.35), (0.13, -0.45), (-0.55, 0.2)]
    stones[0, :4] = [(0.8, 0.3), (-0.8, -1.0), (1.2, -0.9), (-0.6, -2.3)]
    values = evaluator.game_odds.by_score(0, 4)
    points = evaluator.network.score_probabilities(LINES, stones, 2, values, 0.0) @ SCORES
    assert points[0] < -0.5
