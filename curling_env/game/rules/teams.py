"""Teams and their stones on the sheet."""

from __future__ import annotations

from enum import IntEnum
from typing import NamedTuple

STONES_PER_TEAM = 8
"""Number of stones of one colour on a sheet; they are numbered from 0 to 7."""


class Team(IntEnum):
    """Team, named as on a scoreboard."""

    HOME = 0
    AWAY = 1

    @property
    def other(self) -> Team:
        """The opponent."""
        return _OTHER[self]

    @property
    def label(self) -> str:
        """``home`` or ``away``, as in files."""
        return self.name.lower()


_OTHER = (Team.AWAY, Team.HOME)


class RestingStone(NamedTuple):
    """Stone at rest on the sheet.

    Parameters
    ----------
    team : its team
    number : 0 to 7 within its team, in order of delivery; a placed stone has the next number
    x, y : its centre, delivery frame [m]
    """

    team: Team
    number: int
    x: float
    y: float

    @property
    def stone(self) -> int:
        """Identifier on the sheet: the home team's stones are 0 to 7, the away team's 8 to 15."""
        return STONES_PER_TEAM * self.team + self.number

    @property
    def distance(self) -> float:
        """Distance of its centre from the tee [m]."""
        return (self.x * self.x + self.y * self.y) ** 0.5


Stones = tuple[RestingStone, ...]
"""Stones on a sheet, in order of arrival."""
