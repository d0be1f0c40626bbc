"""The player that searches: its values, its candidates, and its choices."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from agents.playing import (
    SCORES,
    AimingTable,
    CallingStyle,
    EndSimulator,
    SearchPlayer,
    play_game,
    player_from,
    position_of,
)
from agents.playing.search.calling_style import FOR_POINTS
from agents.playing.search.shots import KINDS, shots_for
from curling_env.errors import InputError
from curling_env.game import (
    NO_EVOLUTION,
    TYPICAL_EVOLUTION,
    DrawPlayer,
    End,
    Fault,
    GameSimulator,
    GameState,
    Lines,
    PlayerView,
    RestingStone,
    Team,
    player_named,
    rule_set,
)
from curling_env.ice import load_ice
from curling_env.sheet import Direction
from curling_env.throw import Throw

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
    """Return games after the call, with other random errors each time."""
    simulator = GameSimulator(rules=FOURS, skills=view.skill, ice_evolution=NO_EVOLUTION)
    return [simulator.play(GameState(game=view.game, seed=900 + k), call) for k in range(trials)]


def home(number, x, y):
    return RestingStone(Team.HOME, number, x, y)


def away(number, x, y):
    return RestingStone(Team.AWAY, number, x, y)


# --- what it chooses ------------------------------------------------------------------------------


def test_an_open_hit_for_three_is_taken_instead_of_a_draw_for_one(player):
    """Two own stones are second and third behind an open one of the opponent's."""
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
    """The error that the game will give the throw is not among those that the search tries."""
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


# --- what it thinks of ----------------------------------------------------------------------------


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
        (CallingStyle(single_cost=0.1), 1, 5, []),  # the leader takes a point
        (CallingStyle(blank_cost=0.1, single_cost=0.1), 0, 2, []),  # and so does who must
        (CallingStyle(blank_cost=0.1, single_cost=0.1), 0, 3, [0, 1]),
    ],
)
def test_a_style_reduces_blanks_and_single_points_by_its_costs(calls, lead, ends_left, cheaper):
    odds = np.linspace(0, 1, len(SCORES))
    seen = calls.worth(odds, lead, ends_left, with_hammer=True)
    assert calls.worth(odds, lead, ends_left, with_hammer=False) is odds
    np.testing.assert_allclose(odds - seen, 0.1 * np.isin(SCORES, cheaper))
    with pytest.raises(InputError, match="single_cost"):
        CallingStyle(single_cost=-2.0)


def test_a_search_for_points_takes_two_where_one_wins():
    odds = np.linspace(0, 1, len(SCORES)) > 0.5
    worth = FOR_POINTS.worth(odds, 0, 1, with_hammer=True)
    np.testing.assert_allclose(np.diff(worth), worth[-1] / (len(SCORES) - 1))
    assert worth.min() == 0.0
    assert worth.max() == 1.0
    assert player_named("search:50:points").calls is FOR_POINTS
    assert player_named("search:0.5s:points").seconds == 0.5
    with pytest.raises(InputError, match="search:500:points"):
        player_named("search:50:wins")
