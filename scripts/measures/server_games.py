"""Games on Digital Curling's server: winners, and a comparison of each shot with this engine.

Every move that the server reported is played again by `agents.digital_curling.transition`.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Any

from agents.digital_curling import transition
from curling_env.errors import InputError

TEAMS = ("team0", "team1")
SAME = ("end", "shot", "hammer", "scores", "extra_end_score")
"""Parts of the state that must agree after a shot, in addition to the stones."""
MOVED = 1e-4
"""Distance from its place beyond which a stone counts as moved [m]."""


@dataclass
class Games:
    """Games on the server, and their moves played again.

    Parameters
    ----------
    won, games, broken : number of games won, played to the end, and broken off
    moves, other : number of moves, and of those after which the stones in play, the score or the
        result differ
    apart : distances of stones that moved from where the server has them [m]
    """

    won: int = 0
    games: int = 0
    broken: int = 0
    moves: int = 0
    other: int = 0
    apart: list[float] = field(default_factory=list[float])

    def add(self, log: Path) -> None:
        """Count the game of a log, and play its moves again.

        Raises
        ------
        InputError : a line that is no message of the server
        """
        lines = list(_messages(log))
        ready = next((line for line in lines if line["cmd"] == "is_ready"), None)
        updates = [line for line in lines if line["cmd"] == "update"]
        if ready is None or not updates or updates[-1]["state"]["game_result"] is None:
            self.broken += 1
            return
        self.games += 1
        self.won += _winner(updates[-1]["state"]) == ready["team"]
        for before, after in pairwise(updates):
            self._replay(ready["game"], before, after)

    def _replay(self, game: dict[str, Any], before: dict[str, Any], after: dict[str, Any]) -> None:
        """Play a move again; `before` and `after` are the updates around it."""
        self.moves += 1
        old, new = before["state"], after["state"]
        found: Any = transition(old, after["last_move"]["actual_move"], game)
        differs = any(found[key] != new[key] for key in SAME) or _winner(found) != _winner(new)
        for was, ours, theirs in zip(*map(_stones, (old, found, new)), strict=True):
            if (ours is None) != (theirs is None):
                differs = True
            elif theirs is not None and (was is None or math.dist(was, theirs) > MOVED):
                self.apart.append(math.dist(ours, theirs))
        self.other += differs


def _messages(log: Path) -> Iterator[dict[str, Any]]:
    for row, line in enumerate(log.read_text(encoding="utf-8").splitlines(), start=1):
        if not line.startswith("<"):
            continue
        try:
            message = json.loads(line[2:])
        except ValueError:
            message = None
        if not isinstance(message, dict) or "cmd" not in message:
            raise InputError("expected a message of the server", source=log, where=f"line {row}")
        yield message


def _stones(state: dict[str, Any]) -> list[Any]:
    places = [stone and stone["position"] for team in TEAMS for stone in state["stones"][team]]
    return [place and (place["x"], place["y"]) for place in places]


def _winner(state: dict[str, Any]) -> str | None:
    return (state["game_result"] or {}).get("winner")
