"""A game from end to end: turns, its end, refusals."""

from __future__ import annotations

import pytest

from curling_env.errors import InputError
from curling_env.game import (
    Game,
    RestingStone,
    Result,
    Team,
    begin_end,
    concede,
    deliver,
    may_concede,
    new_game,
    rule_set,
)

FOURS = rule_set("world_curling_2024")
DOUBLES = rule_set("mixed_doubles_2024")


def after(*line_score: tuple[int, int], rules=FOURS, **others) -> Game:
    return Game(rules=rules, line_score=line_score, **others)


def test_score_lead_and_ends_left_go_by_the_line_score():
    game = after((2, 0), (0, 3), (0, 0))
    assert game.score == (2, 3)
    assert (game.lead(Team.HOME), game.lead(Team.AWAY)) == (-1, 1)
    assert game.ends_left == 7
    assert not game.is_extra_end
    assert not game.is_over
    assert game.winner is None


def test_ties_are_played_off_until_the_extra_ends_are_used_up():
    rules = rule_set(FOURS, ends=2, max_extra_ends=1)
    tied = after((1, 0), (0, 1), rules=rules)
    assert not tied.is_over
    assert tied.is_extra_end
    assert tied.ends_left == 0
    still = after((1, 0), (0, 1), (0, 0), rules=rules)
    assert still.is_over
    assert still.winner is None
    assert still.ends_left == 0
    assert not after((1, 0), (0, 1), *[(0, 0)] * 9, rules=rule_set(FOURS, ends=2)).is_over
    won = after((1, 0), (0, 1), (0, 1), rules=rules)
    assert won.is_over
    assert won.winner is Team.AWAY
    assert after((2, 0), (0, 1), rules=rules).winner is Team.HOME
    none = rule_set(FOURS, ends=2, max_extra_ends=0)
    assert after((1, 0), (0, 1), rules=none).is_over


def test_an_end_cannot_begin_twice_or_after_the_game():
    with pytest.raises(InputError, match="already in play"):
        begin_end(begin_end(new_game(FOURS)))
    with pytest.raises(InputError, match="the game is over"):
        begin_end(after((1, 0), rules=rule_set(FOURS, ends=1)))
    with pytest.raises(InputError, match="no end is in play"):
        deliver(new_game(FOURS), Result((None,), False))


def test_the_deciding_team_of_mixed_doubles_may_throw_first():
    decides = new_game(DOUBLES, last_stone=Team.HOME)
    first, last = begin_end(decides, throw_first=True), begin_end(decides)
    assert (first.end.hammer, last.end.hammer) == (Team.AWAY, Team.HOME)
    assert (first.end.to_throw, last.end.to_throw) == (Team.HOME, Team.AWAY)
    with pytest.raises(InputError, match="last stone"):
        begin_end(decides, throw_first=True, power_play="left")
    with pytest.raises(InputError, match="no choice"):
        begin_end(new_game(FOURS), throw_first=True)


def test_a_power_play_is_the_deciding_teams_once_and_between_ends():
    game = new_game(DOUBLES, last_stone=Team.HOME)
    assert game.may_power_play
    taken = begin_end(game, power_play="left")
    assert taken.power_plays == (Team.HOME,)
    assert taken.end.stones[0].x == -1.219
    assert not taken.may_power_play
    assert begin_end(game).power_plays == ()
    assert not after((1, 0), rules=DOUBLES, last_stone=Team.AWAY, power_plays=(1,)).may_power_play
    assert after((1, 0), rules=DOUBLES, last_stone=Team.AWAY, power_plays=(0,)).may_power_play
    assert not new_game(FOURS).may_power_play


@pytest.mark.parametrize(
    ("guard", "y"), [("middle", -4.115), ("near_house", -3.2), ("near_hog_line", -5.03)]
)
def test_the_guard_of_mixed_doubles_is_at_one_of_three_places(guard, y):
    stones = begin_end(new_game(DOUBLES), guard=guard).end.stones
    assert stones[0].y == pytest.approx(y)
    assert [stone.number for stone in stones] == [5, 5]


@pytest.mark.parametrize(
    ("arrangement", "guard", "beside"),
    # The places that the server itself has, from its hack at 38.405 m before the tee.
    [(0, 35.350, 1.093), (1, 35.060, 1.087), (3, 34.145, 1.067), (5, 33.230, 1.047)],
)
def test_digital_curling_has_six_arrangements(arrangement, guard, beside):
    rules = rule_set("dc4_server_mixed_doubles", arrangement=arrangement)
    game = new_game(rules, last_stone=Team.HOME)
    lying = begin_end(game).end.stones
    places = [(s.team, s.x, pytest.approx(s.y + 38.405, abs=1e-3)) for s in lying]
    assert places == [(Team.AWAY, 0.0, guard), (Team.HOME, 0.0, 38.870)]
    aside = begin_end(game, power_play="left").end.stones
    assert [s.x for s in aside] == pytest.approx([-beside, -1.219], abs=1e-3)
    assert [s.y + 38.405 for s in aside] == pytest.approx([guard, 38.260], abs=1e-3)


def test_an_invalid_arrangement_is_refused():
    with pytest.raises(InputError, match="0 to 5, got 6"):
        rule_set("dc4_server_mixed_doubles", arrangement=6)


def test_a_blank_end_passes_the_decision_on_whoever_threw_first():
    rules = rule_set("dc4_server_mixed_doubles")
    for throw_first in (False, True):
        game = begin_end(new_game(rules, last_stone=Team.AWAY), throw_first=throw_first)
        while game.end is not None:
            lying = game.end.stones
            left = lying if game.end.delivered < rules.no_takeout_until else (None,) * len(lying)
            game, _ = deliver(game, Result((*left, None), True))
        assert game.line_score == ((0, 0),)
        assert game.last_stone is Team.HOME


def test_the_opponent_may_leave_the_stones_after_a_tick():
    game = begin_end(new_game(FOURS, last_stone=Team.AWAY))
    guard = RestingStone(Team.HOME, 0, 0.0, -4.0)
    game, _ = deliver(game, Result((guard,), False))
    moved, shooter = guard._replace(x=1.0), RestingStone(Team.AWAY, 0, -1.0, -4.0)
    ticked = Result((moved, shooter), True)
    kept, ruling = deliver(game, ticked, put_back=lambda ruling: False)
    assert ruling.option == (guard,)
    assert set(kept.end.stones) == {moved, shooter}
    for put_back in (None, lambda ruling: True):
        back, _ = deliver(game, ticked, put_back=put_back)
        assert back.end.stones == (guard,)
        assert back.end.delivered == 2


def test_stones_are_numbered_by_team_on_the_whole_sheet():
    assert [RestingStone(team, 3, 0.3, 0.4).stone for team in Team] == [3, 11]
    assert RestingStone(Team.HOME, 0, 0.3, -0.4).distance == pytest.approx(0.5)
    assert [team.label for team in Team] == ["home", "away"]
    assert Team.HOME.other is Team.AWAY


def test_a_team_concedes_between_ends_or_at_its_turn_once_enough_is_played():
    six = after(*[(1, 0)] * 6)
    assert may_concede(six, Team.HOME)
    assert may_concede(six, Team.AWAY)
    assert not may_concede(after(*[(1, 0)] * 5), Team.AWAY)
    lost = concede(six, Team.AWAY)
    assert lost.is_over
    assert lost.winner is Team.HOME
    assert not may_concede(lost, Team.HOME)
    playing = begin_end(six)
    with pytest.raises(InputError, match="at its turn"):
        concede(playing, playing.end.to_throw.other)
    assert concede(playing, playing.end.to_throw).end is None
