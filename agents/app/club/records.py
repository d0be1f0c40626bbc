"""The rows of the club's database, one class for each table."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum


class Hand(StrEnum):
    """The hand an athlete throws with; it decides which handle is the in-turn."""

    RIGHT = "right"
    LEFT = "left"


class State(StrEnum):
    """State of long work."""

    WAITING = "waiting"
    RUNNING = "running"
    DONE = "done"
    FAILED = "failed"
    CANCELLED = "cancelled"


@dataclass(frozen=True, kw_only=True)
class Athlete:
    """A person who throws."""

    id: int
    name: str
    hand: Hand = Hand.RIGHT


@dataclass(frozen=True, kw_only=True)
class Stone:
    """A stone of the club's sets, by the name on its handle."""

    id: int
    name: str


@dataclass(frozen=True, kw_only=True)
class Camera:
    """A camera of the rink.

    Parameters
    ----------
    length, width : of the ice that it sees [m]
    scene : its scene file, from the club folder; None until the sheet is marked in its picture
    """

    id: int
    name: str
    length: float
    width: float
    scene: str | None = None


@dataclass(frozen=True, kw_only=True)
class Session:
    """An evening's practice on one sheet.

    Parameters
    ----------
    name : what it is called
    day : of the practice, as ``2026-11-22``
    sheet : the ice, by its name
    camera_id : what films it; None for tracks alone
    folder : where its tracks and ice lie, from the club folder
    stale : 1 where its files must be written again, 2 where only the tables of throws and athletes
    removed : when it was removed; None for what is there, here and below
    ice_of : digest of the tracks that its ice was estimated from; None if it was not estimated here
    lineup : athletes whose throws come next, in turn, separated by commas
    drill : the call of the throws that come next
    pebble, temperature, humidity, scrape : of the ice, as an ice technician enters them
    live : encoded measurements of the throw that a camera shows now, see
        `session_files.measures_of`
    live_rests : whether that throw's stone has come to rest
    live_film : place of the film that will show that throw
    """

    id: int
    name: str
    day: str
    sheet: str
    camera_id: int | None
    folder: str
    stale: int = 0
    removed: str | None = None
    ice_of: str | None = None
    lineup: str = ""
    drill: str = ""
    pebble: str = ""
    temperature: str = ""
    humidity: str = ""
    scrape: str = ""
    live: bytes | None = None
    live_rests: bool = False
    live_film: int = 0

    def turn(self, ahead: int) -> str:
        """The athlete whose turn it is after a number of throws; empty if none is entered."""
        names = self.lineup.split(",")
        return names[ahead % len(names)].strip()


@dataclass(frozen=True, kw_only=True)
class Film:
    """A film of a session.

    Parameters
    ----------
    place : its place in the order of play
    name : what its file was called
    file : where it lies, from the club folder
    size : in bytes, of which `received` have come
    state : how far tracking is
    said : remark of tracking: why it could not be tracked, or that the camera moved
    clock : when it began, since the session began [s]; None if unknown: right after the
        film before it
    camera_id : the camera as it stood in this film, where it was moved; None: the session's
    marks : digest of the marks that it was tracked with; None if that was not noted
    """

    id: int
    session_id: int
    place: int
    name: str
    file: str
    size: int
    received: int
    state: State = State.WAITING
    said: str = ""
    clock: float | None = None
    removed: str | None = None
    camera_id: int | None = None
    marks: str | None = None

    @property
    def is_whole(self) -> bool:
        """True if all of it has come."""
        return self.received >= self.size


@dataclass(frozen=True, kw_only=True)
class Throw:
    """A throw of a session: where its track is, and what the coach says of it.

    Parameters
    ----------
    number : of the throw in the session's tracks file, from 0; it stays the same once `settled`
    film_id : the film that shows it; None for tracks alone
    part : which throw of its film, or of the tracks that were imported, it is
    clock : when its part of the film begins [s]
    seen_stone : the stone's number as tracking numbers it
    athlete_id, stone_id, called, made, note, swept : a coach's entries; what was called reads as in
        `agents.coaching`, where it was swept as in `session_files.SWEPT`
    settled : whether the number is final: all earlier films have been tracked
    measures : encoded measurements, see `session_files.measures_of`; None if not measured yet,
        empty where the stone slid too short a way
    measured_of : digest of the tracks that were measured
    athlete, hand, stone : names of the athlete and the stone, and the hand; of other tables
    """

    id: int
    session_id: int
    number: int
    film_id: int | None = None
    part: int = 0
    clock: float = 0.0
    seen_stone: int = 0
    athlete_id: int | None = None
    stone_id: int | None = None
    called: str = ""
    made: bool | None = None
    note: str = ""
    removed: str | None = None
    settled: bool = True
    measures: bytes | None = None
    measured_of: str = ""
    swept: str = ""
    athlete: str = ""
    hand: Hand = Hand.RIGHT
    stone: str = ""

    @property
    def label(self) -> int:
        """The number that people see, from 1; it is also the number in the address."""
        return self.number + 1


@dataclass(frozen=True, kw_only=True)
class Target:
    """A place on the ice that is asked for often, sheet frame [m]: at the away end."""

    id: int
    name: str
    x: float
    y: float
    removed: str | None = None


@dataclass(frozen=True, kw_only=True)
class Position:
    """A position of stones that was saved: the part of the address of *Plan* that shows it."""

    id: int
    name: str
    address: str


@dataclass(frozen=True, kw_only=True)
class Answer:
    """Something that took long to work out.

    Parameters
    ----------
    of : digest of what it follows from
    content : encoded
    """

    name: str
    of: str
    content: bytes


@dataclass(frozen=True, kw_only=True)
class Note:
    """A remark about a session."""

    id: int
    session_id: int
    text: str
    written: str


@dataclass(frozen=True, kw_only=True)
class Job:
    """Long work.

    Parameters
    ----------
    kind : what is done, a name of `work.jobs.KINDS`
    share : how much of it is done, 0 to 1
    says : what it does just now, in words
    left : estimated time until it ends [s]; None while unknown
    problem : why it failed, in words
    given : its argument in addition to the session, such as the address of a camera
    """

    id: int
    kind: str
    session_id: int
    state: State
    share: float = 0.0
    says: str = ""
    left: float | None = None
    problem: str | None = None
    given: str = ""
