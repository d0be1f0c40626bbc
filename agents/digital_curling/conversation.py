"""The lines between Digital Curling's server and a client: one JSON object each (protocol 1.x).

Fields that are not known are let through, because servers of other versions send more. What a
server chooses not to tell of the game is missing, null or false.
"""

from __future__ import annotations

from typing import Annotated, Any, TypeVar, cast

import msgspec

from agents.digital_curling.messages import (
    Move,
    SettingMessage,
    SimulatorMessage,
    StateMessage,
    TeamName,
)
from curling_env.errors import InputError
from curling_env.infrastructure.files.reading import parse_json
from curling_env.infrastructure.files.schema import Short, checked, within

MAX_LINE = 8 * 2**20
"""Longest line that is read [bytes]: one with the paths of all stones has some hundred thousand."""
PROTOCOL = 1
"""Major number of the protocol spoken here."""

Form = TypeVar("Form")


class Version(msgspec.Struct):
    """Version of the protocol."""

    major: int
    minor: int = 0


class Dc(msgspec.Struct, tag_field="cmd", tag="dc"):
    """The server's first line."""

    version: Version
    game_id: Short = ""
    date_time: Short = ""


class PlayerMessage(msgspec.Struct):
    """How exactly a player throws: `normal_dist`, or `identical`, which is exact."""

    type: Short = "normal_dist"
    max_speed: Annotated[float, within(0.1, 100.0)] = 4.0
    stddev_speed: Annotated[float, within(0.0, 10.0)] = 0.0
    stddev_angle: Annotated[float, within(0.0, 10.0)] = 0.0


Untold = bool | None
"""What stands where the organiser keeps something to himself."""


class GameMessage(msgspec.Struct):
    """What the organiser tells of the game."""

    rule: Short = "normal"
    setting: SettingMessage | Untold = None
    simulator: SimulatorMessage | Untold = None
    players: dict[TeamName, list[PlayerMessage]] | Untold = None

    @property
    def told_setting(self) -> SettingMessage:
        """The setting, or the server's own where it is not told."""
        return self.setting if isinstance(self.setting, SettingMessage) else SettingMessage()

    @property
    def simulator_type(self) -> str:
        """Name of the physics; `fcv1` where it is not told."""
        return self.simulator.type if isinstance(self.simulator, SimulatorMessage) else "fcv1"

    def players_of(self, team: TeamName) -> list[PlayerMessage]:
        """The players of a team, lead first; none where they are not told."""
        return self.players.get(team, []) if isinstance(self.players, dict) else []


class IsReady(msgspec.Struct, tag_field="cmd", tag="is_ready"):
    """The game as it will be played; the client may take its time to prepare."""

    team: TeamName
    game: GameMessage = msgspec.field(default_factory=GameMessage)


class NewGame(msgspec.Struct, tag_field="cmd", tag="new_game"):
    """The game begins."""

    name: dict[TeamName, Short] = msgspec.field(default_factory=dict)


class LastMove(msgspec.Struct):
    """The move before, as it left the hand."""

    actual_move: Move
    free_guard_zone_foul: bool = False


class Update(msgspec.Struct, tag_field="cmd", tag="update"):
    """The position; the team named is to move."""

    state: StateMessage
    next_team: TeamName | None = None
    last_move: LastMove | None = None


class GameOver(msgspec.Struct, tag_field="cmd", tag="game_over"):
    """The game is over; the client hangs up."""


class DcOk(msgspec.Struct, tag_field="cmd", tag="dc_ok"):
    """The client's answer to `Dc`."""

    name: Annotated[str, msgspec.Meta(min_length=1, max_length=200)]


class ReadyOk(msgspec.Struct, tag_field="cmd", tag="ready_ok"):
    """The client is prepared; lead to fourth are these of its players."""

    player_order: Annotated[list[Annotated[int, within(0, 3)]], msgspec.Meta(max_length=4)] = (
        msgspec.field(default_factory=lambda: [0, 1, 2, 3])
    )


class MoveLine(msgspec.Struct, tag_field="cmd", tag="move"):
    """The move of the client whose turn it is."""

    move: Move


ServerLine = Dc | IsReady | NewGame | Update | GameOver
ClientLine = DcOk | ReadyOk | MoveLine


def from_server(line: bytes) -> ServerLine:
    """A line of the server; see `read_line`."""
    return read_line(line, cast("type[ServerLine]", ServerLine))


def from_client(line: bytes) -> ClientLine:
    """A line of a client; see `read_line`."""
    return read_line(line, cast("type[ClientLine]", ClientLine))


def read_line(line: bytes, form: type[Form]) -> Form:
    """A line as one of the messages of a form.

    Raises
    ------
    InputError : a line that is no JSON object, or none of these messages
    """
    try:
        text = line.decode("utf-8")
    except UnicodeDecodeError as error:
        raise InputError("expected text in UTF-8") from error
    document: Any = parse_json(text, source="")
    if not isinstance(document, dict):
        raise InputError("expected a JSON object on each line")
    return checked(document, form)


def write_line(message: ServerLine | ClientLine | dict[str, Any]) -> bytes:
    """A message as a line."""
    return msgspec.json.encode(message) + b"\n"
