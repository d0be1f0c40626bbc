"""A recorded game is taken up at any of its deliveries."""

import numpy as np
import pytest

from agents.playing.board.recorded import playable, rules_in, state_before
from agents.playing.match import play_game
from agents.playing.record import read_record, write_record
from curling_env.errors import InputError
from curling_env.game import GameSimulator
from curling_env.game.opponents import DrawPlayer, RuleBasedPlayer
from curling_env.game.rules import rule_set
from curling_env.ice import load_ice


@pytest.fixture(scope="module")
def played(tmp_path_factory):
    """Two ends of mixed doubles with a power play, and their record."""
    rules = rule_set("mixed_doubles_2024", ends=2)
    simulator = GameSimulator("standard", rules=rules, skills="club")
    game = play_game(simulator, (RuleBasedPlayer(), DrawPlayer()), seed=4, paths=True)
    path = tmp_path_factory.mktemp("record") / "game.jsonl"
    write_record(path, game, simulator, ice="standard", seed=4)
    return path, game


@pytest.mark.parametrize("k", [0, 6, 10, 19])
def test_the_state_is_that_of_the_game(played, k):
    path, game = played
    lines = read_record(path)
    simulator = GameSimulator("standard", rules=rules_in(lines))
    before = game.deliveries[k].before
    state = state_before(lines, simulator, k // 10 + 1, k % 10 + 1)
    assert state.throws == k
    ours, theirs = state.game, before.game
    assert ours.end is not None
    assert theirs.end is not None
    for name in ("number", "hammer", "delivered", "power_play", "to_throw"):
        assert getattr(ours.end, name) == getattr(theirs.end, name)
    assert (ours.line_score, ours.power_plays) == (theirs.line_score, theirs.power_plays)
    for one, other in zip(ours.end.stones, theirs.end.stones, strict=True):
        assert one[:2] == other[:2]
        assert one[2:] == pytest.approx(other[2:], abs=1e-9)


def test_the_game_goes_on_from_there(played, tmp_path, curling):
    path, game = played
    players = ("--home", "rulebased", "--away", "draw", "--skill", "club", "--still")
    out = tmp_path / "on"
    done = curling("play", *players, "--from", path, "--at", "2,9", "-o", out, "--json")
    assert done.json()["line_score"][0] == list(game.game.line_score[0])
    stones = [(line["end"], line["stone"]) for line in read_record(out / "game.jsonl")[1:-1]]
    assert stones[:2] == [(2, 9), (2, 10)]
    complaint = curling("play", *players, "--from", path, "--at", "9,1").complaint
    assert "has no stone 1 in end 9; its last is stone 10 in end" in complaint


def test_a_delivery_that_is_not_there_is_refused(played):
    lines = read_record(played[0])
    simulator = GameSimulator("standard", rules=rules_in(lines))
    with pytest.raises(InputError, match="has no stone 11 in end 1"):
        state_before(lines, simulator, 1, 11)


def test_stones_that_lie_in_each_other_or_over_a_line_are_moved():
    ice = load_ice("standard")
    edge = ice.sheet.width / 2 - ice.stone.radius
    places = np.array([[0.0, 0.0], [0.27, 0.0], [0.54, 0.0], [edge + 0.05, 2.0], [0.0, 1.0]])
    apart = playable(places, ice)
    distances = np.hypot(*(apart[1:3] - apart[:2]).T)
    assert (distances >= 2 * ice.stone.radius).all()
    assert np.abs(apart[:3] - places[:3]).max() < 0.04
    assert edge - 0.01 < apart[3, 0] < edge
    np.testing.assert_array_equal(apart[4], places[4])
