"""The published ends, and what a comparison with them tells."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import chi2_contingency

from agents.playing import WinProbability, compared, score_shares
from agents.playing.ends.published import (
    PUBLISHED_ENDS,
    PUBLISHED_NET,
    PUBLISHED_ODDS,
    PUBLISHED_SHARES,
    class_counts,
)
from curling_env.game import rule_set

RULES = rule_set("world_curling_2024")


def test_the_published_shares_are_all_ends_and_give_the_published_net():
    assert sum(PUBLISHED_SHARES) == pytest.approx(1.0, abs=0.001)
    # Four and more points count as three here, so a little is missing.
    net = compared(PUBLISHED_ENDS * np.array(PUBLISHED_SHARES)).net
    assert PUBLISHED_NET - 0.1 < net < PUBLISHED_NET


def test_scores_are_counted_by_class():
    assert class_counts([-5, -3, -2, 0, 0, 1, 3, 4, 8]).tolist() == [2, 1, 0, 2, 1, 0, 3]
    assert class_counts([]).tolist() == [0] * 7


def test_the_test_statistic_is_that_of_a_contingency_table():
    ours = np.array([12, 30, 160, 140, 330, 240, 88])
    table = np.array([ours, PUBLISHED_ENDS * np.array(PUBLISHED_SHARES) / sum(PUBLISHED_SHARES)])
    statistic, p_value, *_ = chi2_contingency(table, correction=False)
    found = compared(ours)
    assert found.chi_square == pytest.approx(statistic)
    assert found.p_value == pytest.approx(p_value)
    assert found.largest_difference == pytest.approx(1.7, abs=0.2)
    assert np.all((found.low < found.shares) & (found.shares < found.high))
    assert "1000 ends" in found.text()


def test_samples_of_the_published_ends_agree_with_them_and_tame_ends_do_not():
    rng = np.random.default_rng(3)
    shares = np.array(PUBLISHED_SHARES) / sum(PUBLISHED_SHARES)
    p_values = [compared(rng.multinomial(1000, shares)).p_value for _ in range(200)]
    assert 0.01 < np.mean(np.array(p_values) < 0.05) < 0.11
    assert compared([0, 1, 3, 32, 26, 14, 1]).p_value < 1e-4  # search:600 of champions, 77 ends


def test_ends_that_nobody_plays_take_no_degree_of_freedom():
    assert compared([0, 0, 5, 5, 0, 0, 0], [0, 0, 0.5, 0.5, 0, 0, 0], 1000).p_value == 1.0


def by_hand(lead, ends, hammer):
    """Win probability from independent ends of the published shares, by recursion on the rules."""
    shares = np.array(PUBLISHED_SHARES) / sum(PUBLISHED_SHARES)
    if ends == 0 and lead:
        return float(lead > 0)
    if ends == 0:
        scores, steals = shares[4:].sum(), shares[:3].sum()
        return (scores if hammer else steals) / (scores + steals)
    sign = 1 if hammer else -1
    return sum(
        share * by_hand(lead + points, ends - 1, hammer if points == 0 else points < 0)
        for points, share in zip(sign * np.arange(-3, 4), shares, strict=True)
    )


def test_the_chances_to_win_follow_from_the_published_ends():
    odds = WinProbability(RULES, score_shares())
    for state in PUBLISHED_ODDS:
        ours = (
            odds.with_hammer(state.lead, state.ends_left)
            if state.hammer
            else 1 - odds.with_hammer(-state.lead, state.ends_left)
        )
        if state.ends_left <= 3:
            assert ours == pytest.approx(by_hand(state.lead, state.ends_left, state.hammer))
        # Teams play for what the score needs, and the better team has the hammer first.
        assert ours == pytest.approx(state.share, abs=0.055)
