"""Logs of Digital Curling as recorded games.

A ``.dcl2`` of version 3, which `curling host` writes too, has the server's messages: positions and
throws are those of the log. A ``.dcl`` of version 2 has positions before every shot and velocities
in that program's physics, which cannot be used here: its throws and paths are drawn, see
`agents.playing.drawn_record`.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Any, cast

from agents.digital_curling.client import Client
from agents.digital_curling.conversation import IsReady, NewGame, Update, from_server, write_line
from agents.digital_curling.game_record import record_of
from agents.playing.drawn_record import PlacedEnd, PlacedShot, drawn_lines
from curling_env.errors import InputError, placed
from curling_env.game.opponents import DrawPlayer
from curling_env.game.rules import RestingStone, Team, rule_set, score_of
from curling_env.game.rules.teams import Stones
from curling_env.infrastructure.files import limits
from curling_env.infrastructure.files.reading import parse_json, read_text

TEE = (2.375, 4.88)
"""Position of the tee in version 2; y grows against the direction of play [m]."""
STONES = 16
_LEFT = "1"
"""Third number of a shot in version 2 whose stone curls to the left, counter-clockwise."""


@dataclass(frozen=True, kw_only=True)
class LogOfGame:
    """Game of a log.

    Parameters
    ----------
    lines : lines of its recorded game
    faults : places at which the log contradicts itself, each with its line
    """

    lines: list[dict[str, Any]]
    faults: list[str] = field(default_factory=list[str])


def is_log(path: str | Path) -> bool:
    """Return whether a name is that of a log of Digital Curling, version 2 or 3."""
    return Path(path).suffix.lower() in (".dcl", ".dcl2")


def read_log(path: str | Path) -> LogOfGame:
    """Read the game of a log, by the suffix of its name.

    Raises
    ------
    InputError : a line that is invalid in such a log, or a log without a shot
    """
    newer = Path(path).suffix.lower() == ".dcl2"
    return LogOfGame(lines=_version_3(path)) if newer else _version_2(path)


# --- version 3 ---------------------------------------------------------------------------------


def _version_3(path: str | Path) -> list[dict[str, Any]]:
    client = Client(DrawPlayer())
    for number, text in enumerate(
        read_text(path, most=limits.MAX_JSON_BYTES).splitlines(), start=1
    ):
        if not text.strip():
            continue
        entry: Any = parse_json(text, source=path, where=f"line {number}")
        if not isinstance(entry, dict) or "tag" not in entry:
            problem = "expected an entry of a log of Digital Curling, with a tag"
            raise InputError(problem, source=path, where=f"line {number}")
        message: Any = cast("dict[str, Any]", entry).get("log")
        if not isinstance(message, dict):
            continue
        document = cast("dict[str, Any]", message)
        if document.get("cmd") not in ("is_ready", "new_game", "update"):
            continue
        if document["cmd"] == "is_ready":  # a log has it once, for both teams
            document = {**document, "team": "team0"}
        with placed(source=path, where=f"line {number}"):
            match from_server(write_line(document).strip()):
                case Update() as update:
                    client.see(update)
                case IsReady() | NewGame() as line:
                    client.answer(line)
                case _:
                    pass
    if not client.seen:
        raise InputError("contains no shot of a game", source=path)
    with placed(source=path):
        return record_of(client, ice="fcv1")


# --- version 2 ---------------------------------------------------------------------------------


@dataclass
class _Section:
    """Numbered section: the position, and the shot that follows."""

    line: int
    values: dict[str, list[str]] = field(default_factory=dict[str, list[str]])


def _version_2(path: str | Path) -> LogOfGame:
    about, sections = _sections(path)
    names = (about.get("First", "First"), about.get("Second", "Second"))
    faults: list[str] = []
    ends: list[PlacedEnd] = []
    for end in _ends(sections):
        first = _team(end[0], path)
        ends.append(_end(end, first, path, faults))
    if not ends:
        raise InputError("contains no shot of a game", source=path)
    rules = rule_set("digital_curling", ends=max(len(ends), 1), free_guard_until=4)
    more = {"source": "a log of Digital Curling 2"}
    lines = drawn_lines(names, rules, ends, ice="fcv1", more=more)
    return LogOfGame(lines=lines, faults=faults)


def _sections(path: str | Path) -> tuple[dict[str, str], list[_Section]]:
    """Return the entries on the game, and the numbered sections."""
    about: dict[str, str] = {}
    sections: list[_Section] = []
    numbered = False
    for number, line in enumerate(read_text(path).splitlines(), start=1):
        heading = re.fullmatch(r"\[(\w+)\]", line.strip())
        if heading is not None:
            numbered = heading[1].isdigit()
            if numbered:
                sections.append(_Section(number))
        elif numbered:
            words = re.split(r"[=\s]+", line.strip())
            sections[-1].values[words[0]] = [word for word in words[1:] if word != words[0]]
        elif "=" in line:
            name, _, value = line.partition("=")
            about[name.strip()] = value.strip()
    return about, sections


def _ends(sections: list[_Section]) -> Iterator[list[_Section]]:
    """Return the sections of each end, the last of which has the position after it."""
    own: list[_Section] = []
    for section in sections:
        own.append(section)
        if "SETSTATE" not in section.values:
            yield own
            own = []
    if len(own) > 1:  # an interrupted game
        yield own


def _end(sections: list[_Section], first: Team, path: str | Path, faults: list[str]) -> PlacedEnd:
    """Return an end from its sections; the team `first` delivers first."""
    shots: list[PlacedShot] = []
    for k, (section, after) in enumerate(pairwise(sections)):
        team = _team(section, path)
        if team is not (first if k % 2 == 0 else first.other):
            raise InputError(
                f"stone {k + 1} has the team of the stone before it; expected alternating teams",
                source=path,
                where=f"line {section.line}",
            )
        run = section.values.get("RUNSHOT", [])
        shots.append(
            PlacedShot(
                team=team,
                number=k,
                after=_stones(after, first, path),
                spin=1.0 if run[2:3] == [_LEFT] else -1.0,
                task=" ".join(section.values.get("SHOTNAME", [])).lower().replace("notdefined", ""),
            )
        )
    score = None
    last = sections[-1]
    if "SCORE" in last.values:
        points = int(_number(last, "SCORE", 0, path))
        score = max(points, 0), max(-points, 0)
        counted = score_of(_RULES, _RULES.lines(), _stones(last, first, path))
        if counted != score:
            faults.append(
                f"line {last.line}: the stones count {counted[0]} : {counted[1]}, SCORE is {points}"
            )
    return PlacedEnd(hammer=first.other, shots=shots, score=score)


_RULES = rule_set("digital_curling")


def _stones(section: _Section, first: Team, path: str | Path) -> Stones:
    """Return the stones of a section, in order of delivery; delivery frame."""
    count = len(section.values.get("POSITION", ()))
    if count != 2 * STONES:
        raise InputError(
            f"POSITION has {count} numbers, expected {2 * STONES}",
            source=path,
            where=f"line {section.line}",
        )
    found: list[RestingStone] = []
    for k in range(STONES):
        x, y = (_number(section, "POSITION", 2 * k + axis, path) for axis in (0, 1))
        if x or y:
            team = first if k % 2 == 0 else first.other
            found.append(RestingStone(team, k // 2, x - TEE[0], TEE[1] - y))
    return tuple(found)


def _team(section: _Section, path: str | Path) -> Team:
    """Return the team that delivers; home is the one named First."""
    return Team(int(_number(section, "SETSTATE", 3, path)) % 2)


def _number(section: _Section, name: str, index: int, path: str | Path) -> float:
    values = section.values.get(name, [])
    text = values[index] if index < len(values) else "nothing"
    try:
        number = float(text)
    except ValueError:
        number = float("nan")
    if not abs(number) < 1e4:
        raise InputError(
            f"{name} is {text[:20]!r}, expected a number", source=path, where=f"line {section.line}"
        )
    return number
