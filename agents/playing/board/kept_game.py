"""Game as the list of its throws: the content of an address or a file, from which it continues.

All randomness follows from the seed and the throws, so that the same list always gives the same
game. Throws are rounded before they are played; the rounded throws are stored.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from agents.playing.board.set_up import Position, set_up
from agents.playing.match import PlayedDelivery
from curling_env.errors import InputError
from curling_env.game import Call, GameSimulator, GameState, Player, PlayerView, player_named
from curling_env.game.rules import RuleSet, Team, concede, may_concede, rule_set
from curling_env.ice import Ice
from curling_env.throw import Skill, Throw

DECIMALS = 5
"""Number of decimals of a stored throw, enough for a place of rest to a millimetre."""
MAX_THROWS = 400
"""Maximum number of throws of a stored game: ten ends of fours and some extra ends."""


@dataclass(frozen=True, kw_only=True)
class KeptGame:
    """Game between a person and a player.

    Parameters
    ----------
    throws : throws up to now, in order, as called
    position : initial position; None for a game from its first end
    person : team of the person
    opponent : name of the other player, as in `curling play`
    rules : name of the rules
    ends : number of ends of a game from its first end
    seed : seed of all randomness, including the hammer of the first end

    Raises
    ------
    InputError : more throws than a game has, a negative seed
    """

    throws: tuple[Throw, ...] = ()
    position: Position | None = None
    person: Team = Team.HOME
    opponent: str = "greedy"
    rules: str = "world_curling_2024"
    ends: int = 2
    seed: int = 0

    def __post_init__(self) -> None:
        if len(self.throws) > MAX_THROWS:
            raise InputError(f"expected at most {MAX_THROWS} throws, got {len(self.throws)}")
        if self.seed < 0:
            raise InputError(f"a seed must be at least 0, got {self.seed}")

    @property
    def rule_set(self) -> RuleSet:
        """Rules of the game."""
        if self.position is not None:
            return self.position.rules(rule_set(self.rules))
        return rule_set(self.rules, ends=self.ends)


class GameTable:
    """Replay of a stored game, and its continuation.

    Parameters
    ----------
    game : the game
    ice : ice of the game
    skills : execution errors of home and away
    sweeping : let sweepers help a light stone
    opponent : the player with that name; a reused one remembers the ice

    Raises
    ------
    InputError : an unknown player or set of rules, or an impossible position
    """

    def __init__(
        self,
        game: KeptGame,
        ice: Ice,
        skills: tuple[Skill, Skill],
        *,
        sweeping: bool = False,
        opponent: Player | None = None,
    ) -> None:
        self.simulator = GameSimulator(ice, rules=game.rule_set, skills=skills, sweeping=sweeping)
        self.opponent = player_named(game.opponent) if opponent is None else opponent
        self.game = game
        person = Person()
        first, second = (person, self.opponent)
        self.players = (first, second) if game.person is Team.HOME else (second, first)
        if game.position is None:
            self.start = self.simulator.new_game(game.seed, last_stone=Team(game.seed % 2))
        else:
            self.start = set_up(self.simulator, game.position, seed=game.seed)

    def played(self, *, paths_from: int = 0) -> Iterator[PlayedDelivery]:
        """Return the stored deliveries in order.

        Parameters
        ----------
        paths_from : first delivery to keep the stones' paths of

        Raises
        ------
        InputError : throws after the end of the game
        """
        state = self.start
        for k, throw in enumerate(self.game.throws):
            delivery = self._deliver(state, throw, "", paths=k >= paths_from)
            yield delivery
            state = delivery.after

    def play_on(self, state: GameState) -> Iterator[PlayedDelivery]:
        """Let the opponent throw until it is the person's turn, or the game is over."""
        while not (state.game.is_over or self.to_throw(state) is self.game.person):
            state = self.begun(state)
            team = self.game.person.other
            view = self.simulator.view(state)
            if may_concede(state.game, team) and self.opponent.concedes(view):
                return
            call = self.opponent.call(view)
            delivery = self._deliver(state, call.throw, call.shot, paths=True)
            yield delivery
            state = delivery.after

    def conceded(self, state: GameState) -> GameState:
        """Return the game, conceded by the opponent if it wants to and may."""
        team = self.game.person.other
        if state.game.is_over or self.to_throw(state) is not team:
            return state
        state = self.begun(state)
        if may_concede(state.game, team) and self.opponent.concedes(self.simulator.view(state)):
            return replace(state, game=concede(state.game, team))
        return state

    def begun(self, state: GameState) -> GameState:
        """Return the game with an end in play."""
        if state.game.end is not None or state.game.is_over:
            return state
        return self.simulator.begin_end_as(state, self.players[state.game.last_stone])

    def to_throw(self, state: GameState) -> Team:
        """Team that throws next."""
        end = self.begun(state).game.end
        return self.game.person if end is None else end.to_throw

    def _deliver(self, state: GameState, throw: Throw, shot: str, *, paths: bool) -> PlayedDelivery:
        if state.game.is_over:
            raise InputError("the game is over: no further throw is possible")
        before = self.begun(state)
        end = before.game.end
        assert end is not None  # the game is not over
        other = self.players[end.to_throw.other]
        call = Call(throw=rounded(throw), shot=shot)
        after, played = self.simulator.play(before, call, opponent=other, paths=paths)
        return PlayedDelivery(before, played, after)


class Person(Player):
    """Person: throws what is called, and has stones put back as players usually do."""

    name = "person"

    def call(self, view: PlayerView) -> Call:
        raise InputError("a person's throw must be called by the person")


def rounded(throw: Throw) -> Throw:
    """Return the throw as stored."""
    return Throw(
        speed=max(round(throw.speed, DECIMALS), 10.0**-DECIMALS),
        angle=round(throw.angle, DECIMALS),
        spin=round(throw.spin, DECIMALS),
        x=round(throw.x, DECIMALS),
    )


def kept_throws(deliveries: Sequence[PlayedDelivery]) -> tuple[Throw, ...]:
    """Return the stored throws of deliveries."""
    return tuple(delivery.shot.call.throw for delivery in deliveries)
