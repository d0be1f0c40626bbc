"""Throws played into many positions at once, as `search` plays them."""

from __future__ import annotations

import numpy as np

from agents.playing.search.positions import SLOTS, EndSimulator
from curling_env.game.rules import rule_set
from curling_env.ice import load_ice
from curling_env.sheet import Direction


def test_a_stone_that_creeps_past_the_back_line_does_not_stop_the_throws_that_follow():
    ice, rules = load_ice("standard"), rule_set("world_curling_2024")
    lines = rules.lines(width=ice.sheet.width, stone_radius=ice.stone.radius)
    play = EndSimulator(ice=ice, direction=Direction.AWAY, rules=rules, lines=lines)
    before = np.full((2, SLOTS, 2), np.nan)
    before[:, 0] = -1.0, -3.0
    # At rest they would lie 40 and 35 µm past it.
    vx, vy = np.array(
        [[0.01909538582548148, 0.10477825938976179], [2.1637225522045886, 1.7711381571]]
    )
    throws = np.stack(
        [np.hypot(vx, vy), -np.arctan2(vx, vy), [0.4245847929, -0.6740754716]], axis=1
    )
    for delivered in (1, 2, 3):
        before, _ = play.slide(before, delivered, throws)
        assert not (before[:, :, 1] > 1.829 + 0.145).any()
