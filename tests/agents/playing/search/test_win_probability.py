"""Chances to win a game from its score and the ends to come."""

from __future__ import annotations

import numpy as np
import pytest

from agents.playing import SCORES, WinProbability
from agents.playing.search.tuning import SCORE_SHARES
from curling_env.game import rule_set

FOURS = rule_set("world_curling_2024", ends=8)


def coin(blank, one, steal):
    """Shares of ends in which the hammer team scores one, blanks or is stolen from."""
    shares = np.zeros(len(SCORES))
    shares[SCORES == 0], shares[SCORES == 1], shares[SCORES == -1] = blank, one, steal
    return shares


def test_in_mixed_doubles_ends_are_seldom_blank():
    """Without other shares those of the rules are taken, so a level last end is worth more."""
    fours = WinProbability(rule_set("world_curling_2024"), SCORE_SHARES)
    doubles = WinProbability(rule_set("mixed_doubles_2024"))
    assert doubles.with_hammer(0, 0) == pytest.approx(0.71, abs=0.01)
    assert WinProbability(rule_set("world_curling_2024")).with_hammer(0, 0) == fours.with_hammer(
        0, 0
    )


def test_the_chances_to_win_are_those_of_a_game_of_coins():
    winning = WinProbability(FOURS, coin(0.5, 0.3, 0.2))
    assert winning.with_hammer(0, 0) == pytest.approx(0.6, abs=0.01)  # 0.3 of 0.3 and 0.2
    assert winning.with_hammer(1, 0) == 1.0
    # One behind with an end to play: 0.3 to tie, and then without the hammer.
    assert winning.with_hammer(-1, 1) == pytest.approx(0.3 * 0.4, abs=0.01)
    assert winning.with_hammer(0, 1) == pytest.approx(0.3 + 0.5 * 0.6, abs=0.01)
    scores = winning.by_score(0, 1)
    assert scores[SCORES == 1] == 1.0
    assert scores[SCORES == -1] == 0.0
    mixed = WinProbability(rule_set("mixed_doubles_2024"), coin(0.5, 0.3, 0.2))
    # There a blank gives the decision away: x = 0.3 + 0.5 (1 - x).
    assert mixed.with_hammer(0, 0) == pytest.approx(0.8 / 1.5, abs=0.01)


def test_a_power_play_gains_most_late_and_level():
    odds = WinProbability(rule_set("mixed_doubles_2024"))
    assert odds.power_play_gain(0, 1, opponent=True) > 0.08  # the last chance
    assert odds.power_play_gain(-1, 3, opponent=True) > 0.002
    assert (
        odds.power_play_gain(1, 7, opponent=True)
        < 0.001
        < odds.power_play_gain(1, 2, opponent=True)
    )
    assert odds.power_play_gain(6, 1, opponent=False) == pytest.approx(0, abs=0.01)  # it is won
