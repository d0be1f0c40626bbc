"""A position laid out by hand, as a game that goes on from it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from agents.planning.request import check_stones
from curling_env.errors import InputError
from curling_env.game import GameSimulator, GameState
from curling_env.game.rules import End, RestingStone, Team
from curling_env.game.rules.rulesets import RuleSet
from curling_env.sheet import Direction, to_delivery
from curling_env.typing import Floats

MAX_ENDS_LEFT = 12
"""Most ends that a laid-out game may still have: ten, and two for which end is played to."""


@dataclass(frozen=True, kw_only=True)
class LaidStone:
    """A stone on the board.

    Parameters
    ----------
    x, y : its centre, sheet frame [m]
    team : the team it belongs to
    """

    x: float
    y: float
    team: Team


@dataclass(frozen=True, kw_only=True)
class Position:
    """A position laid out by hand.

    Parameters
    ----------
    stones : stones on the sheet
    direction : the end played to
    hammer : the team that delivers last
    delivered : stones delivered so far by both teams, with those that are gone
    ends_left : ends to play, with this one
    score : points of home and away so far

    Raises
    ------
    InputError : a score, or a number of ends, that no game has
    """

    stones: tuple[LaidStone, ...] = ()
    direction: Direction = Direction.AWAY
    hammer: Team = Team.HOME
    delivered: int = 0
    ends_left: int = 1
    score: tuple[int, int] = (0, 0)

    def __post_init__(self) -> None:
        if not 1 <= self.ends_left <= MAX_ENDS_LEFT:
            raise InputError(f"1 to {MAX_ENDS_LEFT} ends are left, got {self.ends_left}")
        if min(self.score) < 0 or max(self.score) > 99:
            raise InputError(f"a team has 0 to 99 points, got {self.score[0]} : {self.score[1]}")

    @property
    def ends_before(self) -> int:
        """Ends that count as played, so that this one is played to its end of the sheet."""
        return 2 if self.direction is Direction.AWAY else 1

    def rules(self, rules: RuleSet) -> RuleSet:
        """The rules of a game that has as many ends as are left after those before."""
        return replace(rules, ends=self.ends_before + self.ends_left)


def set_up(simulator: GameSimulator, position: Position, *, seed: int = 0) -> GameState:
    """The game that goes on from a position.

    Parameters
    ----------
    simulator : its rules must be those of `Position.rules`
    position : the position
    seed : seed of everything random that follows

    Raises
    ------
    InputError : stones off the sheet, in each other or out of play, more of a team's than it has
        delivered, or rules that place stones of their own
    """
    rules, lines = simulator.rules, simulator.lines
    if rules.placed_stones:
        raise InputError(f"{rules.name} places stones itself: lay positions out for fours")
    if not 0 <= position.delivered < rules.deliveries:
        raise InputError(
            f"0 to {rules.deliveries - 1} stones were delivered, got {position.delivered}"
        )
    places = np.array([(stone.x, stone.y) for stone in position.stones], dtype=np.float64)
    places = places.reshape(-1, 2)
    check_stones(simulator.ice, places)
    there: Floats = to_delivery(places, position.direction)
    lying: list[RestingStone] = []
    for k, ((x, y), stone) in enumerate(zip(there.tolist(), position.stones, strict=True), start=1):
        if not (lines.on_sheet(x, y) and lines.past_hog_line(y)):
            raise InputError(
                f"stone {k} at ({stone.x:g}, {stone.y:g}) m is out of play: a stone lies between "
                "the hog line, the back line and the side lines"
            )
        number = sum(other.team is stone.team for other in lying)
        lying.append(RestingStone(stone.team, number, x, y))
    for team in Team:
        last = team is position.hammer
        had = (position.delivered + (not last)) // 2
        lies = sum(stone.team is team for stone in lying)
        if lies > had:
            raise InputError(
                f"{lies} stones of the {team.label} team lie there, and it has delivered {had}"
            )
    before = position.ends_before
    state = simulator.new_game(seed, last_stone=position.hammer)
    end = End(
        number=before,
        hammer=position.hammer,
        stones=tuple(lying),
        delivered=position.delivered,
    )
    scores = ((position.score[0], position.score[1]), *[(0, 0)] * (before - 1))
    game = replace(
        state.game, end=end, line_score=scores, hammers=(position.hammer.other,) * before
    )
    return replace(state, game=game)
