"""A game against a player, throw by throw, and the best calls in a position."""

from __future__ import annotations

from typing import Any

from agents.app.sheet.forms import CallsForm, GameForm, rounded
from agents.app.sheet.throws import CLOUD, call_document, throw_document
from agents.playing.board.advice import Advice, best_calls
from agents.playing.board.kept_game import GameTable, kept_throws
from agents.playing.board.set_up import set_up
from agents.playing.match import PlayedDelivery
from agents.playing.record import delivery_line
from agents.playing.search import SearchPlayer
from curling_env.errors import InputError
from curling_env.game import GameSimulator, GameState
from curling_env.game.rules import Team, count, rule_set
from curling_env.game.rules.game import stones_left
from curling_env.game.simulator import direction_of, state_on_sheet
from curling_env.ice import Ice
from curling_env.sheet import Direction
from curling_env.throw import Skill

FAULTS = {
    "hog_line": "hogged: it did not reach the far hog line",
    "free_guard_zone": "a protected guard was put out too early: all stones are put back",
    "no_tick": "a guard on the centre line was ticked too early",
    "early_takeout": "a stone was put out too early: all stones are put back",
}
"""Rulings in words."""


def played(ice: Ice, skills: tuple[Skill, Skill], form: GameForm) -> dict[str, Any]:
    """Return the game up to now, with the person's next throw and the other player's answer.

    Parameters
    ----------
    ice : the ice
    skills : of the person and of the other player
    form : what was asked

    Raises
    ------
    InputError : a position or throws that cannot be, or a throw out of turn
    """
    table, deliveries, state = _play(ice, skills, form)
    shown = deliveries[form.since :]
    return {
        "throws": [[*throw_document(throw).values()] for throw in kept_throws(deliveries)],
        "deliveries": [_delivery(delivery) for delivery in shown],
        "state": state_document(table, state),
    }


def advised(ice: Ice, skills: tuple[Skill, Skill], form: GameForm) -> dict[str, Any]:
    """The best calls for the person at this point of a game.

    Raises
    ------
    InputError : as for `played`, or a game that is over
    """
    table, _, state = _play(ice, skills, form)
    return calls_document(table.simulator, table.begun(state))


def _play(
    ice: Ice, skills: tuple[Skill, Skill], form: GameForm
) -> tuple[GameTable, list[PlayedDelivery], GameState]:
    game = form.kept
    pair = skills if game.person is Team.HOME else (skills[1], skills[0])
    table = GameTable(game, ice, pair)
    deliveries: list[PlayedDelivery] = []
    state = table.start
    for k, delivery in enumerate(table.played(paths_from=form.since)):
        asked_now = form.throw is not None and k == len(game.throws) - 1
        if asked_now and delivery.shot.team is not game.person:
            raise InputError("it is not your turn to throw")
        deliveries.append(delivery)
        state = delivery.after
    for delivery in table.play_on(state):
        deliveries.append(delivery)
        state = delivery.after
    return table, deliveries, table.conceded(state)


def state_document(table: GameTable, state: GameState) -> dict[str, Any]:
    """Return the state of a game, for its scoreboard; stones in the sheet frame."""
    state = table.begun(state)
    game = state.game
    before = 0 if table.game.position is None else table.game.position.ends_before
    end = game.end
    number = len(game.line_score) - 1 if end is None else end.number
    direction = direction_of(number)
    stones = () if end is None else end.stones
    team, points = count(game.lines, stones)
    return {
        "score": list(game.score),
        "line_score": [list(points) for points in game.line_score[before:]],
        "start_score": list(table.game.position.score) if table.game.position else [0, 0],
        "end": number - before + 1,
        "ends": game.rules.ends - before,
        "extra": game.is_extra_end and end is not None,
        "to": direction.name.lower(),
        "hammer": (game.last_stone if end is None else end.hammer).label,
        "to_throw": None if end is None else end.to_throw.label,
        "delivered": 0 if end is None else end.delivered,
        "stones_left": [0, 0] if end is None else [stones_left(game.rules, end, t) for t in Team],
        "lies": None if team is None else {"team": team.label, "points": points},
        "over": game.is_over,
        "winner": None if game.winner is None else game.winner.label,
        "conceded": None if game.conceded is None else game.conceded.label,
        "rules": game.rules.title,
        "guards": "" if end is None else _guards(game.rules.free_guard_until, end.delivered),
        "stones": [
            {"x": place.x, "y": place.y, "team": lying.team.label, "stone": lying.stone}
            for lying, place in ((one, state_on_sheet(one, direction)) for one in stones)
        ],
    }


def _guards(until: int, delivered: int) -> str:
    if delivered >= until:
        return ""
    return f"Until {until} stones are thrown, no guard of the other team may be put out."


def _delivery(delivery: PlayedDelivery) -> dict[str, Any]:
    line = delivery_line(delivery)
    fault = line["fault"]
    put_back = delivery.shot.put_back
    ruling = None if fault is None else FAULTS.get(str(fault), str(fault).replace("_", " "))
    if ruling is not None and put_back:
        ruling = f"{ruling}; put back"
    return {**line, "ruling": ruling}


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
    return calls_document(simulator, state)


def calls_document(simulator: GameSimulator, state: GameState) -> dict[str, Any]:
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
