"""Parts of Digital Curling's messages that a shot depends on (protocol 1.x, "DC3").

Other fields are ignored: servers of other versions send more. Positions are those of the protocol:
origin at the hack of the delivery, y towards the far house, x to its right [m]; the delivery frame
has the same axes, and its origin at the tee.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal, NotRequired, TypedDict

import msgspec

from curling_env.infrastructure.files.schema import within
from curling_env.sheet import HACK_Y, TEE_Y

HACK_TO_TEE = HACK_Y + TEE_Y
"""Distance from the hack to the far tee, 38.405 m: the offset of y from the delivery frame [m]."""
SPIN = 1.5707963267948966
"""Spin of every shot, π/2; ccw is positive [rad/s]."""

TeamName = Literal["team0", "team1"]
TEAMS: tuple[TeamName, TeamName] = ("team0", "team1")


class Point(msgspec.Struct):
    """Position [m] or velocity [m/s]."""

    x: Annotated[float, within(-100.0, 100.0)]
    y: Annotated[float, within(-100.0, 100.0)]


class StoneMessage(msgspec.Struct):
    """Stone on the sheet, its handle turned by `angle` [rad]."""

    position: Point
    angle: Annotated[float, within(-1e6, 1e6)] = 0.0


class ResultMessage(msgspec.Struct):
    """Result of a game."""

    reason: str
    winner: TeamName | None = None


Slots = Annotated[list[StoneMessage | None], msgspec.Meta(min_length=8, max_length=8)]
Count = Annotated[int, within(0, 255)]


class PerTeam(msgspec.Struct):
    """Stones of both teams, each in the slot of its delivery; null for none."""

    team0: Slots
    team1: Slots

    def of(self, team: int) -> Slots:
        """Return the stones of team 0 or 1."""
        return self.team1 if team else self.team0


class ScoresMessage(msgspec.Struct):
    """Points of both teams in each end, null if it is not complete."""

    team0: list[Count | None]
    team1: list[Count | None]


class ExtraEndMessage(msgspec.Struct):
    """Points of both teams in the extra end that decided a game, null before."""

    team0: Count | None = None
    team1: Count | None = None

    @property
    def scored(self) -> bool:
        """Return whether a team scored in an extra end."""
        return bool(self.team0 or self.team1)


class StateMessage(msgspec.Struct):
    """`state` of an `update`: the position before a shot, and the course of the game."""

    end: Count
    shot: Annotated[int, within(0, 15)]
    hammer: TeamName | None
    stones: PerTeam
    scores: ScoresMessage
    extra_end_score: ExtraEndMessage | None = None
    game_result: ResultMessage | None = None
    thinking_time_remaining: dict[TeamName, float] = msgspec.field(default_factory=dict)


class DoublesMessage(StateMessage):
    """State of a game of mixed doubles, which only version 4 supports.

    Its stones are in the slots of this project: those delivered from slot 0, then the placed one.
    """

    decides: TeamName = "team1"
    """Team that decides on the placement of this end."""
    is_placed: bool = True
    """True once that is decided."""
    side: Literal["left", "right"] | None = None
    """Side of a power play in this end."""
    power_plays: list[TeamName] = msgspec.field(default_factory=list[TeamName])
    """Teams that had their power play."""


class ShotMessage(msgspec.Struct, tag_field="type", tag="shot"):
    """Stone thrown from the hack; an unknown rotation is played as ccw."""

    velocity: Point
    rotation: str


class ConcedeMessage(msgspec.Struct, tag_field="type", tag="concede"):
    """Concession of the team to throw."""


Move = ShotMessage | ConcedeMessage


class SettingMessage(msgspec.Struct):
    """`setting` of a game. Fields that a server does not send have its own defaults."""

    max_end: Annotated[int, within(1, 255)] | None = None
    sheet_width: Annotated[float, within(4.0, 10.0)] = 4.75
    five_rock_rule: bool = True
    thinking_time: dict[TeamName, float] = msgspec.field(default_factory=dict)
    extra_end_thinking_time: dict[TeamName, float] = msgspec.field(default_factory=dict)


class SimulatorMessage(msgspec.Struct):
    """`simulator` of a game."""

    type: str = "fcv1"
    seconds_per_frame: Annotated[float, within(1e-5, 0.1)] = 0.001


class StateDocument(TypedDict):
    """State as JSON, with any other fields of the server."""

    end: int
    shot: int
    hammer: str | None
    stones: dict[str, list[Any]]
    scores: dict[str, list[int | None]]
    extra_end_score: NotRequired[dict[str, int | None]]
    thinking_time_remaining: NotRequired[dict[str, float]]
    game_result: NotRequired[dict[str, Any] | None]
