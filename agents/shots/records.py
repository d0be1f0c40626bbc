"""Games of a table of shots as recorded games, see `agents.playing.drawn_record`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from agents.playing.drawn_record import drawn_lines
from agents.playing.record import write_lines
from agents.shots.table import RULES, GameKey, ShotTable, TableGame
from curling_env.errors import InputError
from curling_env.infrastructure.files.storage import write_json
from curling_env.infrastructure.files.writing import together
from curling_env.typing import Progress, no_progress

REPORT = "report.json"
"""Name of the file of faults beside the recorded games."""


def record_of(game: TableGame, *, ice: str = "standard") -> list[dict[str, Any]]:
    """Return the lines of a game of a table.

    Parameters
    ----------
    game : the game
    ice : preset on which the delivered stones are drawn
    """
    ends = [end for end in game.ends if end.shots]
    more = {"source": f"game {name_of(game.key)} of a table of shots"}
    return drawn_lines(game.names, RULES, ends, ice=ice, conceded=game.conceded, more=more)


def name_of(key: GameKey) -> str:
    """Return the name of a game in files: competition-session-game."""
    return "-".join(map(str, key))


def chosen_games(table: ShotTable, names: list[str] | None, source: str | Path) -> list[TableGame]:
    """Return the games of these names; all without names.

    Raises
    ------
    InputError : a name that no game of the table has
    """
    known = {name_of(game.key): game for game in table.games}
    unknown = [name for name in names or () if name not in known]
    if unknown:
        first = next(iter(known), "none")
        problem = f"has no game {unknown[0][:40]!r}; expected competition-session-game: {first}"
        raise InputError(problem, source=source)
    return [known[name] for name in names] if names else list(table.games)


def write_records(
    folder: Path, table: ShotTable, games: list[TableGame], *, progress: Progress = no_progress
) -> dict[str, Any]:
    """Write a recorded game for each game, and the report, which is returned.

    Parameters
    ----------
    folder : an existing folder
    table : all of the table, whose faults are reported
    games : the games to write
    progress : called after every game
    """
    report = report_of(table)
    with together():
        for k, game in enumerate(games):
            write_lines(folder / f"{name_of(game.key)}.jsonl", record_of(game))
            progress("converting", k + 1, len(games))
        write_json(folder / REPORT, report)
    return report


def report_of(table: ShotTable) -> dict[str, Any]:
    """Return the faults of a table by row, and the ends whose stones contradict the score, by
    kind.
    """
    odd = [end for end in table.ends if not end.agrees]
    kinds: dict[str, int] = {}
    for end in odd:
        kinds[end.kind] = kinds.get(end.kind, 0) + 1
    by_size = [
        end
        for end in table.ends
        if end.score is not None and abs(end.counted) == abs(end.score[0] - end.score[1])
    ]
    return {
        "games": len(table.games),
        "ends": len(table.ends),
        "shots": sum(len(end.shots) for end in table.ends),
        "ends_not_scored": sum(end.score is None for end in table.ends),
        "ends_as_written": len(table.ends) - len(odd),
        "ends_as_written_but_for_the_team": len(by_size)
        + sum(end.score is None for end in table.ends),
        "ends_not_as_written": [{"kind": kind, "ends": count} for kind, count in kinds.items()],
        "faults": [
            {"file": fault.file, "row": fault.row, "problem": fault.problem}
            for fault in table.faults
        ],
    }
