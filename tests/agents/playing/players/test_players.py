"""Every player plays every set of rules; one that thinks wins against one that only draws."""

from __future__ import annotations

import numpy as np
import pytest

from agents.playing import GreedyPlayer, SearchPlayer, play_game
from curling_env.game import (
    NO_EVOLUTION,
    TYPICAL_EVOLUTION,
    DrawPlayer,
    GameSimulator,
    RuleBasedPlayer,
    Team,
    rule_set,
)
from curling_env.throw import FROM_HACK

PLAYERS = {"draw": DrawPlayer, "rulebased": RuleBasedPlayer, "greedy": GreedyPlayer}


def simulator(ends=2, rules="world_curling_2024", ice_evolution=TYPICAL_EVOLUTION, **settings):
    settings.setdefault("skills", "elite")
    return GameSimulator(
        rules=rule_set(rules, ends=ends), ice_evolution=ice_evolution, sweeping=True, **settings
    )


@pytest.mark.parametrize("rules", ["world_curling_2024", "mixed_doubles_2024", "digital_curling"])
@pytest.mark.parametrize("name", PLAYERS)
def test_every_player_plays_every_rules(name, rules):
    player = PLAYERS[name]()
    played = play_game(simulator(1, rules), (player, DrawPlayer()), seed=1)
    assert played.game.is_over
    assert all(d.shot.call.shot for d in played.deliveries)
    faults = [d.shot.ruling.fault for d in played.deliveries if d.shot.team is Team.HOME]
    assert sum(f in ("free_guard_zone", "early_takeout") for f in faults) <= 1


def test_the_draw_player_draws_to_the_button_on_the_ice_it_knows():
    game = play_game(
        simulator(1, ice_evolution=NO_EVOLUTION, skills="none"),
        (DrawPlayer(), DrawPlayer()),
        seed=0,
    )
    first = game.deliveries[0].shot.stones_after[0]
    assert np.hypot(first.x, first.y) < 0.01
    fooled = play_game(
        simulator(1, ice_evolution=NO_EVOLUTION, skills="none", known_ice="fcv1"),
        (DrawPlayer(), DrawPlayer()),
        seed=0,
    )
    lying = fooled.deliveries[0].shot.stones_after
    assert not lying or np.hypot(lying[0].x, lying[0].y) > 0.05


@pytest.mark.parametrize("player", [DrawPlayer(), GreedyPlayer(), SearchPlayer(300)])
def test_players_throw_from_the_hack_as_well(player):
    fcv1 = GameSimulator("fcv1", rules="digital_curling", delivery=FROM_HACK, skills="none")
    state = fcv1.begin_end(fcv1.new_game(0))
    call = player.call(fcv1.view(state))
    assert abs(call.throw.spin) == pytest.approx(FROM_HACK.spin)
    after, _ = fcv1.play(state, call)
    (lying,) = after.game.end.stones
    assert abs(lying.x) < 1.5
    assert -4.0 < lying.y < 1.6
    if player.name == "draw":
        assert np.hypot(lying.x, lying.y) < 0.01
