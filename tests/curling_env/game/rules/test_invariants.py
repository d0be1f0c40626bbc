"""Invariants of every position and every delivery, under all rules."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from curling_env.errors import InputError
from curling_env.game import (
    RULE_SETS,
    Fault,
    Lines,
    RestingStone,
    Result,
    Team,
    begin_end,
    concede,
    count,
    deliver,
    may_concede,
    new_game,
    rule_on,
    rule_set,
    score_of,
    shot_order,
    stones_left,
)

LINES = Lines()
places = st.tuples(st.floats(-2.2, 2.2), st.floats(-6.5, 1.9))
rule_sets = st.sampled_from(sorted(RULE_SETS)).map(rule_set)
teams = st.sampled_from(Team)


@st.composite
def positions(draw: st.DrawFn, most: int = 15) -> tuple[RestingStone, ...]:
    handles = draw(
        st.lists(st.tuples(teams, st.integers(0, 7)), unique=True, min_size=0, max_size=most)
    )
    return tuple(RestingStone(team, number, *draw(places)) for team, number in handles)


@given(positions(16), rule_sets)
def test_one_team_scores_and_never_more_than_its_stones(stones, rules):
    home, away = score_of(rules, LINES, stones)
    assert min(home, away) == 0
    assert 0 <= home + away <= 8
    for team, points in ((Team.HOME, home), (Team.AWAY, away)):
        assert points <= sum(s.team is team for s in shot_order(LINES, stones))


@given(positions(16))
def test_colours_and_sides_do_not_matter(stones):
    team, points = count(LINES, stones)
    swapped = tuple(s._replace(team=s.team.other) for s in stones)
    mirrored = tuple(s._replace(x=-s.x) for s in stones)
    assert count(LINES, swapped) == (None if team is None else team.other, points)
    assert count(LINES, mirrored) == (team, points)
    assert count(LINES, stones[::-1]) == (team, points)


@st.composite
def deliveries(draw: st.DrawFn):
    before = draw(positions())
    after = tuple(
        draw(
            st.one_of(
                st.just(s), st.none(), places.map(lambda p, s=s: RestingStone(s.team, s.number, *p))
            )
        )
        for s in before
    )
    team = draw(teams)
    thrown = draw(st.one_of(st.none(), places.map(lambda p: RestingStone(team, 7, *p))))
    return before, team, draw(st.integers(0, 15)), Result((*after, thrown), draw(st.booleans()))


@given(deliveries(), rule_sets)
def test_a_ruling_makes_no_stone_and_puts_all_back_or_none(delivery, rules):
    before, team, delivered, result = delivery
    ruling = rule_on(rules, LINES, before, team, delivered, result)
    handles = [(s.team, s.number) for s in ruling.stones]
    assert len(handles) <= len(before) + 1
    if ruling.fault in (Fault.FREE_GUARD_ZONE, Fault.EARLY_TAKEOUT):
        assert ruling.stones == before
        assert delivered < 5
    else:
        assert set(ruling.stones) <= {s for s in result.after if s is not None}
    assert (ruling.option is not None) == (ruling.fault is Fault.NO_TICK)
    if ruling.fault is Fault.HOG_LINE:
        assert result.after[-1] not in ruling.stones
        assert not result.struck


@given(deliveries(), rule_sets)
def test_from_the_sixth_stone_on_nothing_is_protected(delivery, rules):
    before, team, _, result = delivery
    ruling = rule_on(rules, LINES, before, team, 5, result)
    assert ruling.fault in (None, Fault.HOG_LINE)


@given(rule_sets, st.integers(1, 3), teams, st.randoms(use_true_random=False))
def test_a_game_ends_and_every_stone_is_thrown_in_turn(rules, ends, last_stone, random):
    rules = rule_set(rules, ends=ends, max_extra_ends=2)
    game = new_game(rules, last_stone=last_stone)
    while not game.is_over:
        game = begin_end(game)
        assert game.end is not None
        hammer, thrown = game.end.hammer, {Team.HOME: 0, Team.AWAY: 0}
        played = len(game.line_score)
        while game.end is not None:
            end = game.end
            assert end.to_throw is (hammer if end.delivered % 2 else hammer.other)
            thrown[end.to_throw] += 1
            stone = None
            if random.random() < 0.5:
                stone = RestingStone(
                    end.to_throw, end.number_of_stone, random.uniform(-2, 2), random.uniform(-3, 1)
                )
            game, _ = deliver(game, Result((*end.stones, stone), False))
            if game.end is not None:
                for team in Team:
                    assert stones_left(rules, game.end, team) == rules.stones - thrown[team]
        assert len(game.line_score) == played + 1
        if played < rules.ends - 1:  # only the last end may stop early
            assert set(thrown.values()) == {rules.stones}
    home, away = game.score
    if home != away:
        assert game.winner is (Team.HOME if home > away else Team.AWAY)
    else:
        assert game.winner is None
        assert len(game.line_score) == rules.ends + 2


def test_the_last_end_stops_once_no_team_can_catch_up():
    rules = rule_set("world_curling_2024", ends=1)
    game = begin_end(new_game(rules))
    # Tied before it, so all sixteen stones are thrown whatever lies there.
    while game.end is not None:
        end = game.end
        game, _ = deliver(game, Result((*end.stones, None), False))
    assert not game.is_over

    game = begin_end(game)  # the extra end
    for k in range(15):
        assert game.end is not None, k
        game, _ = deliver(game, Result((*game.end.stones, None), False))
    assert game.end is not None

    leading = begin_end(
        type(game)(rules=rule_set(rules, ends=2), line_score=((3, 0),), last_stone=Team.AWAY)
    )
    thrown = 0
    while leading.end is not None:
        leading, _ = deliver(leading, Result((*leading.end.stones, None), False))
        thrown += 1
    assert leading.winner is Team.HOME
    assert thrown == 12  # away has two stones left and needs three points


def test_mixed_doubles_places_stones_and_gives_one_power_play():
    rules = rule_set("mixed_doubles_2024")
    game = begin_end(new_game(rules, last_stone=Team.HOME), power_play="right")
    assert game.end is not None
    guard, inside = game.end.stones
    assert (guard.team, inside.team) == (Team.AWAY, Team.HOME)
    assert guard.x == inside.x == pytest.approx(1.219)
    assert inside.y == pytest.approx(-0.145)
    assert LINES.in_free_guard_zone(guard.x, guard.y)
    assert game.end.to_throw is Team.AWAY
    assert [rules.throwers[k] for k in range(5)] == [0, 1, 1, 1, 0]
    while game.end is not None:  # everything through: home's placed stone counts
        game, _ = deliver(game, Result((*game.end.stones, None), False))
    assert game.line_score == ((1, 0),)
    assert game.last_stone is Team.AWAY
    game = begin_end(game)
    assert game.end is not None
    guard, inside = game.end.stones
    assert guard.x == inside.x == 0.0
    assert inside.y + 0.145 == pytest.approx(0.610)
    with pytest.raises(InputError, match="already in play"):
        begin_end(game)


def test_a_power_play_is_refused_twice_and_in_extra_ends():
    rules = rule_set("mixed_doubles_2024", ends=2)
    game = type(new_game(rules))(
        rules=rules, line_score=((0, 1),), power_plays=(Team.HOME,), last_stone=Team.HOME
    )
    with pytest.raises(InputError, match="has had its power play"):
        begin_end(game, power_play="left")
    extra = type(game)(rules=rules, line_score=((0, 1), (1, 0)), last_stone=Team.AWAY)
    with pytest.raises(InputError, match="extra end"):
        begin_end(extra, power_play="left")
    with pytest.raises(InputError, match="no power play"):
        begin_end(new_game(rule_set("world_curling_2024")), power_play="left")


def test_concession_needs_ones_own_turn():
    rules = rule_set("world_curling_2024", ends_before_concession=0)
    game = begin_end(new_game(rules, last_stone=Team.AWAY))
    assert may_concede(game, Team.HOME)
    assert not may_concede(game, Team.AWAY)
    assert concede(game, Team.HOME).winner is Team.AWAY


def test_unknown_rules_are_refused_by_name():
    with pytest.raises(InputError, match="digital_curling"):
        rule_set("backyard")
