"""Game as JSON lines: intended throws, executed throws, and every stone's path.

The first line names the players and the rules. A line for every delivery follows, and the last line
is the result. Positions and paths are in the sheet frame [m], times in seconds since the release.
Throws are written with all their digits, so that the same game can be replayed from them.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any, cast

import numpy as np

from agents.playing.match import PlayedDelivery, PlayedGame
from agents.playing.record_schema import check_lines
from curling_env.errors import InputError, placed
from curling_env.game import GameSimulator
from curling_env.game.rules import Game, Team
from curling_env.game.simulator import state_on_sheet
from curling_env.ice import preset_names
from curling_env.infrastructure.files import limits
from curling_env.infrastructure.files.reading import confined, parse_json, read_text
from curling_env.infrastructure.files.schema import FileFormat
from curling_env.infrastructure.files.storage import write_text
from curling_env.throw import Throw
from curling_env.trajectory import Trajectory

FORMAT = FileFormat(name="curling-game/1", what="a recorded game")
SAMPLE_STRIDE = 3
"""Interval of the written samples among a path's 30 samples a second."""


def lines_of(
    played: PlayedGame, simulator: GameSimulator, *, ice: str, seed: int
) -> list[dict[str, Any]]:
    """Return the lines of a game, each as a document.

    Parameters
    ----------
    played : the game, with paths
    simulator : simulator of the game
    ice : name or file of the ice
    seed : seed of the game
    """
    game = played.game
    first = played.deliveries[0].before.game if played.deliveries else game
    home, away = played.players
    head = head_line((home.name, away.name), first, simulator, ice=ice, seed=seed)
    return [head, *(delivery_line(d) for d in played.deliveries), result_of(game)]


def head_line(
    names: tuple[str, str], first: Game, simulator: GameSimulator, *, ice: str, seed: int
) -> dict[str, Any]:
    """Return the first line: players, rules and ice.

    Parameters
    ----------
    names : the players of home and away
    first : the game before its first delivery
    simulator, ice, seed : as in `lines_of`
    """
    return {
        "format": FORMAT.name,
        "home": names[Team.HOME],
        "away": names[Team.AWAY],
        "rules": first.rules.name,
        "ends": first.rules.ends,
        "ice": ice,
        "sheet": {"length": simulator.ice.sheet.length, "width": simulator.ice.sheet.width},
        "stone_radius": simulator.ice.stone.radius,
        "skill": [skill.name for skill in simulator.skills],
        "seed": seed,
        "last_stone": first.last_stone.label,
    }


def result_of(game: Game) -> dict[str, Any]:
    """Return the result of a game, as in the last line."""
    return {
        "line_score": [list(end) for end in game.line_score],
        "hammers": [team.label for team in game.hammers],
        "score": list(game.score),
        "winner": None if game.winner is None else game.winner.label,
        "conceded": None if game.conceded is None else game.conceded.label,
        "power_plays": [team.label for team in game.power_plays],
    }


def write_record(
    path: str | Path, played: PlayedGame, simulator: GameSimulator, *, ice: str, seed: int
) -> list[dict[str, Any]]:
    """Write a game, completely or not at all; see `lines_of`, which it returns."""
    lines = lines_of(played, simulator, ice=ice, seed=seed)
    write_lines(path, lines)
    return lines


def write_lines(path: str | Path, lines: Sequence[dict[str, Any]]) -> None:
    """Write the lines of a game, completely or not at all."""
    write_text(path, "\n".join(json.dumps(line, separators=(",", ":")) for line in lines) + "\n")


def read_record(path: str | Path) -> list[dict[str, Any]]:
    """Read the lines of a recorded game.

    Raises
    ------
    InputError : the file cannot be read, or is not a recorded game
    """
    lines: list[dict[str, Any]] = []
    for number, text in enumerate(read_text(path, most=limits.MAX_JSON_BYTES).split("\n"), start=1):
        if not text.strip():
            continue
        line = parse_json(text, source=path, where=f"line {number}")
        if not isinstance(line, dict):
            raise InputError("expected an object", source=path, where=f"line {number}")
        lines.append(cast("dict[str, Any]", line))
    with placed(source=path, where="line 1"):
        lines[:1] = [FORMAT.accept(lines[0] if lines else None)]
    if len(lines) < 2 or "line_score" not in lines[-1]:
        raise InputError("the game is incomplete: expected a result in its last line", source=path)
    with placed(source=path):
        check_lines(lines)
    return lines


def ice_of(lines: Sequence[dict[str, Any]], path: str | Path) -> str:
    """Load the ice that a record names: a preset, or a file below the folder of the record.

    Parameters
    ----------
    lines : lines of the game
    path : file of the record

    Raises
    ------
    InputError : a file elsewhere, which must be given on the command line
    """
    name = str(lines[0]["ice"])
    if name in preset_names():
        return name
    return str(confined(name, Path(path).absolute().parent, source=path))


def delivery_line(delivery: PlayedDelivery) -> dict[str, Any]:
    """Return the line of a delivery, with the paths of its stones."""
    before, shot, after = delivery
    end = before.game.end
    assert end is not None
    line: dict[str, Any] = {
        "end": shot.end + 1,
        "stone": shot.number + 1,
        "team": shot.team.label,
        "hammer": end.hammer.label,
        "direction": shot.direction.name.lower(),
        "power_play": end.power_play,
        "shot": shot.call.shot,
        "meant": _throw(shot.call.throw),
        "thrown": _throw(shot.thrown),
        "sweep": list(shot.sweep),
        "fault": None if shot.ruling.fault is None else shot.ruling.fault.value,
        "put_back": shot.put_back,
        "time": round(shot.outcome.time, 3),
        "before": lying_line(end.stones, shot.direction),
        "lying": lying_line(shot.stones_after, shot.direction),
        "paths": [
            {**_path(path), "status": shot.outcome.status[k].value}
            for k, path in zip(shot.outcome.moved, shot.outcome.trajectories, strict=False)
        ],
    }
    if after.game.end is None and after.game.line_score:
        line["score_of_end"] = list(after.game.line_score[-1])
    return line


def _throw(throw: Throw) -> dict[str, float]:
    return {"speed": throw.speed, "angle": throw.angle, "spin": throw.spin, "x": throw.x}


def lying_line(stones: Any, direction: Any) -> list[dict[str, Any]]:
    """Return resting stones, sheet frame, with all digits."""
    places = [(lying, state_on_sheet(lying, direction)) for lying in stones]
    return [
        {"stone": lying.stone, "team": lying.team.label, "x": place.x, "y": place.y}
        for lying, place in places
    ]


def _path(path: Trajectory) -> dict[str, Any]:
    keep = np.arange(len(path)) % SAMPLE_STRIDE == 0
    # The last sample is always kept, but not one before it that rounds to the same time.
    keep &= path.t < path.t[-1] - 2e-3
    keep[-1] = True
    return {
        "stone": path.stone,
        "t": np.round(path.t[keep], 3).tolist(),
        "x": np.round(path.xy[keep, 0], 3).tolist(),
        "y": np.round(path.xy[keep, 1], 3).tolist(),
        "theta": np.round(path.theta[keep], 2).tolist(),
    }
