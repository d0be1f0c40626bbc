"""Games on disk, one line for each, so that long runs can be stopped and taken up again."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from dataclasses import asdict
from hashlib import sha256
from math import isfinite
from pathlib import Path
from typing import Any

from agents.playing.ends.play import Conditions, GameRecord, play_games
from curling_env.errors import InputError
from curling_env.ice import ice_document, load_ice
from curling_env.throw import skill_named
from curling_env.typing import Progress, no_progress


def conditions_document(conditions: Conditions) -> dict[str, Any]:
    """All that the games follow from beside their seeds, for JSON; the ice by its digest too."""
    skill = skill_named(conditions.skill)
    ice = json.dumps(ice_document(load_ice(conditions.ice)), sort_keys=True)
    return {
        "ice": conditions.ice,
        "ice_digest": sha256(ice.encode()).hexdigest()[:16],
        "rules": conditions.rules,
        "ends": conditions.ends,
        "free_guard_until": conditions.free_guard_until,
        "no_tick": conditions.no_tick,
        "skill": asdict(skill) | {"tails": skill.tails if isfinite(skill.tails) else None},
        "budget": conditions.budget,
        "judgement": asdict(conditions.judgement),
        "calls": asdict(conditions.calls),
        "evolution": asdict(conditions.evolution),
        "sweeping": conditions.sweeping,
        "hit_factor": conditions.hit_factor,
        "turn_factor": conditions.turn_factor,
    }


def played_games(
    path: Path,
    conditions: Conditions,
    seeds: Sequence[int],
    *,
    workers: int | str = 1,
    progress: Progress = no_progress,
) -> list[GameRecord]:
    """The games of some seeds; those that the file lacks are played and added to it.

    Parameters
    ----------
    path : file of the games; it is made, or added to game by game
    conditions : who plays on what
    seeds : seeds of the games
    workers, progress : see `play_games`

    Raises
    ------
    InputError : a file of games under other conditions
    """
    head = {"conditions": conditions_document(conditions)}
    whole = [*_lines(path)]
    if whole and json.loads(whole[0]) != json.loads(json.dumps(head)):
        raise InputError("holds games that were played under other conditions", source=path)
    known = {game.seed: game for game in map(GameRecord.from_line, whole[1:])}
    path.parent.mkdir(parents=True, exist_ok=True)
    # A line that was cut off by an interruption is written anew.
    path.write_text("".join(whole) or json.dumps(head) + "\n", encoding="utf-8")
    missing = [seed for seed in seeds if seed not in known]
    with path.open("a", encoding="utf-8") as file:
        for game in play_games(conditions, missing, workers=workers, progress=progress):
            file.write(json.dumps(game.as_dict()) + "\n")
            file.flush()
            known[game.seed] = game
    return [known[seed] for seed in seeds]


def games_in(path: Path) -> list[GameRecord]:
    """The complete games of a file.

    Raises
    ------
    InputError : a file that holds no games
    """
    lines = [*_lines(path)]
    if not lines:
        raise InputError("holds no games", source=path)
    return [GameRecord.from_line(line) for line in lines[1:]]


def _lines(path: Path) -> Iterator[str]:
    """The complete lines of a file; none where there is no file."""
    if path.exists():
        with path.open(encoding="utf-8") as file:
            yield from (line for line in file if line.endswith("\n"))
