"""Game between two players."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import NamedTuple

from curling_env.errors import InputError
from curling_env.game import GameSimulator, GameState, PlayedShot, Player
from curling_env.game.rules import Game, Team, concede, may_concede


class PlayedDelivery(NamedTuple):
    """One delivery of a game, and the game before and after it."""

    before: GameState
    shot: PlayedShot
    after: GameState


@dataclass(frozen=True, kw_only=True)
class PlayedGame:
    """Completed game.

    Parameters
    ----------
    players : players of home and away
    deliveries : all deliveries in order, with paths if requested
    game : game at its end
    """

    players: tuple[Player, Player]
    deliveries: tuple[PlayedDelivery, ...]
    game: Game


class Match:
    """One game, played delivery by delivery.

    Parameters
    ----------
    simulator : the ice, the rules and the skills
    players : players of home and away
    seed : seed of all randomness; the same seed gives the same game
    last_stone : team with the hammer in the first end; by default the seed decides
    paths : keep the stones' paths of each delivery
    start : a game to continue, instead of a new one

    Notes
    -----
    Iteration plays the game and yields its deliveries; `game` is the current game.
    """

    def __init__(
        self,
        simulator: GameSimulator,
        players: tuple[Player, Player],
        *,
        seed: int,
        last_stone: Team | None = None,
        paths: bool = False,
        start: GameState | None = None,
    ) -> None:
        if seed < 0:
            raise InputError(f"a seed must be at least 0, got {seed}")
        self.simulator, self.players, self.paths = simulator, players, paths
        first = Team(seed % 2) if last_stone is None else last_stone
        self.state = simulator.new_game(seed, last_stone=first) if start is None else start

    @property
    def game(self) -> Game:
        """Current game."""
        return self.state.game

    def __iter__(self) -> Iterator[PlayedDelivery]:
        while not self.game.is_over:
            if self.game.end is None:
                decider = self.players[self.game.last_stone]
                self.state = self.simulator.begin_end_as(self.state, decider)
            end = self.game.end
            assert end is not None
            team = end.to_throw
            player, opponent = self.players[team], self.players[team.other]
            view = self.simulator.view(self.state)
            if may_concede(self.game, team) and player.concedes(view):
                self.state = replace(self.state, game=concede(self.game, team))
                return
            before = self.state
            self.state, shot = self.simulator.play(
                before, player.call(view), opponent=opponent, paths=self.paths
            )
            yield PlayedDelivery(before, shot, self.state)


def play_game(
    simulator: GameSimulator,
    players: tuple[Player, Player],
    *,
    seed: int,
    last_stone: Team | None = None,
    paths: bool = False,
) -> PlayedGame:
    """Play a game to its end; see `Match` for the parameters."""
    match = Match(simulator, players, seed=seed, last_stone=last_stone, paths=paths)
    deliveries = tuple(match)
    return PlayedGame(players=players, deliveries=deliveries, game=match.game)
