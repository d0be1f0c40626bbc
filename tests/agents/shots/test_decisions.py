"""Calls in real positions beside those of the search, and results of ends beside each other."""

import numpy as np
import pytest

from agents.shots.decisions import FAMILIES, Decision, decisions_of, summary_of
from agents.shots.table import TASKS, read_shots
from agents.shots.world import CLASSES, EndsBeside, played_ends, real_ends
from curling_env.throw import SKILLS, Skill
from tests.agents.shots.small_tables import RESTS, SmallTable


@pytest.fixture
def table(tmp_path):
    """Three ends: the last stone counts, in the first two for its team."""
    small = SmallTable()
    small.end(RESTS, (0, 2))
    small.end(RESTS, (2, 0), hammer=31)
    small.end(RESTS, (0, 2), placed=((1089, 1916), (1150, 850)), power_play=1)
    return read_shots(small.write(tmp_path))


def test_each_call_is_compared_in_the_teams_own_position(table):
    found = decisions_of(table, SKILLS["championship"], shots=30, budget=100)
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
    again = decisions_of(table, SKILLS["championship"], shots=30, budget=100)
    assert again == found


def test_the_last_stone_is_worth_the_score_that_it_leaves(table):
    """In an end with six to come, a point more is worth more, whoever throws."""
    found = decisions_of(table, SKILLS["championship"], shots=30, budget=60)
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
    assert found["all"] == {
        "calls": 3,
        "others": 2,
        "agree": pytest.approx(1 / 3),
        "cost_of_others": pytest.approx(0.02),
        "others_paid": 0.5,
        "same_paid": 1.0,
    }
    assert found["without hammer"]["cost_of_others"] is None
    assert found["without hammer"]["same_paid"] is None


def test_real_ends_are_counted_for_the_team_with_the_hammer(table):
    counts = dict(zip(CLASSES, real_ends(table).tolist(), strict=True))
    assert counts == dict.fromkeys(CLASSES, 0) | {2: 3}


def test_two_distributions_have_a_worst_class_and_a_chi_squared():
    from scipy.stats import chi2_contingency

    real = np.array([10, 20, 60, 0, 110, 60, 30, 10])
    played = np.array([1, 2, 3, 0, 20, 6, 2, 1])
    both = EndsBeside(real=real, played=played)
    worst = max(abs(real / real.sum() - played / played.sum())) * 100
    assert both.worst == pytest.approx(worst)
    kept = np.array([real, played])[:, real + played > 0]
    expected = chi2_contingency(kept, correction=False)
    assert both.chi_squared == pytest.approx((expected.statistic, 6, expected.pvalue))


def test_ends_are_played_as_often_as_asked_by_the_hands_asked():
    exact = played_ends(Skill(name="none"), ends=9, budget=60)
    assert 9 <= exact.sum() <= 9 + 8
    assert (exact == played_ends(Skill(name="none"), ends=9, budget=60)).all()
    wild = played_ends(SKILLS["club"], ends=9, budget=60)
    assert (exact != wild).any()
