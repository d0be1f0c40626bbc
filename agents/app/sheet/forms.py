"""Requests of the sheet's pages, as JSON; lengths in metres, sheet frame."""

from __future__ import annotations

from typing import Annotated, Any, Literal, TypeVar

import msgspec
import numpy as np

from agents.playing.board.kept_game import KeptGame
from agents.playing.board.set_up import LaidStone, Position
from curling_env.errors import InputError
from curling_env.game.rules import Team
from curling_env.infrastructure.files.schema import Document, Short, checked, within
from curling_env.sheet import Direction
from curling_env.throw import MAX_SPEED, MAX_SPIN, Throw
from curling_env.typing import Flags, Floats

Form = TypeVar("Form")

Place = Annotated[float, within(-30.0, 30.0, "m")]
"""A coordinate on the sheet."""
End = Literal["away", "home"]
"""The end played to."""
TeamName = Literal["home", "away"]
MOST_STONES = 16


class StoneForm(Document):
    """A stone on the board."""

    x: Place
    y: Place
    team: TeamName = "home"


Stones = Annotated[list[StoneForm], msgspec.Meta(max_length=MOST_STONES)]


class ThrowForm(Document):
    """A throw: at the hog line, towards the end that is played to."""

    speed: Annotated[float, within(0.0, MAX_SPEED, "m/s")]
    angle: Annotated[float, within(-1.5, 1.5, "rad")] = 0.0
    spin: Annotated[float, within(-MAX_SPIN, MAX_SPIN, "rad/s")] = 0.0

    @property
    def throw(self) -> Throw:
        return Throw(speed=self.speed, angle=self.angle, spin=self.spin)


class PlaceForm(Document):
    """A place on the sheet."""

    x: Place
    y: Place


class TargetForm(Document):
    """Keep a place by a name."""

    name: Short
    place: PlaceForm


class PositionNameForm(Document):
    """Save by a name what the address of the screen shows."""

    name: Short
    address: Annotated[str, msgspec.Meta(max_length=4096, pattern=r"^#[\w=&%.*+-]*$")]


class RunForm(Document):
    """Throw a stone."""

    ice: Short
    throw: ThrowForm
    to: End = "away"
    stones: Stones = msgspec.field(default_factory=list[StoneForm])


class PlanForm(Document):
    """Find the throw for a target; with `hit`, for the stone that lies there."""

    ice: Short
    target: PlaceForm
    skill: Short = "club"
    stones: Stones = msgspec.field(default_factory=list[StoneForm])
    hit: bool = False
    handle: Literal["either", "clockwise", "counter-clockwise"] = "either"


class PositionForm(Document):
    """A position laid out by hand."""

    stones: Stones = msgspec.field(default_factory=list[StoneForm])
    to: End = "away"
    hammer: TeamName = "home"
    delivered: Annotated[int, msgspec.Meta(ge=0, le=15)] = 0
    ends_left: Annotated[int, msgspec.Meta(ge=1, le=12)] = 1
    score: tuple[int, int] = (0, 0)

    @property
    def position(self) -> Position:
        return Position(
            stones=tuple(LaidStone(x=s.x, y=s.y, team=Team[s.team.upper()]) for s in self.stones),
            direction=Direction[self.to.upper()],
            hammer=Team[self.hammer.upper()],
            delivered=self.delivered,
            ends_left=self.ends_left,
            score=self.score,
        )


class CallsForm(Document):
    """Find the best calls in a position."""

    ice: Short
    position: PositionForm
    skill: Short = "club"


Kept = tuple[float, float, float]
"""Speed, angle and spin of a kept throw."""


class GameForm(Document):
    """Play a game again, and on.

    `since` is the first delivery whose paths are wanted; `throw` is the person's next one.
    """

    ice: Short
    skill: Short = "club"
    opponent_skill: Short = "club"
    opponent: Literal["greedy", "search", "rulebased", "draw"] = "greedy"
    person: TeamName = "home"
    rules: Short = "world_curling_2024"
    ends: Annotated[int, msgspec.Meta(ge=1, le=10)] = 2
    seed: Annotated[int, msgspec.Meta(ge=0, le=2**31)] = 0
    position: PositionForm | None = None
    throws: Annotated[list[Kept], msgspec.Meta(max_length=400)] = msgspec.field(
        default_factory=list[Kept]
    )
    throw: ThrowForm | None = None
    since: Annotated[int, msgspec.Meta(ge=0, le=400)] = 0

    @property
    def kept(self) -> KeptGame:
        throws = [ThrowForm(speed=v, angle=a, spin=s).throw for v, a, s in self.throws]
        if self.throw is not None:
            throws.append(self.throw.throw)
        return KeptGame(
            throws=tuple(throws),
            position=None if self.position is None else self.position.position,
            person=Team[self.person.upper()],
            opponent=self.opponent,
            rules=self.rules,
            ends=self.ends,
            seed=self.seed,
        )


def asked(document: Any, form: type[Form]) -> Form:
    """Check a page's request and return it.

    Raises
    ------
    InputError : the place of the first fault, and what was expected there
    """
    try:
        return checked(document, form)
    except InputError as error:
        # A page shows one sentence, so that the place belongs into it.
        raise InputError(f"{error.where or 'the request'}: {error.problem}") from error


def places_of(stones: list[StoneForm]) -> Floats:
    """Centres of stones, (k, 2) [m]."""
    return np.array([(stone.x, stone.y) for stone in stones], dtype=np.float64).reshape(-1, 2)


def own_of(stones: list[StoneForm]) -> Flags:
    """Return which stones are of the home team, which throws, (k,)."""
    return np.array([stone.team == "home" for stone in stones], dtype=np.bool_)


def rounded(values: Any, digits: int = 3) -> list[Any]:
    """Numbers for JSON; those that are not finite become null."""
    array = np.asarray(values, dtype=np.float64)
    if array.ndim > 1:
        return [rounded(row, digits) for row in array]
    return [round(v, digits) if np.isfinite(v) else None for v in array.tolist()]
