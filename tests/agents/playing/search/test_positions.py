"""Batches of positions are ruled on and counted like single ones."""

from __future__ import annotations

import numpy as np
import pytest

from agents.playing import SLOTS, EndSimulator, points_of
from curling_env.game import (
    RULE_SETS,
    Lines,
    RestingStone,
    Result,
    Team,
    count,
    rule_on,
    rule_set,
    score_of,
)
from curling_env.ice import load_ice
from curling_env.sheet import Direction
from tests.agents.playing.search.random_positions import positions

LINES = Lines(width=4.5)


@pytest.mark.parametrize("rules", list(RULE_SETS))
@pytest.mark.parametrize("delivered", [1, 2, 4, 9])
def test_many_positions_are_ruled_on_as_one_is(rules, delivered):
    rng = np.random.default_rng(delivered)
    rule = rule_set(rules)
    ice = load_ice("standard")
    lines = rule.lines(width=LINES.width)
    simulator = EndSimulator(ice=ice, direction=Direction.AWAY, rules=rule, lines=lines)
    before = positions(rng, 120, delivered)
    throws = np.column_stack(
        [rng.uniform(1.7, 3.5, 120), rng.normal(0, 0.03, 120), rng.choice([-1.5, 1.5], 120)]
    )
    after, struck = simulator.slide(before, delivered, throws)
    ruled = simulator.rule(before, delivered, after, struck)
    faults = 0
    for k in range(120):
        lying = [
            RestingStone(Team(slot // 8), slot % 8, *before[k, slot])
            for slot in range(SLOTS)
            if np.isfinite(before[k, slot, 0])
        ]
        where = [8 * s.team + s.number for s in lying] + [simulator.slot(delivered)]
        now = [
            None
            if np.isnan(after[k, slot, 0])
            else RestingStone(Team(slot // 8), slot % 8, *after[k, slot])
            for slot in where
        ]
        ruling = rule_on(
            rule, lines, tuple(lying), Team(simulator.mover(delivered)), delivered,
            Result(tuple(now), bool(struck[k])),
        )  # fmt: skip
        faults += ruling.fault is not None
        stones = ruling.stones if ruling.option is None else ruling.option
        wanted = np.full((SLOTS, 2), np.nan)
        for stone in stones:
            wanted[8 * stone.team + stone.number] = stone.x, stone.y
        np.testing.assert_array_equal(ruled[k], wanted)
        score = score_of(rule, lines, stones)
        assert points_of(lines, ruled[k : k + 1])[0] == score[0] - score[1]
    assert faults > 0 or delivered == 9


def test_points_are_counted_as_by_the_rules():
    rng = np.random.default_rng(9)
    for k, position in enumerate(positions(rng, 60, 14)):
        lying = [
            RestingStone(Team(slot // 8), slot % 8, *position[slot])
            for slot in range(SLOTS)
            if np.isfinite(position[slot, 0])
        ]
        team, points = count(LINES, tuple(lying))
        wanted = points if team is Team.HOME else -points
        assert points_of(LINES, position[None])[0] == wanted, k


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
