"""The best calls in a position that was laid out."""

from __future__ import annotations

from typing import Any

from agents.app.sheet.forms import CallsForm, rounded
from agents.app.sheet.plans import CLOUD
from agents.app.sheet.runs import call_document, throw_document
from agents.playing.board.advice import Advice, best_calls
from agents.playing.board.set_up import set_up
from agents.playing.search import SearchPlayer
from curling_env.game import GameSimulator, GameState
from curling_env.game.rules import rule_set
from curling_env.ice import Ice
from curling_env.sheet import Direction
from curling_env.throw import Skill

BUDGET = 8000
"""Throws that the search simulates: well under a second."""
RULES = "world_curling_2024"


def called(ice: Ice, skill: Skill, form: CallsForm) -> dict[str, Any]:
    """The best calls for the team to throw, with their chances.

    Parameters
    ----------
    ice, skill : the ice, and the hand that throws for both teams
    form : what was asked

    Raises
    ------
    InputError : a position that cannot be, or no throw that gets to the house
    """
    position = form.position.position
    simulator = GameSimulator(ice, rules=position.rules(rule_set(RULES)), skills=skill)
    state = set_up(simulator, position)
    return document(simulator, state)


def document(simulator: GameSimulator, state: GameState) -> dict[str, Any]:
    """The best calls in a game, as the page shows them."""
    view = simulator.view(state)
    calls = best_calls(simulator, state, player=SearchPlayer(BUDGET))
    left = simulator.rules.deliveries - (0 if state.game.end is None else state.game.end.delivered)
    return {
        "team": view.team.label,
        "to": view.direction.name.lower(),
        "last_stone": left == 1,
        "calls": [_one(call, view.direction) for call in calls],
    }


def _one(call: Advice, direction: Direction) -> dict[str, Any]:
    step = max(len(call.rests) // CLOUD, 1)
    return {
        "shot": call.shot,
        "throw": throw_document(call.throw),
        "call": call_document(call.description, call.throw, direction),
        "win": round(call.win_probability, 4),
        "win_error": round(call.standard_error, 4),
        "lies_shot": round(call.lies_shot, 3),
        "points": round(call.points, 2),
        "cloud": rounded(call.rests[::step], 2),
    }
