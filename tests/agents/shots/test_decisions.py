"""Calls in real positions beside those of the search, and results of ends beside each other."""

import numpy as np
import pytest

from agents.playing.tournament import wilson
from agents.shots.decisions import (
    FAMILIES,
    Decision,
    decisions_of,
    power_plays_of,
    summary_of,
    summary_of_power_plays,
)
from agents.shots.table import TASKS, read_shots
from agents.shots.world import CLASSES, EndsComparison, played_ends, real_ends
from curling_env.throw import SKILLS, Skill
from tests.agents.shots.small_tables import RESTS, SmallTable


@pytest.fixture(scope="module")
def table(tmp_path_factory):
    """Three ends: the last stone counts, in the first two for its team."""
    small = SmallTable()
    small.end(RESTS, (0, 2))
    small.end(RESTS, (2, 0), hammer=31)
    small.end(RESTS, (0, 2), placed=((1089, 1916), (1150, 850)), power_play=1)
    return read_shots(small.write(tmp_path_factory.mktemp("table")))


@pytest.fixture(scope="module")
def found(table):
    """The calls of all three ends beside those of the search."""
    return decisions_of(table, SKILLS["championship"], shots=30, budget=60)


def test_each_call_is_compared_in_the_teams_own_position(table, found):
    assert len(found) == 30
    assert [one.row for one in found] == list(range(2, 32))
    situations = {one.situation for one in found}
    assert {"with hammer", "without hammer", "with hammer, power play"} <= situations
    for one in found:
        assert 0 <= one.expected <= 1
        assert 0 <= one.reached <= 1
        assert one.cost is None or one.cost >= 0
        assert one.agrees == (one.search in FAMILIES["draw"])
    # The last stone of the second end lies on the button: more than any call promises.
    assert found[19].reached > 0.9 * found[19].expected
    again = decisions_of(table, SKILLS["championship"], shots=30, budget=60)
    assert again == found


def test_the_last_stone_is_worth_the_score_that_it_leaves(found):
    """In an end with six to come, a point more is worth more, whoever throws."""
    first, second = found[9], found[19]
    assert (first.called, first.situation) == ("draw", "with hammer")
    assert first.reached > 0.5
    assert second.reached > 0.4


def test_families_name_tasks_of_the_table():
    assert set(FAMILIES) < set(TASKS)


def test_the_summary_counts_by_situation():
    def one(situation: str, agrees: bool, reached: float, cost: float | None) -> Decision:
        return Decision(
            row=2,
            situation=situation,
            called="draw",
            search="hit",
            agrees=agrees,
            cost=cost,
            expected=0.5,
            reached=reached,
        )

    found = summary_of(
        [
            one("with hammer", True, 0.6, 0.0),
            one("with hammer", False, 0.4, 0.02),
            one("without hammer", False, 0.5, None),
        ]
    )
    row = found["all"]
    assert (row["calls"], row["others"]) == (3, 2)
    values = [
        row[name]["value"] for name in ("agree", "cost_of_others", "others_paid", "same_paid")
    ]
    assert values == pytest.approx([1 / 3, 0.02, 0.5, 1.0])
    low, high = wilson(1, 3)
    assert row["agree"] == {"value": pytest.approx(1 / 3), "low": low, "high": high}
    assert row["others_paid"]["low"] < 0.2 < 0.8 < row["others_paid"]["high"]
    assert found["without hammer"]["cost_of_others"] is None
    assert found["without hammer"]["same_paid"] is None


def test_power_plays_are_compared_with_the_odds(tmp_path):
    """Only home plays one, in the last end."""
    small = SmallTable()
    for hammer in (42, 31, 42, 31, 42, 31):
        small.end(RESTS, (0, 1) if hammer == 42 else (1, 0), hammer=hammer)
    small.end(RESTS, (0, 1))
    small.end(RESTS, (1, 0), hammer=31, placed=((1089, 1916), (1150, 850)), power_play=1)
    found = power_plays_of(read_shots(small.write(tmp_path)))
    assert [one.ends_left for one in found] == [8, 7, 6, 5, 4, 3, 2, 1]
    assert [one.lead for one in found] == [0, -1, 0, -1, 0, -1, 0, -1]
    assert [one.played for one in found] == [False] * 7 + [True]
    assert found[6].cost == found[6].gain > 0.02  # level with two to play
    assert found[7].cost == 0 < found[7].gain
    summary = summary_of_power_plays(found)
    assert summary["2 to play, level"]["by_the_odds"] == 1.0
    assert summary["1 to play, behind"]["played"]["value"] == 1.0
    assert summary["8 to play, level"]["by_the_odds"] == 0.0


def test_real_ends_are_counted_for_the_team_with_the_hammer(table):
    counts = dict(zip(CLASSES, real_ends(table).tolist(), strict=True))
    assert counts == dict.fromkeys(CLASSES, 0) | {2: 3}


def test_two_distributions_have_a_worst_class_and_a_chi_squared():
    from scipy.stats import chi2_contingency

    real = np.array([10, 20, 60, 0, 110, 60, 30, 10])
    played = np.array([1, 2, 3, 0, 20, 6, 2, 1])
    both = EndsComparison(real=real, played=played)
    worst = max(abs(real / real.sum() - played / played.sum())) * 100
    assert both.worst == pytest.approx(worst)
    kept = np.array([real, played])[:, real + played > 0]
    expected = chi2_contingency(kept, correction=False)
    assert both.chi_squared == pytest.approx((expected.statistic, 6, expected.pvalue))


def test_ends_are_played_as_often_as_asked_by_the_hands_asked():
    exact = played_ends(Skill(name="none"), ends=5, budget=60)
    assert 5 <= exact.sum() <= 5 + 8
    assert (exact == played_ends(Skill(name="none"), ends=5, budget=60)).all()
    wild = played_ends(SKILLS["club"], ends=5, budget=60)
    assert (exact != wild).any()
