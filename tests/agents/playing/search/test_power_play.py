"""Power plays by the odds: early ones waste the hammer's best end, late ones may not come."""

import pytest

from agents.playing.search import SearchPlayer
from agents.playing.search.win_probability import PowerPlayOdds
from curling_env.game import GameSimulator
from curling_env.game.rules import Team, rule_set

RULES = rule_set("mixed_doubles_2024")


def test_a_power_play_gains_most_late_and_level():
    odds = PowerPlayOdds(RULES)
    assert odds.gain(0, 1, opponent=True) > 0.08  # the last chance
    assert odds.gain(-1, 3, opponent=True) > 0.002
    assert odds.gain(1, 7, opponent=True) < 0.001 < odds.gain(1, 2, opponent=True)
    assert odds.gain(6, 1, opponent=False) == pytest.approx(0, abs=0.01)  # it is won


@pytest.mark.parametrize(("ends", "side"), [(8, None), (1, "right")])
def test_search_decides_by_the_odds(ends, side):
    simulator = GameSimulator("standard", rules=rule_set("mixed_doubles_2024", ends=ends))
    state = simulator.new_game(0, last_stone=Team.AWAY)
    assert SearchPlayer(60).power_play(simulator.view(state, Team.AWAY)) == side
