"""Small tables of shots in the layout of championship tables, written for these tests."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from pathlib import Path

NOT_YET, OUT = (0, 0), (4095, 4095)
GUARD, IN_HOUSE = (750, 1916), (750, 650)
HOME, AWAY = 31, 42

Place = tuple[int, int]


class SmallTable:
    """Tables of one game, end by end; home is team 31, away team 42."""

    def __init__(self) -> None:
        self.stones: list[list[object]] = []
        self.ends: list[list[object]] = []

    def end(
        self,
        rests: Sequence[Place],
        score: tuple[int, int],
        *,
        hammer: int = AWAY,
        placed: tuple[Place, Place] = (GUARD, IN_HOUSE),
        power_play: int = 0,
        thrown: int = 10,
    ) -> int:
        """Add an end of draws that touch nothing; its first row in Stones.csv.

        Parameters
        ----------
        rests : place of each delivered stone
        score : points of home and away as written
        hammer : the team that delivers last
        placed : the guard and the stone in the house
        power_play : as in Ends.csv
        thrown : number of stones that were thrown; the others have Task -1
        """
        number = len(self.ends) // 2 + 1
        first = HOME if hammer == AWAY else AWAY
        places = dict.fromkeys(range(12), NOT_YET)
        places[0 if first == HOME else 6] = placed[0]
        places[6 if first == HOME else 0] = placed[1]
        for k in range(10):
            team = first if k % 2 == 0 else hammer
            is_thrown = k < thrown
            if is_thrown:
                places[(0 if team == HOME else 6) + 1 + k // 2] = rests[k]
            player = 2 if 2 <= k < 8 else 1
            shot = [0, k % 2, 4 if is_thrown else -1] if is_thrown else [-1, -1, -1]
            row = [7, 1, 1, number, k + 7, team, player, *shot, ""]
            cells = [c for place in places.values() for c in place] if is_thrown else [""] * 24
            self.stones.append([*row, *cells])
        for team, points in zip((HOME, AWAY), score, strict=True):
            side = power_play if team == hammer and power_play else ""
            self.ends.append([7, 1, 1, team, number, points, side])
        return len(self.stones) - 10 + 2

    def write(self, folder: Path) -> Path:
        """Write the three tables; the path of Stones.csv."""
        names = [f"stone_{k}_{axis}" for k in range(1, 13) for axis in "xy"]
        head = "CompetitionID SessionID GameID EndID ShotID TeamID PlayerID Task Handle Points"
        total = [
            sum(int(row[5]) for row in self.ends if row[3] == team and row[5] != 9)
            for team in (HOME, AWAY)
        ]
        game = [7, 1, 1, 0, "A", "AAA", "BBB", *total, 0, 0, HOME, AWAY]
        games = "CompetitionID SessionID GameID GroupID Sheet NOC1 NOC2 ResultStr1 ResultStr2 LSFE"
        tables = {
            "Stones.csv": [[*head.split(), "TimeOut", *names], *self.stones],
            "Ends.csv": [
                ["CompetitionID", "SessionID", "GameID", "TeamID", "EndID", "Result", "PowerPlay"],
                *self.ends,
            ],
            "Games.csv": [[*games.split(), "Winner", "TeamID1", "TeamID2"], game],
        }
        for name, rows in tables.items():
            with (folder / name).open("w", newline="") as file:
                csv.writer(file).writerows(rows)
        return folder / "Stones.csv"


RESTS = (
    *((700, 1100), (860, 1000), (610, 1250), (930, 1220), (520, 1000)),
    *((1000, 900), (480, 700), (1050, 1100), (650, 660), (780, 780)),
)
"""Places of ten stones that touch no other; the last lies on the button and counts for its team."""
