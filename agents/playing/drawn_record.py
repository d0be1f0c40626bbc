"""Recorded game from positions alone, for sources without throws.

Tables of championships and some logs have the positions after every delivery, and the handle. The
throw and the paths of such a record are drawn: the delivered stone slides as on the given ice to
its place of rest, or to the first stone that moved; from there all stones move in straight lines.
Places before and after are those of the source.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from agents.playing.record import head_line, lying_line
from agents.playing.search.aiming_table import AimingTable
from curling_env.game import GameSimulator
from curling_env.game.rules import RestingStone, Team, new_game
from curling_env.game.rules.rulesets import RuleSet, Side
from curling_env.game.rules.teams import STONES_PER_TEAM, Stones
from curling_env.game.simulator import direction_of
from curling_env.ice import load_ice
from curling_env.physics.batch import releases_of, throw_batch
from curling_env.physics.engine import Status
from curling_env.physics.slides import NO_BOUNDS
from curling_env.sheet import TEE_Y, Direction
from curling_env.typing import Floats

MOVED = 1e-3
"""Maximum difference of a stone's place before and after a delivery that did not move it [m]."""
HIT_WEIGHT = 1.25
"""Weight drawn for a stone that leaves play or moves others far."""
GENTLE = 1.0
"""Maximum movement of stones by a delivery that is drawn as a draw [m]."""
PATH_FPS = 10.0
"""Samples of a drawn path [1/s]."""
STRAIGHT_SPEED = 1.2
"""Mean speed of stones after the contact [m/s]."""
OUT_BY = 0.4
"""Distance outside the lines at which a stone that left play is drawn [m]."""


@dataclass(frozen=True, kw_only=True)
class PlacedShot:
    """Delivery of which only the positions are known.

    Parameters
    ----------
    team, number : the team that delivered, and the number of the delivery in its end, from 0
    after : stones on the sheet afterwards, as ruled; delivery frame
    spin : positive for a counter-clockwise handle
    task : name of the shot in the sport's words
    """

    team: Team
    number: int
    after: Stones
    spin: float = 1.0
    task: str = ""

    @property
    def stone(self) -> tuple[Team, int]:
        """The delivered stone, by team and number."""
        return self.team, self.number // 2

    @property
    def more(self) -> Mapping[str, Any]:
        """Further members of the line, such as a grade."""
        return {}


@dataclass(frozen=True, kw_only=True)
class PlacedEnd:
    """End as positions.

    Parameters
    ----------
    hammer : the team that delivers last
    before : stones on the sheet before the first delivery
    shots : the deliveries in order
    score : points of home and away; None for an unfinished end
    power_play : side of a power play
    """

    hammer: Team
    shots: Sequence[PlacedShot]
    score: tuple[int, int] | None
    before: Stones = ()
    power_play: Side | None = None


def drawn_lines(
    names: tuple[str, str],
    rules: RuleSet,
    ends: Sequence[PlacedEnd],
    *,
    ice: str = "standard",
    conceded: Team | None = None,
    more: Mapping[str, Any] | None = None,
) -> list[dict[str, Any]]:
    """Return the lines of a recorded game, see `agents.playing.record`, from positions alone.

    Parameters
    ----------
    names : the players of home and away
    rules : the rules played by
    ends : the ends in order
    ice : preset on which the delivered stones are drawn
    conceded : the team that conceded
    more : further members of the first line, such as the source
    """
    simulator = GameSimulator(ice, rules=rules)
    last = ends[0].hammer if ends else Team.AWAY
    first = new_game(rules, simulator.lines, last_stone=last)
    lines = [head_line(names, first, simulator, ice=ice, seed=0) | {"drawn": True, **(more or {})}]
    for number, end in enumerate(ends):
        lines += _lines_of_end(end, number, ice)
    scores = [end.score for end in ends if end.score is not None]
    home, away = (sum(score[team] for score in scores) for team in Team)
    winner = None
    if conceded is not None:
        winner = conceded.other
    elif home != away:
        winner = Team.HOME if home > away else Team.AWAY
    lines.append(
        {
            "line_score": [list(score) for score in scores],
            "hammers": [end.hammer.label for end in ends if end.score is not None],
            "score": [home, away],
            "winner": None if winner is None else winner.label,
            "conceded": None if conceded is None else conceded.label,
            "power_plays": [end.hammer.label for end in ends if end.power_play is not None],
        }
    )
    return lines


def _lines_of_end(end: PlacedEnd, number: int, ice: str) -> list[dict[str, Any]]:
    direction, before = direction_of(number), end.before
    throws, slides = _slides(end, ice)
    lines: list[dict[str, Any]] = []
    for k, shot in enumerate(end.shots):
        speed, angle, spin = (float(value) for value in throws[k])
        thrown = {"speed": speed, "angle": angle, "spin": spin, "x": 0.0}
        paths = _paths(before, shot, slides[k], direction)
        lines.append(
            {
                "end": number + 1,
                "stone": k + 1,
                "team": shot.team.label,
                "hammer": end.hammer.label,
                "direction": direction.name.lower(),
                "power_play": end.power_play,
                "shot": shot.task,
                "meant": thrown,
                "thrown": thrown,
                "sweep": [0.0, 0.0],
                "fault": None,
                "put_back": False,
                "time": max(path["t"][-1] for path in paths),
                "before": lying_line(before, direction),
                "lying": lying_line(shot.after, direction),
                "paths": paths,
                **shot.more,
            }
        )
        before = shot.after
    if lines and end.score is not None:
        lines[-1]["score_of_end"] = list(end.score)
    return lines


# --- the drawn throw ---------------------------------------------------------------------------


@cache
def _table(ice: str) -> AimingTable:
    return AimingTable(load_ice(ice), Direction.AWAY)


def places_of(stones: Stones) -> dict[tuple[Team, int], RestingStone]:
    """Return stones by team and number."""
    return {(stone.team, stone.number): stone for stone in stones}


def moved_stones(before: Stones, after: Stones, least: float = MOVED) -> list[RestingStone]:
    """Return the stones that a delivery moved farther, the nearest to the thrower first."""
    new = places_of(after)
    moved = [
        stone
        for stone in before
        if (now := new.get((stone.team, stone.number))) is None
        or np.hypot(now.x - stone.x, now.y - stone.y) > least
    ]
    return sorted(moved, key=lambda stone: stone.y)


def _slides(end: PlacedEnd, ice: str) -> tuple[Floats, list[Floats]]:
    """Return drawn throws (n, 3), and the path of each delivered stone up to its stop or first
    contact.

    A path has the columns t [s], x, y [m] and heading [rad], delivery frame.
    """
    table = _table(ice)
    touch = 2 * table.ice.stone.radius
    throws = np.full((len(end.shots), 3), np.nan)
    until = np.full(len(end.shots), np.inf)
    before = end.before
    for k, shot in enumerate(end.shots):
        spin = table.delivery.spin * (1.0 if shot.spin > 0 else -1.0)
        rest, moved = places_of(shot.after).get(shot.stone), moved_stones(before, shot.after)
        if moved:
            until[k] = moved[0].y - touch
            after = places_of(shot.after)
            now = [after.get((stone.team, stone.number)) for stone in moved]
            farthest = max(
                np.inf if new is None else float(np.hypot(new.x - old.x, new.y - old.y))
                for new, old in zip(now, moved, strict=True)
            )
            x, y = np.array([moved[0].x]), np.array([until[k]])
            gentle = farthest < GENTLE
            throws[k] = (
                table.draws(x, y + 0.3, spin) if gentle else table.hits(x, y, HIT_WEIGHT, spin)
            )[0]
        elif rest is not None:
            throws[k] = table.draws(np.array([rest.x]), np.array([rest.y]), spin)[0]
        else:
            side = np.array([1.75 if shot.spin > 0 else -1.75])
            throws[k] = table.hits(side, np.zeros(1), HIT_WEIGHT, spin)[0]
        if not np.isfinite(throws[k]).all():
            throws[k] = table.button_speed, 0.0, spin
        before = shot.after
    releases = releases_of(throws, int(table.direction), table.delivery)
    run = throw_batch(table.ice, releases, bounds=NO_BOUNDS, fps=PATH_FPS)
    assert run.paths is not None
    slides: list[Floats] = []
    for path, stop in zip(run.paths, until.tolist(), strict=True):
        path = path[np.isfinite(path[:, 0])] - [0.0, TEE_Y, 0.0]
        rows = np.column_stack([np.arange(len(path)) / PATH_FPS, path])
        slides.append(rows[: max(int((path[:, 1] < stop).sum()), 2)])
    return throws, slides


def _paths(
    before: Stones, shot: PlacedShot, slide: Floats, direction: Direction
) -> list[dict[str, Any]]:
    """Return the drawn paths of all stones that a delivery moved, the delivered one last; sheet
    frame.
    """
    after, moved = places_of(shot.after), moved_stones(before, shot.after)
    contact = float(slide[-1, 0]) if moved else 0.0
    x, y = slide[-1, 1:3].tolist()
    paths: list[dict[str, Any]] = []
    for stone in moved:
        now = after.get((stone.team, stone.number))
        way = _straight((stone.x, stone.y), now, contact, away_from=(x, y))
        paths.append(_path(stone.stone, way, now, direction))
    rest = after.get(shot.stone)
    rows = slide
    if moved:
        rows = np.vstack([slide, _straight((x, y), rest, contact, heading=float(slide[-1, 3]))[1:]])
    elif rest is not None:
        rows = slide.copy()
        rows[-1, 1:3] = rest.x, rest.y  # the table of throws is exact to a centimetre
    paths.append(_path(STONES_PER_TEAM * shot.team + shot.number // 2, rows, rest, direction))
    return paths


def _straight(
    start: tuple[float, float],
    now: RestingStone | None,
    begin: float,
    *,
    away_from: tuple[float, float] | None = None,
    heading: float = 0.0,
) -> Floats:
    """Return a straight path with decreasing speed from a place to a stone's new place, or out of
    play.
    """
    if now is not None:
        goal = np.array([now.x, now.y])
    else:
        push = np.subtract(start, away_from or (start[0], start[1] - 1.0))
        push = np.array([push[0], max(push[1], 0.05)]) / max(float(np.hypot(*push)), 0.05)
        far = min(
            (2.375 + OUT_BY - np.sign(push[0]) * start[0]) / max(abs(push[0]), 1e-3),
            (1.974 + OUT_BY - start[1]) / max(push[1], 1e-3),
        )
        goal = np.array(start) + max(far, OUT_BY) * push
    distance = float(np.hypot(*(goal - start)))
    seconds = max(distance / STRAIGHT_SPEED, 2 / PATH_FPS)
    part = np.linspace(0.0, 1.0, max(int(seconds * PATH_FPS), 2) + 1)
    eased = 1 - (1 - part) ** 2 if now is not None else part
    places = np.array(start) + eased[:, None] * (goal - start)
    return np.column_stack([begin + part * seconds, places, np.full(len(part), heading)])


def _path(
    stone: int, rows: Floats, now: RestingStone | None, direction: Direction
) -> dict[str, Any]:
    status = Status.REST
    if now is None:
        x, y = rows[-1, 1:3].tolist()
        status = Status.OUT_SIDE if abs(x) > 2.1 and y < 1.9 else Status.OUT_BACK
    return {
        "stone": stone,
        "t": np.round(rows[:, 0], 3).tolist(),
        "x": np.round(direction * rows[:, 1], 3).tolist(),
        "y": np.round(direction * (rows[:, 2] + TEE_Y), 3).tolist(),
        "theta": np.round(rows[:, 3], 2).tolist(),
        "status": status.value,
    }
