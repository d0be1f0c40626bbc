"""Games on Digital Curling's server: who won, and whether each shot ended as it does here.

    python scripts/digital_curling_games.py runs/dc/*

Each folder is one that `curling join -o` wrote. Told are games and points won, how much of its
clock the team used, and what `agents.digital_curling.transition` makes of every move that the
server told: a law or a rule that is read otherwise shows there.
"""

from __future__ import annotations

import argparse
import json
import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Any, cast

import numpy as np

from agents.digital_curling import transition
from agents.playing.tournament import wilson
from curling_env.errors import CurlingError, InputError

TEAMS = ("team0", "team1")
SAME = ("end", "shot", "hammer", "scores", "extra_end_score")
"""What is to be the same after a shot, beside the stones."""
MOVED = 1e-4
"""A stone that is further from its place was moved [m]."""


@dataclass
class Replay:
    """What was found when moves were played again."""

    moves: int = 0
    other: list[str] = field(default_factory=list[str])
    """Moves after which the stones in play, the score or the result differ."""
    apart: list[float] = field(default_factory=list[float])
    """How far stones that moved are from where the server has them [m]."""

    def add(self, game: dict[str, Any], before: dict[str, Any], after: dict[str, Any]) -> None:
        """Play a move again; `before` and `after` are the updates around it."""
        self.moves += 1
        old, told = before["state"], after["state"]
        played = transition(old, after["last_move"]["actual_move"], game)
        found = cast("dict[str, Any]", played)
        differs = [key for key in SAME if found[key] != told[key]]
        if _winner(found) != _winner(told):
            differs.append("result")
        for was, ours, theirs in zip(*map(list, map(_stones, (old, found, told))), strict=True):
            if (ours is None) != (theirs is None):
                differs.append("stones in play")
            elif theirs is not None and (was is None or math.dist(was, theirs) > MOVED):
                self.apart.append(math.dist(ours, theirs))
        if differs:
            self.other.append(f"end {old['end']}, shot {old['shot']}: {', '.join(differs)}")


def _stones(state: dict[str, Any]) -> Iterator[tuple[float, float] | None]:
    for team in TEAMS:
        for stone in state["stones"][team]:
            place = stone and stone["position"]
            yield place and (place["x"], place["y"])


def _winner(state: dict[str, Any]) -> str | None:
    return (state["game_result"] or {}).get("winner")


def lines_of(folder: Path) -> list[dict[str, Any]]:
    """Return the server's lines in a folder.

    Raises
    ------
    InputError : the folder has no log, or a line of it is no message
    """
    try:
        return read_log(folder / "wire.jsonl")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError("expected a folder that `curling join -o` wrote", source=folder) from error


def read_log(path: Path) -> list[dict[str, Any]]:
    """Return the server's lines of a log.

    Raises
    ------
    InputError : a line that is no message
    """
    log = path.read_text(encoding="utf-8").splitlines()
    return [
        _message(line[2:], path, row)
        for row, line in enumerate(log, start=1)
        if line.startswith("<")
    ]


def _message(text: str, path: Path, row: int) -> dict[str, Any]:
    try:
        message = json.loads(text)
    except ValueError:
        message = None
    if not isinstance(message, dict) or "cmd" not in message:
        raise InputError("expected a message of the server", source=path, where=f"line {row}")
    return cast("dict[str, Any]", message)


@dataclass
class Games:
    """Games on the server, and their moves played again.

    Parameters
    ----------
    replay : the moves
    won, games, broken : number of games won, played to the end, and broken off
    extra, clocks : number of games with an extra end, and not ended by score
    points : points of the team and of its opponents
    used : time used of the team's clock in each game [s]
    """

    replay: Replay = field(default_factory=Replay)
    won: int = 0
    games: int = 0
    broken: int = 0
    extra: int = 0
    clocks: int = 0
    points: list[int] = field(default_factory=lambda: [0, 0])
    used: list[float] = field(default_factory=list[float])

    def add(self, lines: list[dict[str, Any]]) -> None:
        """Count a game, and play its moves again."""
        ready = next((line for line in lines if line["cmd"] == "is_ready"), None)
        updates = [line for line in lines if line["cmd"] == "update"]
        if ready is None or not updates or updates[-1]["state"]["game_result"] is None:
            self.broken += 1
            return
        self.games += 1
        own = ready["team"]
        result, setting = updates[-1]["state"], ready["game"]["setting"]
        self.won += _winner(result) == own
        self.clocks += result["game_result"]["reason"] != "score"
        self.extra += result["end"] > setting["max_end"]
        for k, team in enumerate((own, TEAMS[own == "team0"])):
            ends = [*result["scores"][team], (result["extra_end_score"] or {}).get(team)]
            self.points[k] += sum(end or 0 for end in ends)
        regular = [u["state"] for u in updates if u["state"]["end"] < setting["max_end"]]
        left = min(state["thinking_time_remaining"][own] for state in regular)
        self.used.append(setting["thinking_time"][own] - left)
        for before, after in pairwise(updates):
            self.replay.add(ready["game"], before, after)

    def off(self) -> tuple[float, float, float]:
        """Return the distances of stones that moved from the server's: median, 99 %, max [mm]."""
        apart = self.replay.apart or [0.0]
        median, late, most = (1e3 * np.percentile(apart, (50, 99, 100))).tolist()
        return median, late, most


def told(folders: list[Path]) -> str:
    """Return what the games in these folders show.

    Raises
    ------
    InputError : a folder without a log, or no game that was played to its end
    """
    found = Games()
    for folder in folders:
        found.add(lines_of(folder))
    if not found.games:
        raise InputError("expected a game that was played to its end")
    low, high = wilson(found.won, found.games)
    median, late, most = found.off()
    replay, points, used = found.replay, found.points, found.used
    return "\n".join(
        [
            f"won {found.won} of {found.games} (95 %: {low:.0%} to {high:.0%}), {points[0]} : "
            f"{points[1]} points; {found.extra} with an extra end, {found.clocks} not ended by "
            f"score, {found.broken} broken off",
            f"of its clock the team used {np.median(used):.1f} s in the median, "
            f"{max(used):.1f} s at most",
            f"{len(replay.other)} of {replay.moves} moves end otherwise here; {len(replay.apart)} "
            f"stones that moved are {median:.2f} mm off in the median, {late:.1f} mm "
            f"at 99 %, {most:.1f} mm at most",
            *replay.other,
        ]
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("folders", type=Path, nargs="+", metavar="FOLDER")
    folders = parser.parse_args().folders
    try:
        print(told(folders))
    except CurlingError as error:
        parser.exit(2, f"digital_curling_games: {error}\n")


if __name__ == "__main__":
    main()
