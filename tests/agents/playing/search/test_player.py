"""The player that searches: what it judges by, what it thinks of, and what it chooses."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from agents.playing.match import play_game
from agents.playing.search import CallingStyle, SearchPlayer
from agents.playing.search.aiming_table import AimingTable
from agents.playing.search.evaluator import PositionEvaluator
from agents.playing.search.kernel_regression import estimate
from agents.playing.search.positions import SCORES, SLOTS, EndSimulator, points_of, position_of
from agents.playing.search.shots import KINDS, shots_for
from agents.playing.search.tuning import HIT_WEIGHTS
from agents.playing.search.value_network import load_network
from agents.playing.search.win_probability import WinProbability
from agents.playing.trained_player import player_from
from curling_env.errors import InputError
from curling_env.game import NO_EVOLUTION, TYPICAL_EVOLUTION, GameSimulator, GameState, PlayerView
from curling_env.game.opponents.draw import DrawPlayer
from curling_env.game.rules import (
    RULE_SETS,
    End,
    RestingStone,
    Team,
    count,
    rule_on,
    rule_set,
    score_of,
)
from curling_env.game.rules.delivery import Fault, Result
from curling_env.game.rules.lines import Lines
from curling_env.ice import Ice, load_ice
from curling_env.physics.one_stone.aim import Aim
from curling_env.sheet import Direction
from curling_env.throw import FROM_HACK, FROM_HOG_LINE, Skill, Throw

FOURS = rule_set("world_curling_2024", ends=8)
LINES = Lines(width=4.5)
ALL_RULES = ["world_curling_2024", "mixed_doubles_2024", "digital_curling"]
BUDGET = 400


@pytest.fixture(scope="module")
def player():
    return SearchPlayer(BUDGET)


def view_of(stones, *, delivered=15, lead=0, ends_left=4, skill="elite", seed=1) -> PlayerView:
    """The view of the home team, which has the hammer and is about to deliver."""
    simulator = GameSimulator(rules=FOURS, skills=skill, ice_evolution=NO_EVOLUTION)
    played = FOURS.ends - ends_left
    scores = [(max(lead, 0), max(-lead, 0)), *[(0, 0)] * played][:played]
    hammer = Team.HOME if delivered % 2 else Team.AWAY
    end = End(number=played, hammer=hammer, stones=tuple(stones), delivered=delivered)
    game = replace(
        simulator.new_game(0).game, end=end, line_score=tuple(scores), hammers=(Team.HOME,) * played
    )
    assert game.lead(Team.HOME) == lead
    assert game.ends_left == ends_left
    return simulator.view(GameState(game=game, seed=seed, throws=delivered))


def played(view: PlayerView, call, trials=40):
    """Games after the call, with other luck each time."""
    simulator = GameSimulator(rules=FOURS, skills=view.skill, ice_evolution=NO_EVOLUTION)
    return [simulator.play(GameState(game=view.game, seed=900 + k), call) for k in range(trials)]


def home(number, x, y):
    return RestingStone(Team.HOME, number, x, y)


def away(number, x, y):
    return RestingStone(Team.AWAY, number, x, y)


# --- what it chooses ------------------------------------------------------------------------------


def test_an_open_hit_for_three_is_taken_instead_of_a_draw_for_one(player):
    """Two own stones lie second and third behind one of the opponent's that stands open."""
    stones = [home(0, 0.7, 0.5), home(1, -0.7, 0.6), away(6, 0.0, 0.3)]
    view = view_of(stones, lead=0, ends_left=2)
    points = [after.game.line_score[-1][0] for after, _ in played(view, player.call(view))]
    assert np.mean(points) > 2.2


def test_one_down_with_the_hammer_in_the_last_end_it_plays_for_two(player):
    """A draw beside the counting stone scores two and wins; hitting the other scores one."""
    stones = [home(0, 0.3, -0.2), away(5, -1.5, 0.5)]
    view = view_of(stones, lead=-1, ends_left=1)
    wins = [after.game.winner is Team.HOME for after, _ in played(view, player.call(view))]
    assert np.mean(wins) > 0.8


def test_an_empty_house_is_blanked_to_keep_the_hammer(player):
    """Level with an end to come after this one, the hammer is worth more than a point."""
    view = view_of([], lead=0, ends_left=2)
    best = player.call(view)
    evaluator = player._evaluator(view)
    worth = evaluator.game_odds.by_score(0, 2)
    blank, one = worth[SCORES == 0], worth[SCORES == 1]
    assert blank > one
    scores = [after.game.line_score[-1] for after, _ in played(view, best)]
    assert scores.count((0, 0)) >= 38


def test_level_in_the_last_end_it_draws_for_one(player):
    view = view_of([], lead=0, ends_left=1)
    scores = [after.game.line_score[-1] for after, _ in played(view, player.call(view))]
    assert scores.count((1, 0)) >= 38


def test_a_protected_guard_is_left_in_play(player):
    stones = [away(0, 0.0, -3.0)]
    view = view_of(stones, delivered=1, lead=2, ends_left=1)
    faults = [shot.ruling.fault for _, shot in played(view, player.call(view), 20)]
    assert faults.count(Fault.FREE_GUARD_ZONE) == 0
    assert faults.count(Fault.NO_TICK) <= 2


def test_the_same_seed_is_the_same_choice_and_another_player_object_changes_nothing(player):
    view = view_of([away(0, 0.2, 0.3), home(0, -0.8, 0.2)], delivered=11)
    first, again = player.ranked_shots(view), SearchPlayer(BUDGET).ranked_shots(view)
    assert first == again
    other = replace(view, entropy=(view.entropy[0] + 1, *view.entropy[1:]))
    assert player.ranked_shots(other) != first


def test_it_does_not_know_its_own_luck(player):
    """The error that the game will give the throw is none of those that the search tries."""
    view = view_of([], delivered=15, seed=5)
    simulator = GameSimulator(rules=FOURS, skills="elite", ice_evolution=NO_EVOLUTION)
    luck = simulator.with_execution_error(
        Throw(speed=2.0), view.skill, GameState(game=view.game, seed=5, throws=15)
    )
    tried = view.rng().standard_normal((3000, 3)) * view.skill.sigma_speed
    assert np.abs(tried[:, 0] - (luck.speed - 2.0)).min() > 1e-12


@pytest.mark.parametrize("budget", [1, 60, 700])
def test_the_budget_is_kept(budget, monkeypatch):
    tried = []
    play = EndSimulator.play
    monkeypatch.setattr(
        EndSimulator,
        "play",
        lambda self, b, d, throws: tried.append(len(throws)) or play(self, b, d, throws),
    )
    SearchPlayer(budget).call(view_of([away(0, 0.0, 0.3), home(0, 0.5, 0.9)], delivered=9))
    assert 1 <= sum(tried) <= max(1.2 * budget, 150)


def test_a_time_is_turned_into_a_budget_by_the_measured_rate(monkeypatch):
    simulated = []
    play = EndSimulator.play
    monkeypatch.setattr(
        EndSimulator,
        "play",
        lambda self, b, d, throws: simulated.append(len(throws)) or play(self, b, d, throws),
    )
    thinker = SearchPlayer(seconds=0.03)
    view = view_of([away(0, 0.0, 0.3)], delivered=9)
    for _ in range(2):
        allowed = thinker._rate * 0.03
        simulated.clear()
        thinker.call(view)
        assert min(0.5 * allowed, 150) <= sum(simulated) <= max(1.2 * allowed, 150)
    assert SearchPlayer(seconds=0.03)._rate != thinker._rate  # it has measured its own


def test_options_are_read_and_refused():
    assert player_from("search:250").name == "search:250"
    assert player_from("search:0.5s").name == "search:0.5s"
    for wrong in ("search:", "search:much", "search:0", "search:-1s", "draw:3"):
        with pytest.raises(InputError):
            player_from(wrong)


@pytest.mark.parametrize("rules", ALL_RULES)
def test_an_end_of_every_rules_is_played_without_a_fault(rules):
    simulator = GameSimulator(
        rules=rule_set(rules, ends=1),
        skills="elite",
        ice_evolution=TYPICAL_EVOLUTION,
        sweeping=True,
    )
    game = play_game(simulator, (SearchPlayer(150), DrawPlayer()), seed=1)
    faults = [d.shot.ruling.fault for d in game.deliveries if d.shot.team is Team.HOME]
    assert game.game.is_over
    assert sum(f in (Fault.FREE_GUARD_ZONE, Fault.EARLY_TAKEOUT) for f in faults) <= 1
    assert all(d.shot.call.shot in KINDS for d in game.deliveries if d.shot.team is Team.HOME)


def test_it_outscores_the_draw_player_blind():
    """Two games of four ends, one with the hammer first: half a point an end at the least."""
    simulator = GameSimulator(
        rules=rule_set("world_curling_2024", ends=4),
        skills="elite",
        ice_evolution=TYPICAL_EVOLUTION,
    )
    lead = ends = 0
    for seed in range(2):
        pair = SearchPlayer(600), DrawPlayer()
        game = play_game(simulator, pair, seed=70 + seed, last_stone=Team(seed)).game
        lead, ends = lead + game.lead(Team.HOME), ends + len(game.line_score)
    assert lead / ends > 0.5


# --- what it is made of ---------------------------------------------------------------------------


def positions(rng, n, delivered):
    """Positions in which stones lie anywhere in play, none upon another."""
    stones = np.full((n, SLOTS, 2), np.nan)
    for position in stones:
        for slot in [8 + k for k in range((delivered + 1) // 2)] + list(range(delivered // 2)):
            if rng.random() < 0.2:
                continue
            for _ in range(50):
                place = rng.uniform([-1.8, -5.5], [1.8, 1.7])
                if rng.random() < 0.3:
                    place[0] *= 0.05
                gaps = np.hypot(*(position - place).T)
                if not (gaps < 0.3).any():
                    position[slot] = place
                    break
    return stones


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


def bumpy() -> Ice:
    ice = load_ice("standard")
    rng = np.random.default_rng(3)
    mu = ice.friction.mu * np.exp(0.03 * rng.standard_normal(ice.friction.mu.shape))
    return replace(ice, friction=replace(ice.friction, mu=mu))


@pytest.mark.parametrize("ice", [load_ice("standard"), bumpy()], ids=["even", "bumpy"])
@pytest.mark.parametrize("direction", Direction)
@pytest.mark.parametrize("delivery", [FROM_HOG_LINE, FROM_HACK], ids=["hog line", "hack"])
def test_the_table_finds_draws_and_hits(ice, direction, delivery):
    table = AimingTable(ice, direction, delivery)
    aim = Aim(ice, direction, delivery=delivery)
    rng = np.random.default_rng(0)
    x, y = rng.uniform(-1.5, 1.5, 30), rng.uniform(-4.5, 1.5, 30)
    for spin in table.spins:
        draws = table.draws(x, y, spin)
        assert np.isfinite(draws).all()
        rests = [aim.rest(Throw(speed=v, angle=a, spin=w)) for v, a, w in draws.tolist()]
        miss = np.hypot(*(np.array(rests) - np.column_stack([x, y])).T)
        # An execution error of `elite` is some 0.2 m.
        assert miss.max() < (0.006 if ice.friction.mu.std() == 0 else 0.08)
        for weight in HIT_WEIGHTS:
            hits = table.hits(x, y, weight, spin)
            for k in range(0, 30, 10):
                speed = min(weight * table.button_speed, delivery.max_speed)
                there = aim.through(x[k], y[k], speed, spin)
                assert there is not None
                assert abs(hits[k, 1] - there.angle) * -delivery.start_y < 0.03


def test_what_cannot_be_reached_is_no_shot():
    table = AimingTable(load_ice("standard"), Direction.AWAY)
    far = table.draws(np.array([0.0, 9.0, 0.0]), np.array([12.0, 0.0, 0.0]), 1.5)
    assert np.isnan(far[:2]).all()
    assert np.isfinite(far[2]).all()


def test_shots_of_every_kind_come_to_mind():
    end = End(
        hammer=Team.HOME,
        delivered=10,
        stones=(home(0, 0.2, 0.4), away(0, 0.3, -3.0), away(1, -0.5, 0.2)),
    )
    ice = load_ice("standard")
    simulator = EndSimulator(ice=ice, direction=Direction.AWAY, rules=FOURS, lines=LINES)
    shots = shots_for(
        AimingTable(simulator.ice, simulator.direction),
        simulator,
        position_of(end)[None],
        end.delivered,
    )
    assert np.isfinite(shots.throws).all()
    # It is the turn of the team without the hammer, whose second stone can be guarded.
    assert {KINDS[k] for k in shots.kind} == set(KINDS)
    last = shots_for(
        AimingTable(simulator.ice, simulator.direction), simulator, position_of(end)[None], 15
    )
    assert not {"guard", "cover"} & {KINDS[k] for k in last.kind}


def test_kernel_regression_finds_the_mean_of_a_known_worth():
    """Worth is a parabola of the speed, so its mean under the error is known: -(v² + σ²)."""
    rng = np.random.default_rng(0)
    sigma = np.array([0.1, 0.01, 0.1])
    tried = np.array([[v, 0.0, 1.5] for v in (-0.2, -0.1, 0.0, 0.1, 0.2)])
    often = np.full(5, 400.0)
    executed = (tried[:, None] + rng.standard_normal((5, 400, 3)) * sigma).reshape(-1, 3)
    worth = -(executed[:, 0] ** 2)
    asked = np.concatenate([tried, [[0.05, 0.0, 1.5]]])  # the last one was never tried
    mean, error = estimate(asked, tried, often, executed, worth, sigma)
    truth = -(asked[:, 0] ** 2 + sigma[0] ** 2)
    assert np.all(np.abs(mean - truth) < 4 * error)
    assert error.max() < 0.003
    alone = executed[:400], worth[:400]
    _, by_itself = estimate(tried[:1], tried[:1], often[:1], *alone, sigma)
    assert error[2] < by_itself[0] * 1.5


@pytest.mark.parametrize("tails", [3.0, np.inf])
def test_throws_nearby_tell_of_a_throw_also_with_tails_and_a_correlation(tails):
    skill = Skill(name="own", sigma_speed=0.02, sigma_angle=0.003, sigma_spin=0.1, tails=tails,
                  correlation=0.7)  # fmt: skip
    sigma = np.array([0.02, 0.003, 0.1])
    tried = np.array([[2.0, 0.0, 1.5], [2.02, 0.002, 1.5], [1.98, -0.003, 1.5]])
    rng, often = np.random.default_rng(8), np.full(3, 3000.0)
    errors = np.array([skill.standard_errors(3000, rng) for _ in tried]) * sigma
    executed = (tried[:, None] + errors).reshape(-1, 3)

    def made(throws):  # needs speed and line together, as a throw behind a guard does
        speed, angle = ((throws[:, :2] - tried[0, :2]) / sigma[:2]).T
        return ((np.abs(speed) < 1) & (np.abs(angle) < 0.5)).astype(float)

    asked = np.concatenate([tried, [[2.01, 0.001, 1.5]]])
    mean, error = estimate(
        asked, tried, often, executed, made(executed), sigma, tails=tails, correlation=0.7
    )
    many = skill.standard_errors(100_000, rng) * sigma
    truth = np.array([made(one + many).mean() for one in asked])
    assert np.abs(mean - truth).max() < 0.015
    assert np.all(np.abs(mean - truth) < 4 * error)


def test_a_team_that_wants_to_score_plays_no_blank(player):
    """An empty house and the last stone: a draw for one, or out of the house to keep the hammer."""
    view = view_of([], ends_left=6)
    blanked = player.call(view)
    eager = SearchPlayer(BUDGET, calls=CallingStyle(blank_cost=0.3))
    assert blanked.shot == "through the house" or blanked.throw.speed > 2.3
    assert eager.call(view).throw.speed < 2.3
    at_last = view_of([], ends_left=2)
    assert eager.call(at_last) == player.call(at_last)
    with pytest.raises(InputError, match="blank_cost"):
        CallingStyle(blank_cost=2.0)


@pytest.mark.parametrize(
    ("calls", "lead", "ends_left", "cheaper"),
    [
        (CallingStyle(blank_cost=0.1), 1, 5, [0]),
        (CallingStyle(single_cost=0.1), 0, 5, [1]),
        (CallingStyle(single_cost=0.1), -3, 5, [1]),
        (CallingStyle(single_cost=0.1), 1, 5, []),  # who leads takes a point
        (CallingStyle(blank_cost=0.1, single_cost=0.1), 0, 2, []),  # and so does who must
        (CallingStyle(blank_cost=0.1, single_cost=0.1), 0, 3, [0, 1]),
    ],
)
def test_a_style_takes_from_blanks_and_single_points_what_it_says(calls, lead, ends_left, cheaper):
    odds = np.linspace(0, 1, len(SCORES))
    seen = calls.with_hammer(odds, lead, ends_left)
    np.testing.assert_allclose(odds - seen, 0.1 * np.isin(SCORES, cheaper))
    with pytest.raises(InputError, match="single_cost"):
        CallingStyle(single_cost=-2.0)


def test_handles_tell_nothing_of_each_other():
    tried = np.array([[2.0, 0.0, 1.5], [2.0, 0.0, -1.5]])
    executed = np.repeat(tried, 10, axis=0)
    worth = np.repeat([0.2, 0.8], 10)
    mean, _ = estimate(tried, tried, np.full(2, 10.0), executed, worth, np.array([0.1, 0.1, 0.1]))
    np.testing.assert_allclose(mean, [0.2, 0.8], atol=1e-6)


def coin(blank, one, steal):
    """Shares of ends in which the hammer team scores one, blanks or is stolen from."""
    shares = np.zeros(len(SCORES))
    shares[SCORES == 0], shares[SCORES == 1], shares[SCORES == -1] = blank, one, steal
    return shares


def test_the_chances_to_win_are_those_of_a_game_of_coins():
    winning = WinProbability(FOURS, coin(0.5, 0.3, 0.2))
    assert winning.with_hammer(0, 0) == pytest.approx(0.6, abs=0.01)  # 0.3 of 0.3 and 0.2
    assert winning.with_hammer(1, 0) == 1.0
    # One behind with an end to play: 0.3 to tie, and then without the hammer.
    assert winning.with_hammer(-1, 1) == pytest.approx(0.3 * 0.4, abs=0.01)
    assert winning.with_hammer(0, 1) == pytest.approx(0.3 + 0.5 * 0.6, abs=0.01)
    scores = winning.by_score(0, 1)
    assert scores[SCORES == 1] == 1.0
    assert scores[SCORES == -1] == 0.0
    mixed = WinProbability(rule_set("mixed_doubles_2024"), coin(0.5, 0.3, 0.2))
    # There a blank gives the decision away: x = 0.3 + 0.5 (1 - x).
    assert mixed.with_hammer(0, 0) == pytest.approx(0.8 / 1.5, abs=0.01)


@pytest.fixture(scope="module")
def evaluator():
    return PositionEvaluator(load_network(), FOURS, LINES, 0.0)


def test_chances_to_win_are_those_of_curling(evaluator):
    table = [evaluator.game_odds.with_hammer(lead, 4) for lead in range(-4, 5)]
    assert all(a <= b for a, b in pairwise(table))
    assert evaluator.game_odds.with_hammer(0, 4) > 0.5
    assert evaluator.game_odds.with_hammer(-3, 1) < 0.1


def test_the_network_knows_what_counts(evaluator):
    """Before the last stone, of a stone alone on the button and of one that is the opponent's."""
    worth = evaluator.game_odds.by_score(0, 4)
    stones = np.full((3, SLOTS, 2), np.nan)
    stones[0, 0] = stones[1, 8] = 0.0, 0.1
    chances = evaluator.network.score_probabilities(LINES, stones, 1, worth, 0.0)
    assert chances.sum(axis=1) == pytest.approx(np.ones(3))
    points = chances @ SCORES
    assert points[0] > points[2] + 0.3 > points[1]
    early = evaluator.network.score_probabilities(LINES, stones, 12, worth, 0.0) @ SCORES
    assert points[0] - points[1] > early[0] - early[1]


def test_what_the_network_sees_does_not_depend_on_the_order_of_stones(evaluator):
    rng = np.random.default_rng(2)
    stones = positions(rng, 20, 12)
    shuffled = stones.copy()
    shuffled[:, :8] = stones[:, rng.permutation(8)]
    shuffled[:, 8:] = stones[:, 8 + rng.permutation(8)]
    worth = evaluator.game_odds.by_score(0, 4)
    np.testing.assert_allclose(
        evaluator.network.score_probabilities(LINES, stones, 4, worth, 0.0),
        evaluator.network.score_probabilities(LINES, shuffled, 4, worth, 0.0),
        atol=1e-5,
    )


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


def test_stones_that_the_opponent_piled_up_are_bad_news(evaluator):
    """Four counting stones of the opponent's and one to come: no team of the network's own kind
    leaves that, and a network that has not seen it takes it for a good house."""
    stones = np.full((1, SLOTS, 2), np.nan)
    stones[0, 8:12] = [(0.0, -0.1), (0.15, 0.35), (0.13, -0.45), (-0.55, 0.2)]
    stones[0, :4] = [(0.8, 0.3), (-0.8, -1.0), (1.2, -0.9), (-0.6, -2.3)]
    values = evaluator.game_odds.by_score(0, 4)
    points = evaluator.network.score_probabilities(LINES, stones, 2, values, 0.0) @ SCORES
    assert points[0] < -0.5
