"""A game between a person and a player, stored as its throws."""

from __future__ import annotations

from dataclasses import replace

import pytest

from agents.playing import GameTable, KeptGame, LaidStone, Position, kept_throws
from curling_env.errors import InputError
from curling_env.game import Team
from curling_env.ice import load_ice
from curling_env.sheet import TEE_Y
from curling_env.throw import SKILLS, Throw

CLUB = (SKILLS["club"], SKILLS["club"])
DRAW = Throw(speed=2.1347891, angle=0.0383333, spin=-1.5)
BUTTON = LaidStone(x=0.0, y=TEE_Y, team=Team.AWAY)


def table(game: KeptGame) -> GameTable:
    return GameTable(game, load_ice("standard"), CLUB)


def through(game: KeptGame, throw: Throw = DRAW) -> tuple[KeptGame, list]:
    """The game with one more throw of the person, and the opponent's answers; all deliveries."""
    game = replace(game, throws=(*game.throws, throw))
    here = table(game)
    deliveries = list(here.played(paths_from=len(game.throws)))
    deliveries += here.play_on(deliveries[-1].after)
    return replace(game, throws=kept_throws(deliveries)), deliveries


def test_an_end_against_greedy_is_the_same_when_it_is_played_again():
    # The position is late in the end, so that few throws are left.
    game = KeptGame(
        position=Position(stones=(BUTTON,), delivered=11, hammer=Team.HOME, ends_left=1),
        person=Team.HOME,
        seed=5,
    )
    deliveries: list = []
    assert table(game).to_throw(table(game).start) is Team.HOME
    while not deliveries or not deliveries[-1].after.game.is_over:
        game, deliveries = through(game)
    teams = [delivery.shot.team for delivery in deliveries[:5]]
    assert teams == [Team.HOME, Team.AWAY, Team.HOME, Team.AWAY, Team.HOME]
    again = list(table(game).played())
    assert len(again) == len(deliveries)
    last, replayed = deliveries[-1].after, again[-1].after
    assert replayed.game == last.game
    assert replayed.game.winner is not None
    with pytest.raises(InputError, match="the game is over"):
        list(table(replace(game, throws=(*game.throws, DRAW))).played())


def test_the_stored_throws_are_the_played_ones():
    kept, (first, *_) = through(KeptGame(seed=1, person=Team.HOME))
    thrown = first.shot.call.throw
    assert thrown == kept.throws[0]
    assert (thrown.speed, thrown.angle) == pytest.approx((DRAW.speed, DRAW.angle), abs=1e-4)
    assert first.shot.call.throw != DRAW
    assert first.shot.thrown != first.shot.call.throw  # club players scatter


def test_the_team_without_the_hammer_throws_first():
    for seed in (0, 1):
        game = KeptGame(seed=seed, person=Team.HOME)
        here = table(game)
        opening = list(here.play_on(here.start))
        # Team(seed % 2) has the last stone.
        assert len(opening) == (1 if Team(seed % 2) is Team.HOME else 0)
        if opening:
            assert opening[0].shot.outcome.trajectories
            assert here.to_throw(opening[0].after) is Team.HOME


def test_impossible_games_are_refused():
    with pytest.raises(InputError, match="at most 400 throws"):
        KeptGame(throws=(DRAW,) * 401)
    with pytest.raises(InputError, match="seed"):
        KeptGame(seed=-1)
    with pytest.raises(InputError, match="absent"):
        table(KeptGame(opponent="absent"))
