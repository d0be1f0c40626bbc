"""The parts of Digital Curling's messages that a shot depends on (protocol 1.x, "DC3").

Other fields are let through: servers of other versions send more. Positions are those of the wire:
origin at the hack from which is thrown, y towards the far house, x to its right [m]; the delivery
frame has the same axes, and its origin at the tee.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal, NotRequired, TypedDict

import msgspec

from curling_env.infrastructure.files.schema import within
from curling_env.sheet import HACK_Y, TEE_Y

HACK_TO_TEE = HACK_Y + TEE_Y
"""From the hack to the far tee, 38.405 m: by so much y differs from the delivery frame [m]."""
SPIN = 1.5707963267948966
"""Spin of every shot, π/2; ccw is positive [rad/s]."""

TeamName = Literal["team0", "team1"]
TEAMS: tuple[TeamName, TeamName] = ("team0", "team1")


class Point(msgspec.Struct):
    """A position [m] or a velocity [m/s]."""

    x: Annotated[float, within(-100.0, 100.0)]
    y: Annotated[float, within(-100.0, 100.0)]


class StoneMessage(msgspec.Struct):
    """A stone on the sheet, its handle turned by `angle` [rad]."""

    position: Point
    angle: Annotated[float, within(-1e6, 1e6)] = 0.0


class ResultMessage(msgspec.Struct):
    """How a game ended."""

    reason: str
    winner: TeamName | None = None


Slots = Annotated[list[StoneMessage | None], msgspec.Meta(min_length=8, max_length=8)]
Count = Annotated[int, within(0, 255)]


class PerTeam(msgspec.Struct):
    """The stones of both teams, each in the slot of its delivery; null where there is none."""

    team0: Slots
    team1: Slots

    def of(self, team: int) -> Slots:
        """The stones of team 0 or 1."""
        return self.team1 if team else self.team0


class ScoresMessage(msgspec.Struct):
    """Points of both teams in each end, null where it is not complete."""

    team0: list[Count | None]
    team1: list[Count | None]


class ExtraEndMessage(msgspec.Struct):
    """Points of both teams in the extra end that decided a game, null before."""

    team0: Count | None = None
    team1: Count | None = None

    @property
    def scored(self) -> bool:
        """Whether a team scored in an extra end."""
        return bool(self.team0 or self.team1)


class StateMessage(msgspec.Struct):
    """The `state` of an `update`: the position before a shot, and the course of the game."""

    end: Count
    shot: Annotated[int, within(0, 15)]
    hammer: TeamName | None
    stones: PerTeam
    scores: ScoresMessage
    extra_end_score: ExtraEndMessage | None = None
    game_result: ResultMessage | None = None
    thinking_time_remaining: dict[TeamName, float] = msgspec.field(default_factory=dict)


class DoublesMessage(StateMessage):
    """The state of a game of mixed doubles, which only version 4 plays.

    Its stones lie in the slots of this project: those delivered from slot 0, then the placed one.
    """

    decides: TeamName = "team1"
    """Who decides on the placement of this end."""
    is_placed: bool = True
    """Whether that is decided."""
    side: Literal["left", "right"] | None = None
    """The side of a power play in this end."""
    power_plays: list[TeamName] = msgspec.field(default_factory=list[TeamName])
    """Teams that had their power play."""


class ShotMessage(msgspec.Struct, tag_field="type", tag="shot"):
    """A stone thrown from the hack; a rotation that is not known is played as ccw."""

    velocity: Point
    rotation: str


class ConcedeMessage(msgspec.Struct, tag_field="type", tag="concede"):
    """The team to throw gives the game up."""


Move = ShotMessage | ConcedeMessage


class SettingMessage(msgspec.Struct):
    """The `setting` of a game. What a server does not tell is what its own settings have."""

    max_end: Annotated[int, within(1, 255)] | None = None
    sheet_width: Annotated[float, within(4.0, 10.0)] = 4.75
    five_rock_rule: bool = True
    thinking_time: dict[TeamName, float] = msgspec.field(default_factory=dict)
    extra_end_thinking_time: dict[TeamName, float] = msgspec.field(default_factory=dict)


class SimulatorMessage(msgspec.Struct):
    """The `simulator` of a game."""

    type: str = "fcv1"
    seconds_per_frame: Annotated[float, within(1e-5, 0.1)] = 0.001


class StateDocument(TypedDict):
    """A state as JSON, with whatever else the server sends."""

    end: int
    shot: int
    hammer: str | None
    stones: dict[str, list[Any]]
    scores: dict[str, list[int | None]]
    extra_end_score: NotRequired[dict[str, int | None]]
    thinking_time_remaining: NotRequired[dict[str, float]]
    game_result: NotRequired[dict[str, Any] | None]
