"""One shot as on Digital Curling's server, its JSON in and out.

Law, contacts and rules are the project's own, by the preset `fcv1` and the set `digital_curling`;
the time steps are the server's (`steps`).
"""

from __future__ import annotations

from copy import deepcopy
from dataclasses import replace
from functools import lru_cache
from typing import Any, cast

import numpy as np

from agents.digital_curling.conversion import LAST_END, stones_of
from agents.digital_curling.messages import (
    HACK_TO_TEE,
    SPIN,
    TEAMS,
    ConcedeMessage,
    Move,
    SettingMessage,
    ShotMessage,
    SimulatorMessage,
    StateDocument,
    StateMessage,
)
from agents.digital_curling.steps import Rest, run_steps
from curling_env.errors import InputError
from curling_env.game.rules import RestingStone, Result, Team, rule_on, rule_set, score_of
from curling_env.game.rules.scoring import hammer_after
from curling_env.ice import Ice, load_ice
from curling_env.infrastructure.files.schema import checked
from curling_env.physics.state import State
from curling_env.sheet import HACK_Y, TEE_Y

STONES_PER_END = 16


def transition(
    state: StateDocument | dict[str, Any], move: dict[str, Any], setting: dict[str, Any]
) -> StateDocument:
    """Return the state after one noise-free shot, as Digital Curling's server (DC3) would send it.

    Parameters
    ----------
    state : the `state` of an `update`: positions in metres from the hack, angles in radians
    move : move as sent, ``{"type": "shot", "velocity": {"x", "y"}, "rotation"}`` in m/s, or
        ``{"type": "concede"}``. A shot that goes backwards is removed, an unknown rotation is
        played as ccw, and no speed is limited
    setting : the `game` of `is_ready` (its `setting` and `simulator` are read), or its `setting`

    Returns
    -------
    a new state; `state` is unchanged. Fields that a shot does not change, and unknown fields, are
    kept. No thinking time is used: a team that has none left has lost

    Raises
    ------
    InputError : the game is over, or a document that is not of the protocol

    Examples
    --------
    ::

        after = transition(update["state"], {"type": "shot", "velocity": {"x": 0.1, "y": 2.4},
                                             "rotation": "ccw"}, is_ready["game"])
    """
    before = checked(state, StateMessage, inside="state")
    game = checked(setting or {}, dict[str, Any], inside="setting")
    options = checked(game.get("setting", game) or {}, SettingMessage, inside="setting")
    simulator = checked(game.get("simulator") or {}, SimulatorMessage, inside="simulator")
    play = checked(move, cast("type[Move]", Move), inside="move")
    if before.game_result is not None or before.hammer is None:
        raise InputError("the game is over", where="state")
    if simulator.type != "fcv1":
        raise InputError(
            f"expected the simulator fcv1, found {simulator.type[:40]!r}", where="simulator.type"
        )
    known = min(len(before.scores.team0), len(before.scores.team1))
    ends = options.max_end or known
    if known < ends:
        raise InputError(f"expected the scores of {ends} ends, found {known}", where="state.scores")
    hammer = Team(TEAMS.index(before.hammer))
    team = hammer if before.shot % 2 else hammer.other
    out_of_time = before.thinking_time_remaining.get(TEAMS[team], 1.0) <= 0.0
    after = cast("dict[str, Any]", deepcopy(state))
    # The server throws the stone of this slot, even if one is already there.
    slot = before.shot // 2
    stones = tuple(s for s in stones_of(before) if (s.team, s.number) != (team, slot))
    given_up = out_of_time or isinstance(play, ConcedeMessage)
    if isinstance(play, ShotMessage) and not out_of_time:
        stones = _played(before, stones, team, play, options, simulator, after)
    if before.shot < STONES_PER_END - 1:
        after["shot"] = before.shot + 1
    else:
        _end(after, before, stones, hammer, ends, options)
    if given_up:
        after["hammer"] = None
        reason = "time_limit" if out_of_time else "concede"
        after["game_result"] = {"winner": TEAMS[team.other], "reason": reason}
    return cast("StateDocument", after)


def _played(
    before: StateMessage,
    stones: tuple[RestingStone, ...],
    team: Team,
    shot: ShotMessage,
    options: SettingMessage,
    simulator: SimulatorMessage,
    after: dict[str, Any],
) -> tuple[RestingStone, ...]:
    """Throw a stone, fill in the positions of the stones in `after`, and return those that stay."""
    slot = before.shot // 2
    rest = _thrown(before, stones, shot, options, simulator)
    rules = replace(
        rule_set("digital_curling"), free_guard_until=5 if options.five_rock_rule else 4
    )
    thrown = RestingStone(team, slot, 0.0, 0.0)
    places: list[RestingStone | None] = []
    for stone, state, gone, pushed in zip(
        (*stones, thrown), rest.stones.tolist(), rest.gone, rest.pushed, strict=True
    ):
        x, y = state[State.X], state[State.Y] - TEE_Y
        moved = RestingStone(stone.team, stone.number, x, y)
        places.append(None if gone else stone if not pushed and stone is not thrown else moved)
    ruling = rule_on(
        rules,
        rules.lines(width=options.sheet_width),
        stones,
        team,
        before.shot,
        Result(tuple(places), bool(rest.pushed[-1])),
    )
    kept = set(ruling.stones)
    for stone, place, state in zip((*stones, thrown), places, rest.stones.tolist(), strict=True):
        if stone in kept:
            continue  # unchanged
        entry = None
        if place in kept:
            position = {"x": state[State.X], "y": state[State.Y] + HACK_Y}
            entry = {"position": position, "angle": state[State.THETA]}
        after["stones"][TEAMS[stone.team]][stone.number] = entry
    return ruling.stones


@lru_cache(maxsize=8)
def fcv1_ice(sheet_width: float) -> Ice:
    """Return the ice of `fcv1` on a sheet of this width [m]."""
    ice = load_ice("fcv1")
    sheet = replace(ice.sheet, width=sheet_width)
    mu = float(ice.friction.mu[0, 0])
    return Ice.uniform(mu, sheet=sheet, stone=ice.stone, effects=ice.effects)


def _thrown(
    before: StateMessage,
    stones: tuple[RestingStone, ...],
    shot: ShotMessage,
    options: SettingMessage,
    simulator: SimulatorMessage,
) -> Rest:
    """Simulate a shot until all stones rest."""
    states = np.zeros((len(stones) + 1, 6))
    for state, stone in zip(states, stones, strict=False):
        message = before.stones.of(stone.team)[stone.number]
        assert message is not None
        place = message.position
        state[[State.X, State.Y]] = place.x, np.float32(place.y) - np.float32(HACK_Y)
        state[State.THETA] = message.angle
    states[-1, State.Y] = -HACK_Y
    states[-1, [State.VX, State.VY]] = shot.velocity.x, shot.velocity.y
    states[-1, State.OMEGA] = -SPIN if shot.rotation == "cw" else SPIN
    return run_steps(
        fcv1_ice(options.sheet_width), states, seconds_per_frame=simulator.seconds_per_frame
    )


def _as_measured(stones: tuple[RestingStone, ...], reach: float) -> tuple[RestingStone, ...]:
    """Return the stones in the house, at their single-precision distance from the tee."""
    found: list[RestingStone] = []
    for stone in stones:
        y = np.float32(stone.y + HACK_TO_TEE) - np.float32(HACK_Y) - np.float32(TEE_Y)
        x = np.float32(stone.x)
        distance = np.sqrt(x * x + y * y)
        if distance < np.float32(reach):
            found.append(stone._replace(x=float(distance), y=0.0))
    return tuple(found)


def _end(
    after: dict[str, Any],
    before: StateMessage,
    stones: tuple[RestingStone, ...],
    hammer: Team,
    ends: int,
    options: SettingMessage,
) -> None:
    """Score an end, and start the next one or end the game."""
    rules = rule_set("digital_curling", measure=0.0)
    lines = rules.lines(width=options.sheet_width)
    points = score_of(rules, lines, _as_measured(stones, lines.reach))
    if before.end < ends:
        for name, team_points in zip(TEAMS, points, strict=True):
            after["scores"][name][before.end] = team_points
    elif points != (0, 0):
        after["extra_end_score"] = dict(zip(TEAMS, points, strict=True))
    after["hammer"] = TEAMS[hammer_after(rules, hammer, points)]
    after["stones"] = {name: [None] * (STONES_PER_END // 2) for name in TEAMS}
    after["shot"] = 0
    after["end"] = before.end + 1
    if after["end"] < ends:
        return
    extra = after.get("extra_end_score") or {}
    totals = [sum(p or 0 for p in (*after["scores"][name], extra.get(name))) for name in TEAMS]
    if totals[0] != totals[1]:
        winner = TEAMS[totals[1] > totals[0]]
        after["hammer"], after["game_result"] = None, {"winner": winner, "reason": "score"}
    elif after["end"] >= LAST_END:
        after["hammer"], after["game_result"] = None, {"winner": None, "reason": "draw"}
    elif options.extra_end_thinking_time and "thinking_time_remaining" in after:
        after["thinking_time_remaining"] = dict(options.extra_end_thinking_time)
