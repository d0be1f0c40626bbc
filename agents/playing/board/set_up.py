"""Position placed by hand, as a game that continues from it."""

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
"""Maximum number of ends left in such a game: ten, and two to set the direction of play."""


@dataclass(frozen=True, kw_only=True)
class LaidStone:
    """Stone on the board.

    Parameters
    ----------
    x, y : its centre, sheet frame [m]
    team : its team
    """

    x: float
    y: float
    team: Team


@dataclass(frozen=True, kw_only=True)
class Position:
    """Position placed by hand.

    Parameters
    ----------
    stones : stones on the sheet
    direction : the end played to
    hammer : the team that delivers last
    delivered : number of stones delivered by both teams, including removed ones
    ends_left : ends to play, with this one
    score : points of home and away

    Raises
    ------
    InputError : an impossible score or number of ends
    """

    stones: tuple[LaidStone, ...] = ()
    direction: Direction = Direction.AWAY
    hammer: Team = Team.HOME
    delivered: int = 0
    ends_left: int = 1
    score: tuple[int, int] = (0, 0)

    def __post_init__(self) -> None:
        if not 1 <= self.ends_left <= MAX_ENDS_LEFT:
            raise InputError(f"expected 1 to {MAX_ENDS_LEFT} ends left, got {self.ends_left}")
        if min(self.score) < 0 or max(self.score) > 99:
            raise InputError(
                f"expected 0 to 99 points for each team, got {self.score[0]} : {self.score[1]}"
            )

    @property
    def ends_before(self) -> int:
        """Return the number of ends that count as played, so that this one has its direction of
        play.
        """
        return 2 if self.direction is Direction.AWAY else 1

    def rules(self, rules: RuleSet) -> RuleSet:
        """Return the rules of a game with these ends played and left."""
        return replace(rules, ends=self.ends_before + self.ends_left)


def set_up(simulator: GameSimulator, position: Position, *, seed: int = 0) -> GameState:
    """Make the game that continues from a position.

    Parameters
    ----------
    simulator : its rules must be those of `Position.rules`
    position : the position
    seed : seed of all randomness that follows

    Raises
    ------
    InputError : stones off the sheet, overlapping or out of play, more of a team's than it has
        delivered, or rules with placed stones
    """
    rules, lines = simulator.rules, simulator.lines
    if rules.placed_stones:
        raise InputError(f"{rules.name} places stones itself; expected rules of fours")
    if not 0 <= position.delivered < rules.deliveries:
        raise InputError(
            f"expected 0 to {rules.deliveries - 1} delivered stones, got {position.delivered}"
        )
    places = np.array([(stone.x, stone.y) for stone in position.stones], dtype=np.float64)
    places = places.reshape(-1, 2)
    check_stones(simulator.ice, places)
    there: Floats = to_delivery(places, position.direction)
    lying: list[RestingStone] = []
    for k, ((x, y), stone) in enumerate(zip(there.tolist(), position.stones, strict=True), start=1):
        if not (lines.on_sheet(x, y) and lines.past_hog_line(y)):
            raise InputError(
                f"stone {k} at ({stone.x:g}, {stone.y:g}) m is out of play: expected between the "
                "hog line, the back line and the side lines"
            )
        number = sum(other.team is stone.team for other in lying)
        lying.append(RestingStone(stone.team, number, x, y))
    for team in Team:
        last = team is position.hammer
        had = (position.delivered + (not last)) // 2
        lies = sum(stone.team is team for stone in lying)
        if lies > had:
            raise InputError(
                f"{lies} stones of the {team.label} team are on the sheet, but it has delivered "
                f"{had}"
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
