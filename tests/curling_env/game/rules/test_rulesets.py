"""The sets of rules agree with their books; unplayable rules are refused."""

from __future__ import annotations

import pytest

from curling_env.errors import InputError
from curling_env.game import RULE_SETS, rule_set


def test_in_fours_each_player_throws_two_stones_in_turn():
    rules = RULE_SETS["world_curling_2024"]
    assert (rules.ends, rules.throwers) == (10, (0, 0, 1, 1, 2, 2, 3, 3))
    assert (rules.stones, rules.deliveries, rules.stones + rules.placed_stones) == (8, 16, 8)
    assert (rules.free_guard_until, rules.no_takeout_until) == (5, 0)
    assert rules.no_tick
    assert rules.hog_line_exception
    assert rules.blank_keeps_hammer
    assert rules.stops_when_decided
    assert not rules.placed_stones
    assert not rules.power_play
    assert (rules.ends_before_concession, rules.max_extra_ends) == (6, None)
    assert rules.measure == 1e-6


def test_in_mixed_doubles_one_throws_the_first_and_the_last_stone():
    rules = RULE_SETS["mixed_doubles_2024"]
    assert (rules.ends, rules.throwers) == (8, (0, 1, 1, 1, 0))
    assert (rules.stones, rules.deliveries, rules.stones + rules.placed_stones) == (5, 10, 6)
    assert (rules.free_guard_until, rules.no_takeout_until) == (0, 3)
    assert rules.placed_stones
    assert rules.power_play
    assert not rules.no_tick
    assert not rules.blank_keeps_hammer
    assert rules.ends_before_concession == 6


def test_in_digital_curling_one_hand_throws_every_stone():
    rules = RULE_SETS["digital_curling"]
    assert (rules.ends, rules.throwers) == (10, (0,) * 8)
    assert (rules.free_guard_until, rules.no_takeout_until) == (5, 0)
    assert not rules.no_tick
    assert not rules.hog_line_exception
    assert not rules.stops_when_decided
    assert rules.blank_keeps_hammer
    assert rules.ends_before_concession == 0


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"ends": 0}, "1 to 20 ends"),
        ({"ends": 21}, "1 to 20 ends"),
        ({"throwers": ()}, "1 to 8 stones"),
        ({"throwers": (0,) * 9}, "1 to 8 stones"),
        ({"placed_stones": True}, "1 to 8 stones"),
        ({"max_extra_ends": -1}, "at least 0"),
        ({"measure": -1e-9}, "at least 0 m"),
        ({"measure": float("nan")}, "at least 0 m"),
        ({"power_play": True}, "placed stones"),
    ],
)
def test_rules_by_which_no_game_can_be_played_are_refused(change, words):
    with pytest.raises(InputError, match=words):
        rule_set("world_curling_2024", **change)


@pytest.mark.parametrize(
    "change",
    [
        {"ends": 1},
        {"ends": 20},
        {"throwers": (0,)},
        {"throwers": (0,) * 7, "placed_stones": True},
        {"throwers": (0,) * 7, "placed_stones": True, "power_play": True},
        {"max_extra_ends": 0},
        {"max_extra_ends": 1},
        {"measure": 0.0},
    ],
)
def test_rules_may_go_to_the_edge(change):
    rules = rule_set("world_curling_2024", **change)
    assert all(getattr(rules, name) == value for name, value in change.items())
    assert rule_set(rules) is rules
    assert rule_set(rules, ends=3).ends == 3
