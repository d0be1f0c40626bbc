"""Tables of championship shots: the positions of all stones after each, its task, handle and grade.

A folder holds ``Stones.csv`` (a row a delivery), ``Ends.csv`` and ``Games.csv``. Places are in
hundredths of a foot: the tee of the played house at (750, 800), x to the thrower's right, y against
the direction of play. (0, 0) is a stone not yet thrown, 4095 one out of play. Six columns of each
team begin with its placed stone. The format is not documented; the rings, the placed stones and the
scores of ends agree with this reading, see docs/championships.md.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from agents.playing.drawn_record import PlacedEnd, PlacedShot
from agents.shots.checks import LINES, OUT, OWN, RULES, STONES, error_needed, problems_of
from curling_env.errors import InputError
from curling_env.game.rules import RestingStone, Team
from curling_env.game.rules.rulesets import Side
from curling_env.game.rules.scoring import points_of
from curling_env.game.rules.teams import Stones
from curling_env.infrastructure.files.table import Table, read_table
from curling_env.typing import Floats

UNIT = 0.003048
"""A hundredth of a foot [m]."""
TEE = (750.0, 800.0)
"""The tee, in the table's unit."""
TASKS = (
    *("draw", "front", "guard", "raise", "wick", "freeze", "takeout", "hit and roll"),
    *("clearing", "double takeout", "promotion takeout", "through"),
)
"""Tasks by their numbers; -1 is a stone that was not thrown."""
HANDLES = (-1.0, 1.0)
"""Sign of the spin of handle 0, clockwise, and 1, counter-clockwise."""
SIDES: tuple[Side, Side] = ("right", "left")
"""Sides of PowerPlay 1 and 2."""
NOT_SCORED = 9
"""Result of an end after a concession; as a grade, an ungraded shot."""
BEST_GRADE = 4
READING_ERROR = 0.10
"""Maximum error of positions that explains a wrong count [m]."""

_GAME = ("CompetitionID", "SessionID", "GameID")
_END = (*_GAME, "EndID")
_SHOT = (*_END, "ShotID", "TeamID", "PlayerID", "Task", "Handle", "Points")
_PLACES = tuple(f"stone_{k}_{axis}" for k in range(1, 2 * STONES + 1) for axis in "xy")

GameKey = tuple[int, int, int]


class Fault(NamedTuple):
    """Row that contradicts itself, others or the rules.

    Parameters
    ----------
    file, row : where it stands, the header being row 1
    problem : what is wrong, and what was expected
    """

    file: str
    row: int
    problem: str

    def __str__(self) -> str:
        return f"{self.file}, row {self.row}: {self.problem}"


@dataclass(frozen=True, kw_only=True)
class Shot(PlacedShot):
    """One delivery; home is the first team of Games.csv, the task one of `TASKS` or empty.

    Parameters
    ----------
    row : row of Stones.csv
    player : 1 or 2 within the team, rarely more
    grade : 0 to 4; None for a shot without one
    before : stones on the sheet before it, delivery frame
    """

    row: int
    player: int
    grade: int | None
    before: Stones

    @property
    def more(self) -> dict[str, Any]:
        return {"grade": self.grade, "player": self.player, "row": self.row}


@dataclass(frozen=True, kw_only=True)
class TableEnd(PlacedEnd):
    """One end; the score is as written, None if the end was not scored.

    Parameters
    ----------
    number : number in the game, from 0
    counted : points of home less those of away, by the stones
    short_by : least error of every place that would explain a count that is not as written [m]
    shots : the deliveries that were thrown
    stopped : whether stones of the end were not thrown
    """

    number: int
    counted: int
    short_by: float
    shots: tuple[Shot, ...]
    stopped: bool
    row: int

    @property
    def agrees(self) -> bool:
        """True if the stones give the written score."""
        return self.score is None or self.counted == self.score[0] - self.score[1]

    @property
    def kind(self) -> str:
        """Reason why the stones contradict the written score, in words; empty if they agree."""
        if self.agrees:
            return ""
        if self.stopped:
            return "the end was stopped, and not scored by its stones"
        if self.short_by <= READING_ERROR:
            return "a measurement: positions are not exact enough to decide which stone is nearer"
        return "a position or the score is wrong"


@dataclass(frozen=True, kw_only=True)
class TableGame:
    """One game.

    Parameters
    ----------
    key : competition, session and game
    names : names of home and away
    teams : identifiers of home and away
    result : final score as written
    ends : the ends in order
    """

    key: GameKey
    names: tuple[str, str]
    teams: tuple[int, int]
    result: tuple[int, int]
    ends: tuple[TableEnd, ...]

    @property
    def conceded(self) -> Team | None:
        """Team that conceded: the one behind, if the last end was not scored."""
        if not self.ends or self.ends[-1].score is not None or self.result[0] == self.result[1]:
            return None
        return Team.HOME if self.result[0] < self.result[1] else Team.AWAY


@dataclass(frozen=True, kw_only=True)
class ShotTable:
    """The games of a table, and its faults."""

    games: tuple[TableGame, ...]
    faults: tuple[Fault, ...] = field(default=())

    @property
    def ends(self) -> list[TableEnd]:
        """All ends."""
        return [end for game in self.games for end in game.ends]


def is_shot_table(path: str | Path) -> bool:
    """Return whether the first row of a file has the columns of a table of shots."""
    if not Path(path).is_file():
        return False
    with Path(path).open("rb") as file:
        names = {name.strip(b' "\xef\xbb\xbf\r\n') for name in file.readline(8192).split(b",")}
    return {b"ShotID", b"Task", b"stone_1_x", b"stone_12_y"} <= names


def read_shots(path: str | Path) -> ShotTable:
    """Read a table of shots, with the tables of ends and games beside it.

    Parameters
    ----------
    path : ``Stones.csv``; ``Ends.csv`` and ``Games.csv`` are expected in its folder

    Raises
    ------
    InputError : a file that is missing or has other columns, or cells that are no whole numbers
    """
    path = Path(path)
    for name in ("Ends.csv", "Games.csv"):
        if not path.with_name(name).is_file():
            raise InputError(
                f"expected {name} beside it, with the results of its ends", source=path
            )
    stones = read_table(path, required=(*_SHOT, *_PLACES))
    ends = read_table(
        path.with_name("Ends.csv"), required=(*_END, "TeamID", "Result"), optional=("PowerPlay",)
    )
    games = read_table(
        path.with_name("Games.csv"),
        required=(*_GAME, "NOC1", "NOC2", "ResultStr1", "ResultStr2", "TeamID1", "TeamID2"),
    )
    return _Reader(stones, ends, games).read()


class _Reader:
    """Reader that joins three tables, and collects contradictions."""

    def __init__(self, stones: Table, ends: Table, games: Table) -> None:
        self._stones, self._ends, self._games = stones, ends, games
        self._faults: list[Fault] = []
        self._columns = {name: stones.integers(name) for name in _SHOT}
        places = np.column_stack([stones.numbers(name, blank=True) for name in _PLACES])
        self._places: Floats = places.reshape(len(stones), -1, 2)

    def read(self) -> ShotTable:
        rows = self._rows_of_ends()
        results = self._results()
        columns = [self._games.integers(name).tolist() for name in _GAME]
        teams = [self._games.integers(f"TeamID{k}").tolist() for k in (1, 2)]
        finals = [self._games.integers(f"ResultStr{k}").tolist() for k in (1, 2)]
        names = [self._games.text(f"NOC{k}") for k in (1, 2)]
        games: list[TableGame] = []
        for k, key in enumerate(zip(*columns, strict=True)):
            pair = teams[0][k], teams[1][k]
            own = [
                self._end((*key, end), rows[*key, end], pair, results)
                for end in sorted(end for *game, end in rows if tuple(game) == key)
            ]
            game = TableGame(
                key=key,
                names=(names[0][k], names[1][k]),
                teams=pair,
                result=(finals[0][k], finals[1][k]),
                ends=tuple(end for end in own if end is not None),
            )
            self._check_result(game, self._games.rows[k])
            games.append(game)
        known = {game.key for game in games}
        for key, indices in rows.items():
            if key[:3] not in known:
                game_name = "/".join(map(str, key[:3]))
                self._note(self._stones.rows[indices[0]], f"game {game_name} is not in Games.csv")
        return ShotTable(games=tuple(games), faults=tuple(sorted(self._faults)))

    def _rows_of_ends(self) -> dict[tuple[int, ...], list[int]]:
        """Indices of the deliveries of each end, in order of delivery."""
        keys = np.column_stack([self._columns[name] for name in (*_END, "ShotID")])
        found: dict[tuple[int, ...], list[int]] = {}
        for index in np.lexsort(keys.T[::-1]).tolist():
            found.setdefault(tuple(keys[index, :4].tolist()), []).append(index)
        return found

    def _results(self) -> dict[tuple[int, ...], tuple[int, int, int]]:
        """Result, power play and row of each team in each end."""
        numbers = [self._ends.integers(name).tolist() for name in (*_END, "TeamID", "Result")]
        sides = [0.0] * len(self._ends)
        if "PowerPlay" in self._ends:
            sides = np.nan_to_num(self._ends.numbers("PowerPlay", blank=True)).tolist()
        found: dict[tuple[int, ...], tuple[int, int, int]] = {}
        for k, (*key, result) in enumerate(zip(*numbers, strict=True)):
            if tuple(key) in found:
                self._note(self._ends.rows[k], "a team's second result of one end", "Ends.csv")
            found[tuple(key)] = result, int(sides[k]), self._ends.rows[k]
        return found

    def _end(
        self,
        key: tuple[int, ...],
        indices: list[int],
        teams: tuple[int, int],
        results: dict[tuple[int, ...], tuple[int, int, int]],
    ) -> TableEnd | None:
        row = self._stones.rows[indices[-1]]
        own = [results.get((*key, team)) for team in teams]
        home, away = own
        if home is None or away is None:
            self._note(row, f"Ends.csv has no result of end {key[3]} for both teams")
            return None
        delivering = self._columns["TeamID"][indices]
        if not np.isin(delivering, teams).all():
            self._note(row, "a team that does not play this game delivers")
            return None
        thrown = [i for i in indices if self._columns["Task"][i] >= 0]
        if (delivering[1:] == delivering[:-1]).any():
            self._note(row, f"the teams do not alternate in end {key[3]}")
        hammer = Team(teams.index(int(delivering[-1])))
        shots = self._shots(indices, teams, hammer)
        scored = NOT_SCORED not in (home[0], away[0])
        score = (home[0], away[0]) if scored else None
        position = self._places_after(thrown[-1]) if thrown else np.full((2 * STONES, 2), np.nan)
        counted = int(points_of(position, OWN, LINES.reach, RULES.measure))
        written = 0 if score is None else score[0] - score[1]
        side = home[1] or away[1]
        end = TableEnd(
            number=key[3] - 1,
            hammer=hammer,
            power_play=SIDES[side - 1] if side in (1, 2) else None,
            score=score,
            counted=counted,
            short_by=error_needed(position, written) if counted != written else 0.0,
            before=shots[0].before if shots else (),
            shots=shots,
            stopped=len(thrown) < len(indices),
            row=row,
        )
        if not end.agrees:
            words = f"the stones count {_in_words(counted)}, Ends.csv has {_in_words(written)}"
            self._note(row, f"{words}: {end.kind} ({100 * end.short_by:.0f} cm)")
        return end

    def _shots(self, indices: list[int], teams: tuple[int, int], hammer: Team) -> tuple[Shot, ...]:
        shots: list[Shot] = []
        before = self._placed(indices[0], teams)
        for number, i in enumerate(indices):
            task, handle, grade = (int(self._columns[c][i]) for c in ("Task", "Handle", "Points"))
            if task < 0:
                continue
            row = self._stones.rows[i]
            team = Team(teams.index(int(self._columns["TeamID"][i])))
            after = self._lying(i)
            for problem in problems_of(self._places[i], before, after, team, number):
                self._note(row, problem)
            named = 0 <= task < len(TASKS)
            if not named:
                self._note(row, f"Task is {task}, expected -1 to {len(TASKS) - 1}")
            if grade not in (*range(BEST_GRADE + 1), NOT_SCORED):
                self._note(row, f"Points is {grade}, expected 0 to 4, or 9 for none")
            if handle not in (0, 1):
                self._note(row, f"Handle is {handle}, expected 0 or 1")
            shots.append(
                Shot(
                    row=row,
                    number=number,
                    team=team,
                    player=int(self._columns["PlayerID"][i]),
                    task=TASKS[task] if named else "",
                    spin=HANDLES[handle == 1],
                    grade=grade if 0 <= grade <= BEST_GRADE else None,
                    before=before,
                    after=after,
                )
            )
            before = after
        return tuple(shots)

    def _placed(self, index: int, teams: tuple[int, int]) -> Stones:
        """Return the placed stones before the first delivery: as after it, or according to the
        rules.

        The first delivery may have moved them, so that only their usual places are known.
        """
        team = teams.index(int(self._columns["TeamID"][index]))
        places = self._places[index, [STONES * team, STONES * (1 - team)]]
        usual = min(_PLACED, key=lambda pair: float(np.nansum(np.abs(np.subtract(places, pair)))))
        both = [Team(team), Team(1 - team)]
        return tuple(
            RestingStone(whose, RULES.stones, *_metres(place))
            for whose, place in zip(both, usual, strict=True)
        )

    def _places_after(self, index: int) -> Floats:
        """Return the positions after a delivery, (12, 2), delivery frame [m]; NaN without a
        stone.
        """
        places = self._places[index]
        lies = (np.isfinite(places) & (places > 0) & (places < OUT)).all(axis=1)
        return np.where(lies[:, None], (places - TEE) * [UNIT, -UNIT], np.nan)

    def _lying(self, index: int) -> Stones:
        found: list[RestingStone] = []
        for k, (x, y) in enumerate(self._places_after(index).tolist()):
            if x == x:
                team, column = divmod(k, STONES)
                found.append(RestingStone(Team(team), (column - 1) % STONES, x, y))
        return tuple(found)

    def _check_result(self, game: TableGame, row: int) -> None:
        scores = [end.score for end in game.ends if end.score is not None]
        total = sum(score[0] for score in scores), sum(score[1] for score in scores)
        if total != game.result:
            words = f"the ends add up to {total[0]} : {total[1]}"
            text = f"{words}, the result is {game.result[0]} : {game.result[1]}"
            self._note(row, text, "Games.csv")

    def _note(self, row: int, problem: str, file: str = "Stones.csv") -> None:
        self._faults.append(Fault(file, row, problem))


_PLACED: tuple[tuple[tuple[float, float], tuple[float, float]], ...] = (
    ((750.0, 1916.0), (750.0, 650.0)),
    ((1089.0, 1916.0), (1150.0, 850.0)),
    ((411.0, 1916.0), (350.0, 850.0)),
)
"""Positions of the guard and the stone in the house: without power play, right, left."""


def _metres(place: Sequence[float]) -> tuple[float, float]:
    x, y = np.asarray(place, dtype=np.float64) - TEE
    return float(UNIT * x), float(-UNIT * y)


def _in_words(points: int) -> str:
    return f"{abs(points)} for {'home' if points > 0 else 'away'}" if points else "a blank"
