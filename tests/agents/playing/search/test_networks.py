"""Choice of the package's network for a game."""

from __future__ import annotations

import numpy as np
import pytest

from agents.playing import NETWORKS, SCORES, SLOTS, SearchPlayer, load_network, network_for
from curling_env.game import rule_set
from curling_env.ice import load_ice


def learnt_for(rules: str, ice: str) -> str:
    """Return the name of the network for these games."""
    chosen = network_for(rule_set(rules), load_ice(ice))
    return next(
        known.name
        for known in NETWORKS
        if network_for(rule_set(known.rules), load_ice(known.ice)) is chosen
    )


@pytest.mark.parametrize(
    ("rules", "ice", "name"),
    [
        ("world_curling_2024", "standard", "standard"),
        ("mixed_doubles_2024", "standard", "mixed_doubles"),
        ("dc4_server_mixed_doubles", "fcv1", "mixed_doubles"),
        ("digital_curling", "fcv1", "digital_curling"),
        ("dc4_server", "fcv1", "digital_curling"),
        ("digital_curling", "standard", "standard"),  # its stones lose speed in collisions
    ],
)
def test_a_network_is_chosen_by_rules_and_ice(rules, ice, name):
    assert learnt_for(rules, ice) == name


def test_the_number_of_ends_chooses_none():
    short = network_for(rule_set("digital_curling", ends=2), load_ice("fcv1"))
    assert short is network_for(rule_set("digital_curling"), load_ice("fcv1"))


def test_a_player_may_bring_its_own():
    own = load_network()
    player = SearchPlayer(network=own)
    assert player.network(rule_set("digital_curling"), load_ice("fcv1")) is own
    chosen = SearchPlayer().network(rule_set("digital_curling"), load_ice("fcv1"))
    assert chosen is not own


@pytest.mark.parametrize("known", NETWORKS, ids=[known.name for known in NETWORKS])
def test_every_network_values_counting_stones_with_one_stone_to_come(known):
    rules, ice = rule_set(known.rules), load_ice(known.ice)
    lines = rules.lines(width=ice.sheet.width, stone_radius=ice.stone.radius)
    stones = np.full((2, SLOTS, 2), np.nan)
    stones[0, :2] = (0.1, 0.0), (0.4, 0.2)  # the hammer team lies two
    stones[1, 8:10] = (0.1, 0.0), (0.4, 0.2)  # its opponent does
    values = (SCORES > 0).astype(float)
    points = network_for(rules, ice).score_probabilities(lines, stones, 1, values, 0.0) @ SCORES
    assert points[0] > 1.5
    assert points[1] < 0.9
