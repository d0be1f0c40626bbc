"""Recorded game at one of its deliveries, as a game that continues from there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from curling_env.errors import InputError
from curling_env.game import GameSimulator, GameState
from curling_env.game.rules import End, RestingStone, RuleSet, Team, rule_set
from curling_env.game.rules.teams import STONES_PER_TEAM
from curling_env.ice import Ice
from curling_env.sheet import Direction, to_delivery
from curling_env.typing import Floats

GAP = 1e-4
"""Gap between two stones that were read as overlapping [m]."""
PUSHES = 50
"""Maximum number of times that all overlapping pairs are pushed apart."""


def rules_in(lines: Sequence[dict[str, Any]]) -> RuleSet:
    """Return the rules of a recorded game.

    Raises
    ------
    InputError : unknown rules
    """
    return rule_set(str(lines[0]["rules"]), ends=int(lines[0]["ends"]))


def state_before(
    lines: Sequence[dict[str, Any]],
    simulator: GameSimulator,
    end: int,
    stone: int,
    *,
    seed: int = 0,
) -> GameState:
    """Return the game before a delivery of a record.

    Parameters
    ----------
    lines : lines of the game, from `agents.playing.record.read_record`; stones that overlap or
        touch a line, by inaccurate positions or a wider sheet, are moved
    simulator : its rules must be those of `rules_in`
    end, stone : number of the end and of the delivery in it, from 1
    seed : seed of all randomness that follows

    Raises
    ------
    InputError : a delivery that the record does not have
    """
    found = [line for line in lines[1:-1] if (line["end"], line["stone"]) == (end, stone)]
    if not found:
        last = lines[-2] if len(lines) > 2 else {"end": 0, "stone": 0}
        problem = f"has no stone {stone} in end {end}"
        raise InputError(f"{problem}; its last is stone {last['stone']} in end {last['end']}")
    (line,) = found
    direction = Direction[str(line["direction"]).upper()]
    places = np.array([(lying["x"], lying["y"]) for lying in line["before"]], dtype=np.float64)
    places = playable(to_delivery(places.reshape(-1, 2), direction), simulator.ice)
    stones = tuple(
        RestingStone(
            Team[lying["team"].upper()], int(lying["stone"]) % STONES_PER_TEAM, float(x), float(y)
        )
        for lying, (x, y) in zip(line["before"], places, strict=True)
    )
    hammer = Team[line["hammer"].upper()]
    scores = lines[-1]["line_score"][: end - 1]
    played = [(one["end"], one["hammer"]) for one in lines[1:-1] if one["power_play"]]
    state = simulator.new_game(seed, last_stone=hammer)
    game = replace(
        state.game,
        end=End(
            number=end - 1,
            hammer=hammer,
            stones=stones,
            delivered=stone - 1,
            power_play=line["power_play"],
        ),
        line_score=tuple((int(home), int(away)) for home, away in scores),
        hammers=tuple(Team[team.upper()] for team in lines[-1]["hammers"][: end - 1]),
        last_stone=hammer,
        power_plays=tuple(
            dict.fromkeys(Team[team.upper()] for number, team in played if number <= end)
        ),
    )
    return replace(
        state, game=game, throws=sum(one["end"] < end for one in lines[1:-1]) + stone - 1
    )


def playable(places: Floats, ice: Ice) -> Floats:
    """Return places of stones without overlaps, between the side lines.

    Parameters
    ----------
    places : (n, 2) centres in the delivery frame [m]
    ice : sheet and stones
    """
    radius = ice.stone.radius
    edge = ice.sheet.width / 2 - radius - GAP
    places = places.copy()
    first, second = np.triu_indices(len(places), k=1)
    for _ in range(PUSHES):
        places[:, 0] = np.clip(places[:, 0], -edge, edge)
        distance = np.hypot(*(places[second] - places[first]).T)
        near = distance < 2 * radius + GAP / 2
        if not near.any():
            break
        for one, other in zip(first[near].tolist(), second[near].tolist(), strict=True):
            gap = places[other] - places[one]
            length = float(np.hypot(*gap))
            way = gap / length if length > 1e-9 else np.array([0.0, 1.0])
            push = max(2 * radius + GAP - length, 0.0) / 2
            places[one] -= push * way
            places[other] += push * way
    return places
