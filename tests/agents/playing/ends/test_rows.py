"""The kept results, and the rows that they give to the table of published measurements."""

from __future__ import annotations

import json

import numpy as np
import pytest

from agents.playing import (
    BY_THE_ODDS,
    CHAMPIONSHIP,
    CLASSES,
    FACTORS,
    WinProbability,
    compared,
    conditions_document,
    expected_before_an_end,
    kept_results,
    rows_of_ends,
    score_shares,
)
from curling_env.game import rule_set
from curling_env.ice import load_ice
from curling_env.throw import SKILLS
from curling_env.validation import Verdict, compare


@pytest.fixture(scope="module")
def kept():
    return kept_results()


def test_what_is_kept_was_played_under_the_conditions_of_today(kept):
    named = {"championship": CHAMPIONSHIP, "by-the-odds": BY_THE_ODDS, **FACTORS}
    for name, found in kept["found"].items():
        today = json.loads(json.dumps(conditions_document(named[name])))
        assert found["conditions"] == today, f"{name} has changed: play its games again"
        assert sum(found["counts"]) == found["ends"]
        again = compared(found["counts"])
        assert found["chi_square"] == pytest.approx(again.chi_square)


def test_the_kept_tables_are_those_of_today(kept):
    odds = WinProbability(rule_set("world_curling_2024"))
    level = kept["win_table_of_search"]["level, ten ends left"]
    assert level == pytest.approx(odds.with_hammer(0, 10))
    published = WinProbability(rule_set("world_curling_2024"), score_shares())
    two_up = kept["win_table_of_published_ends"]["two up, three left"]
    assert two_up == pytest.approx(1 - published.with_hammer(-2, 3))
    for name, shares in kept["network_before_an_end"].items():
        assert expected_before_an_end(SKILLS[name].sigma_angle) == pytest.approx(shares, abs=1e-4)


def test_what_the_network_expects_is_a_distribution_and_better_hands_blank_more():
    elite, club = (expected_before_an_end(SKILLS[name].sigma_angle) for name in ("elite", "club"))
    assert elite.sum() == pytest.approx(1.0)
    assert elite[CLASSES.index("blank")] > 2 * club[CLASSES.index("blank")]
    last = expected_before_an_end(SKILLS["elite"].sigma_angle, ends_left=1)
    assert last[CLASSES.index("1")] > 0.5  # one point wins there


def test_every_row_has_a_value_a_source_and_a_name_of_its_own(kept):
    rows = rows_of_ends()
    assert len({row.name for row in rows}) == len(rows)
    found = {c.row.name: c for c in compare(load_ice("standard"), "standard", rows)}
    assert all(c.row.source for c in found.values())
    counts = np.array(kept["found"]["championship"]["counts"])
    blank = found["ends: blank"]
    assert blank.value == pytest.approx(100 * counts[3] / counts.sum())
    assert (blank.row.low, blank.row.high) == pytest.approx((11.1, 15.1))
    others = {name for name, c in found.items() if c.verdict is not Verdict.AGREES}
    assert not [name for name in others if name.startswith("ends")]
    agreeing = {"perfect: front", "perfect: double", "grade: second", "grade: skip", "calls: hits"}
    assert not agreeing & others
    assert all(c.why for name, c in found.items() if name in others)
