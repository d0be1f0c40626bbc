"""Schema of the lines of a recorded game, so that every record that is read can be played."""

from __future__ import annotations

from typing import Annotated, Any, Literal

import msgspec
from msgspec import Meta

from curling_env.errors import InputError
from curling_env.game.rules.delivery import Fault
from curling_env.infrastructure.files.schema import Short, Text, checked, within
from curling_env.physics.engine import Status

Place = Annotated[float, within(-1e3, 1e3, "m")]
Seconds = Annotated[float, within(0.0, 600.0, "s")]
"""Time in a delivery: the slowest stone is at rest after a minute and a half."""
Heading = Annotated[float, within(-1e6, 1e6, "rad")]
StoneNumber = Annotated[int, Meta(ge=0, le=63)]
Count = Annotated[int, Meta(ge=0, le=1000)]
TeamName = Literal["home", "away"]
Points = Annotated[int, Meta(ge=0, le=1000)]
EndScore = tuple[Points, Points]
MAX_SAMPLES = 20_000
"""Maximum number of samples of one path."""


class SheetLine(msgspec.Struct, kw_only=True):
    """Size of the ice."""

    length: Annotated[float, within(38.0, 500.0, "m")]
    width: Annotated[float, within(3.6, 500.0, "m")]


class HeadLine(msgspec.Struct, kw_only=True):
    """First line: players, rules and ice."""

    format: Short
    home: Short
    away: Short
    rules: Short
    ends: Annotated[int, Meta(ge=1, le=100)]
    ice: Text
    sheet: SheetLine
    stone_radius: Annotated[float, within(0.01, 1.0, "m")]
    skill: list[Short] = msgspec.field(default_factory=list[str])
    seed: Annotated[int, Meta(ge=0)] = 0
    last_stone: TeamName = "home"


class LyingStone(msgspec.Struct, kw_only=True):
    """Stone at rest, sheet frame."""

    stone: StoneNumber
    team: TeamName
    x: Place
    y: Place


class PathLine(msgspec.Struct, kw_only=True):
    """Path of one stone, sheet frame."""

    stone: StoneNumber
    t: Annotated[list[Seconds], Meta(min_length=1, max_length=MAX_SAMPLES)]
    x: Annotated[list[Place], Meta(min_length=1, max_length=MAX_SAMPLES)]
    y: Annotated[list[Place], Meta(min_length=1, max_length=MAX_SAMPLES)]
    theta: Annotated[list[Heading], Meta(min_length=1, max_length=MAX_SAMPLES)]
    status: Status


class ThrowLine(msgspec.Struct, kw_only=True):
    """Throw as intended or executed."""

    speed: Annotated[float, within(0.0, 100.0, "m/s")]
    angle: Annotated[float, within(-10.0, 10.0, "rad")]
    spin: Annotated[float, within(-1e3, 1e3, "rad/s")]
    x: Place = 0.0


class DeliveryLine(msgspec.Struct, kw_only=True):
    """One delivery."""

    end: Annotated[int, Meta(ge=1, le=100)]
    stone: Annotated[int, Meta(ge=1, le=64)]
    team: TeamName
    hammer: TeamName
    direction: Literal["home", "away"]
    power_play: Short | bool | None = None
    shot: Text = ""
    meant: ThrowLine
    thrown: ThrowLine
    sweep: tuple[Heading, Heading]
    fault: Fault | None
    put_back: bool
    time: Seconds
    before: Annotated[list[LyingStone], Meta(max_length=64)]
    lying: Annotated[list[LyingStone], Meta(max_length=64)]
    paths: Annotated[list[PathLine], Meta(min_length=1, max_length=64)]
    score_of_end: EndScore | None = None


class ResultLine(msgspec.Struct, kw_only=True):
    """Last line: the result of the game."""

    line_score: Annotated[list[EndScore], Meta(max_length=100)]
    hammers: list[TeamName] = msgspec.field(default_factory=list[TeamName])
    score: EndScore
    winner: TeamName | None
    conceded: TeamName | None = None
    power_plays: list[TeamName] = msgspec.field(default_factory=list[TeamName])


def check_lines(lines: list[dict[str, Any]]) -> None:
    """Refuse a record that cannot be played.

    Parameters
    ----------
    lines : the lines of the file, from the players to the result

    Raises
    ------
    InputError : the line and the expected content
    """
    before = (0, 0)
    for number, line in enumerate(lines, start=1):
        kind: Any = DeliveryLine
        if number in (1, len(lines)):
            kind = HeadLine if number == 1 else ResultLine
        try:
            document = checked(line, kind)
            if isinstance(document, DeliveryLine):
                _check_paths(document)
                if (document.end, document.stone) <= before:
                    raise InputError(
                        f"end {document.end}, stone {document.stone} comes after end {before[0]}, "
                        f"stone {before[1]}"
                    )
                before = document.end, document.stone
        except InputError as error:
            place = f"line {number}" + (f", {error.where}" if error.where else "")
            raise InputError(error.problem, where=place) from error


def _check_paths(delivery: DeliveryLine) -> None:
    for k, path in enumerate(delivery.paths):
        lengths = {len(path.t), len(path.x), len(path.y), len(path.theta)}
        if len(lengths) != 1:
            raise InputError("t, x, y and theta differ in length", where=f"paths[{k}]")
        if any(after <= before for before, after in zip(path.t, path.t[1:], strict=False)):
            raise InputError("times must increase", where=f"paths[{k}].t")
    moved = [path.stone for path in delivery.paths]
    there = [stone.stone for stone in delivery.before]
    if len(set(moved)) != len(moved) or len(set(there)) != len(there):
        raise InputError("a stone is listed twice")
    if len(set(moved) - set(there)) != 1:
        raise InputError("expected one path of a new stone", where="paths")
