"""Lines between Digital Curling's server and a client: one JSON object each (protocol 1.x).

Unknown fields are ignored, because servers of other versions send more. Fields that a server does
not disclose are missing, null or false.
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
"""Maximum length of a line [bytes]: one with the paths of all stones has some hundred thousand."""
PROTOCOL = 1
"""Supported major version of the protocol."""

Form = TypeVar("Form")


class Version(msgspec.Struct):
    """Version of the protocol."""

    major: int
    minor: int = 0


class Dc(msgspec.Struct, tag_field="cmd", tag="dc"):
    """First line of the server."""

    version: Version
    game_id: Short = ""
    date_time: Short = ""


class PlayerMessage(msgspec.Struct):
    """Accuracy of a player: `normal_dist`, or `identical`, which is exact."""

    type: Short = "normal_dist"
    max_speed: Annotated[float, within(0.1, 100.0)] = 4.0
    stddev_speed: Annotated[float, within(0.0, 10.0)] = 0.0
    stddev_angle: Annotated[float, within(0.0, 10.0)] = 0.0


Undisclosed = bool | None
"""Value of fields that the organiser does not disclose."""


class GameMessage(msgspec.Struct):
    """Description of the game by the organiser."""

    rule: Short = "normal"
    setting: SettingMessage | Undisclosed = None
    simulator: SimulatorMessage | Undisclosed = None
    players: dict[TeamName, list[PlayerMessage]] | Undisclosed = None

    @property
    def known_setting(self) -> SettingMessage:
        """Return the setting, or the server's default if it is not disclosed."""
        return self.setting if isinstance(self.setting, SettingMessage) else SettingMessage()

    @property
    def simulator_type(self) -> str:
        """Name of the physics; `fcv1` if it is not disclosed."""
        return self.simulator.type if isinstance(self.simulator, SimulatorMessage) else "fcv1"

    def players_of(self, team: TeamName) -> list[PlayerMessage]:
        """Return the players of a team, lead first; empty if they are not disclosed."""
        return self.players.get(team, []) if isinstance(self.players, dict) else []


class IsReady(msgspec.Struct, tag_field="cmd", tag="is_ready"):
    """Announcement of the game; the client may take its time to prepare."""

    team: TeamName
    game: GameMessage = msgspec.field(default_factory=GameMessage)


class NewGame(msgspec.Struct, tag_field="cmd", tag="new_game"):
    """Start of the game."""

    name: dict[TeamName, Short] = msgspec.field(default_factory=dict)


class LastMove(msgspec.Struct):
    """Previous move, as executed."""

    actual_move: Move
    free_guard_zone_foul: bool = False


class Update(msgspec.Struct, tag_field="cmd", tag="update"):
    """Position; the named team is to move."""

    state: StateMessage
    next_team: TeamName | None = None
    last_move: LastMove | None = None


class GameOver(msgspec.Struct, tag_field="cmd", tag="game_over"):
    """End of the game; the client closes the connection."""


class DcOk(msgspec.Struct, tag_field="cmd", tag="dc_ok"):
    """Answer of the client to `Dc`."""

    name: Annotated[str, msgspec.Meta(min_length=1, max_length=200)]


class ReadyOk(msgspec.Struct, tag_field="cmd", tag="ready_ok"):
    """Readiness of the client, with its players from lead to fourth."""

    player_order: Annotated[list[Annotated[int, within(0, 3)]], msgspec.Meta(max_length=4)] = (
        msgspec.field(default_factory=lambda: [0, 1, 2, 3])
    )


class MoveLine(msgspec.Struct, tag_field="cmd", tag="move"):
    """Move of the client whose turn it is."""

    move: Move


ServerLine = Dc | IsReady | NewGame | Update | GameOver
ClientLine = DcOk | ReadyOk | MoveLine


def from_server(line: bytes) -> ServerLine:
    """Parse a line of the server; see `read_line`."""
    return read_line(line, cast("type[ServerLine]", ServerLine))


def from_client(line: bytes) -> ClientLine:
    """Parse a line of a client; see `read_line`."""
    return read_line(line, cast("type[ClientLine]", ClientLine))


def read_line(line: bytes, form: type[Form]) -> Form:
    """Parse a line as one of the messages of a form.

    Raises
    ------
    InputError : a line that is not a JSON object, or not one of these messages
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
    """Return a message as a line."""
    return msgspec.json.encode(message) + b"\n"
