"""Exact conversion of positions, moves and players between Digital Curling and this project.

The origin of the protocol is the hack of the delivery, that of the delivery frame the far tee;
their axes agree. `ccw` is a positive spin. Team 0 is the home team; team 1, the away team, has the
hammer in the first end. Slot k of a team is its k-th delivery of the end.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from agents.digital_curling.conversation import PlayerMessage
from agents.digital_curling.messages import (
    HACK_TO_TEE,
    SPIN,
    TEAMS,
    DoublesMessage,
    Point,
    SettingMessage,
    ShotMessage,
    StateDocument,
    StateMessage,
)
from curling_env.errors import InputError
from curling_env.game.rules import End, Game, Lines, RestingStone, RuleSet, Team, rule_set
from curling_env.game.rules.scoring import hammer_after
from curling_env.game.rules.teams import STONES_PER_TEAM, Stones
from curling_env.throw import MAX_SPEED, Skill, Throw

LAST_END = 255
"""End after which a tied game is a draw."""
STONES_OF_DOUBLES = 5
"""Number of stones that a team delivers in an end of mixed doubles; the placed one has the next
number.
"""
DEFAULT_ENDS = 8
"""Number of ends of a game if the server sends none."""
FIRST_HAMMER = Team.AWAY
"""Team with the hammer in the first end."""


def rules_of(
    setting: SettingMessage,
    ends: int | None = None,
    *,
    name: str = "digital_curling",
    arrangement: int = 0,
) -> RuleSet:
    """Return the rules of a game.

    Parameters
    ----------
    setting : setting from the server
    ends : number of scheduled ends if it sends none
    name : name of the set of rules
    arrangement : arrangement of the placed stones, in mixed doubles

    Raises
    ------
    InputError : a game of more ends than supported
    """
    ends = setting.max_end or ends or DEFAULT_ENDS
    rules = rule_set(name, ends=ends, max_extra_ends=LAST_END - ends)
    if rules.placed_stones:
        return rule_set(rules, arrangement=arrangement)
    return rule_set(rules, free_guard_until=5 if setting.five_rock_rule else 4)


def stones_of(state: StateMessage) -> Stones:
    """Return the stones on the sheet in the order of their delivery, delivery frame."""
    hammer = TEAMS.index(state.hammer) if state.hammer is not None else FIRST_HAMMER
    found = [
        RestingStone(Team(k), slot, stone.position.x, stone.position.y - HACK_TO_TEE)
        for k in range(2)
        for slot, stone in enumerate(state.stones.of(k))
        if stone is not None
    ]
    placed = STONES_OF_DOUBLES if isinstance(state, DoublesMessage) else None

    def order(stone: RestingStone) -> tuple[bool, int, bool]:
        return stone.number != placed, stone.number, stone.team == hammer

    return tuple(sorted(found, key=order))


def game_of(state: StateMessage, rules: RuleSet, lines: Lines) -> Game:
    """Return the game in a state.

    Extra ends that were blank are not counted in the protocol; here they are ends like any other.

    Parameters
    ----------
    state : state of an `update`
    rules, lines : rules and lines of the game

    Raises
    ------
    InputError : an impossible state
    """
    scores = (state.scores.team0, state.scores.team1)
    if min(map(len, scores)) < min(state.end, rules.ends):
        raise InputError(
            f"expected the scores of {min(state.end, rules.ends)} ends", where="state.scores"
        )
    line_score = [(_points(scores[0], k), _points(scores[1], k)) for k in range(state.end)]
    extra = state.extra_end_score
    if extra is not None and extra.scored and state.end > rules.ends:
        line_score[-1] = extra.team0 or 0, extra.team1 or 0
    hammers, hammer = [], FIRST_HAMMER
    for score in line_score:
        hammers.append(hammer)
        hammer = hammer_after(rules, hammer, score)
    if state.hammer is not None:
        hammer = Team(TEAMS.index(state.hammer))
    doubles = state if isinstance(state, DoublesMessage) else None
    end, conceded, result = None, None, state.game_result
    if result is None and (doubles is None or doubles.is_placed):
        end = End(
            number=state.end,
            hammer=hammer,
            stones=stones_of(state),
            delivered=state.shot,
            power_play=None if doubles is None else doubles.side,
        )
    elif result is None:
        pass  # between two ends
    elif result.reason != "score" and result.winner is not None:
        conceded = Team(TEAMS.index(result.winner)).other
    return Game(
        rules=rules,
        lines=lines,
        end=end,
        line_score=tuple(line_score),
        hammers=tuple(hammers),
        last_stone=hammer if doubles is None else Team(TEAMS.index(doubles.decides)),
        power_plays=()
        if doubles is None
        else tuple(Team(TEAMS.index(team)) for team in doubles.power_plays),
        conceded=conceded,
    )


def _points(scores: list[int | None], end: int) -> int:
    """Return the points of a team in an end; 0 if none are noted, as in a blank extra end."""
    return (scores[end] if end < len(scores) else None) or 0


def state_of(
    game: Game,
    *,
    headings: Mapping[int, float] | None = None,
    clock: tuple[float, float] | None = None,
    reason: str = "score",
) -> StateDocument:
    """Return the state of a game, as in an `update`.

    Parameters
    ----------
    game : a game with an end in play, one between two ends, or one that is over
    headings : headings of the handles by identifier of the stone [rad]
    clock : remaining thinking time of both teams [s]
    reason : reason for the end of the game, if it is over: `score`, `concede`, `time_limit`, `draw`
    """
    ends, over = game.rules.ends, game.is_over
    played = game.line_score
    extra = next((end for end in played[ends:] if end != (0, 0)), (None, None))
    state: StateDocument = {
        "end": len(played) if game.end is None else game.end.number,
        "shot": 0 if game.end is None else game.end.delivered,
        "hammer": None if game.end is None else TEAMS[game.end.hammer],
        "stones": slots_of(() if game.end is None else game.end.stones, headings or {}),
        "scores": {
            name: [played[k][team] if k < len(played) else None for k in range(ends)]
            for team, name in enumerate(TEAMS)
        },
        "extra_end_score": dict(zip(TEAMS, extra, strict=True)),
        "game_result": None,
    }
    if clock is not None:
        state["thinking_time_remaining"] = dict(zip(TEAMS, clock, strict=True))
    if over:
        winner = None if game.winner is None else TEAMS[game.winner]
        state["game_result"] = {"winner": winner, "reason": reason if winner else "draw"}
    return state


def slots_of(
    stones: Stones, headings: Mapping[int, float]
) -> dict[str, list[dict[str, Any] | None]]:
    """Return resting stones by team and slot, as in the protocol.

    Parameters
    ----------
    stones : stones, delivery frame
    headings : headings of the handles by identifier of the stone [rad]
    """
    slots: dict[str, list[dict[str, Any] | None]] = {
        name: [None] * STONES_PER_TEAM for name in TEAMS
    }
    for stone in stones:
        angle = headings.get(stone.stone, 0.0)
        slots[TEAMS[stone.team]][stone.number] = stone_on_the_wire(stone.x, stone.y, angle)
    return slots


def stone_on_the_wire(x: float, y: float, angle: float) -> dict[str, Any]:
    """Return a stone of the protocol at a place of the delivery frame, its handle turned by `angle`
    [rad].
    """
    return {"angle": float(angle), "position": {"x": float(x), "y": float(y) + HACK_TO_TEE}}


def throw_of(shot: ShotMessage) -> Throw | None:
    """Return the throw of a shot; None for one that goes backwards, whose stone is removed."""
    x, y = shot.velocity.x, shot.velocity.y
    angle = math.atan2(-x, y)
    if y <= 0 or abs(angle) >= math.pi / 2:
        return None
    spin = -SPIN if shot.rotation == "cw" else SPIN
    return Throw(speed=min(math.hypot(x, y), MAX_SPEED), angle=angle, spin=spin)


def move_of(throw: Throw) -> ShotMessage:
    """Return the shot of a throw from the hack; only the sign of its spin counts."""
    velocity = Point(-throw.speed * math.sin(throw.angle), throw.speed * math.cos(throw.angle))
    return ShotMessage(velocity=velocity, rotation="cw" if throw.spin < 0 else "ccw")


def skill_of(player: PlayerMessage | None) -> Skill:
    """Return the skill of a player; exact if it is not disclosed."""
    if player is None or player.type == "identical":
        return Skill(name="none")
    return Skill(name=player.type, sigma_speed=player.stddev_speed, sigma_angle=player.stddev_angle)
