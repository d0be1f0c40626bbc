"""A team's preferences in its calls, in addition to the odds of the game."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from agents.playing.search.positions import MAX_POINTS, SCORES, SLOTS, EndSimulator
from agents.playing.search.shots import KINDS, Shots
from curling_env.errors import InputError
from curling_env.game import PlayerView
from curling_env.typing import Floats

CENTRE, CORNER = 0.35, 0.9
"""Bounds on the distance from the centre line: below for a centre guard, above for a corner guard
[m].
"""


@dataclass(frozen=True, kw_only=True)
class CallingStyle:
    """Preferences of a team in its calls, in addition to the odds.

    Parameters
    ----------
    blank_cost : reduction of a blank's value to the team with the hammer, in probability of
        winning; teams that want to score in every end do not play for a blank
    single_cost : the same for a single point, while that team does not lead; teams that want two
        prefer a blank, or risk a steal, to taking one
    blank_until : maximum number of ends left for which blanks and single points have no cost
    opening_guards : number of a team's first stones thrown as guards: centre guards without the
        hammer, corner guards with it
    open_with_lead : lead in points from which a team throws no guards
    for_points : value an end by points scored minus conceded, as in the rewards of `CurlingEnd-v0`,
        instead of by the game
    source : origin of the numbers

    Raises
    ------
    InputError : a cost outside −1 to 1, or a negative number of guards
    """

    blank_cost: float = 0.0
    single_cost: float = 0.0
    blank_until: int = 2
    opening_guards: int = 0
    open_with_lead: int = 2
    for_points: bool = False
    source: str = ""

    def __post_init__(self) -> None:
        for name in ("blank_cost", "single_cost"):
            cost = getattr(self, name)
            if not abs(cost) <= 1:
                raise InputError(f"{name} must be between -1 and 1, got {cost}")
        if self.opening_guards < 0:
            raise InputError(f"opening_guards must be at least 0, got {self.opening_guards}")

    def worth(self, by_score: Floats, lead: int, ends_left: int, *, with_hammer: bool) -> Floats:
        """Return the value of each of `SCORES` to the team with the hammer, (13,), 0 to 1.

        Parameters
        ----------
        by_score : (13,) its win probability after them
        lead : its lead before the end
        ends_left : scheduled ends that are not complete, with the current one
        with_hammer : true if the calling team has the hammer
        """
        if self.for_points:
            return 0.5 + SCORES / (2 * MAX_POINTS)
        if ends_left <= self.blank_until or not with_hammer:
            return by_score
        single = self.single_cost if lead <= 0 else 0.0
        return by_score - self.blank_cost * (SCORES == 0) - single * (SCORES == 1)

    def among(self, shots: Shots, view: PlayerView, simulator: EndSimulator) -> Shots:
        """Return the shots that the team considers; all, unless it opens with a guard.

        Parameters
        ----------
        shots : shots in the position of the view
        view : the game as the team sees it
        simulator : ice and rules, for the places of rest of guards
        """
        end = view.game.end
        if end is None or end.number_of_stone >= self.opening_guards:
            return shots
        if view.game.lead(view.team) >= self.open_with_lead:
            return shots
        guards = shots[shots.kind == KINDS.index("guard")]
        empty = np.full((len(guards), SLOTS, 2), np.nan)
        rests = simulator.play(empty, end.delivered, guards.throws)
        beside = np.abs(rests[:, simulator.slot(end.delivered), 0])
        wanted = guards[beside > CORNER if view.has_hammer else beside < CENTRE]
        return wanted if len(wanted) else shots


NEUTRAL_STYLE = CallingStyle()
"""Style of teams that only maximise the probability of winning."""
FOR_POINTS = CallingStyle(for_points=True)
"""Style of teams that only maximise points, whatever the score of the game."""
