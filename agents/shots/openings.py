"""Errors of weight and line in the first delivery of an end, where the call is known.

Nothing but the placed stones lies there then, so that all teams call nearly the same draw for a
handle and a side of the power play. Where each stone came to rest gives its speed and line on an
ice of this project; a stone that ran into another has a speed that is known from one side only, and
a line within a stone's width. What hand, sweepers, ice and the wish of the team add up to is one
error here: the table cannot separate them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize
from scipy.stats import t as student

from agents.playing.search.aiming_table import AimingTable
from agents.shots.grades import GradedShot, graded_shots
from agents.shots.inversion import is_struck
from agents.shots.table import TableGame
from curling_env.errors import InputError
from curling_env.ice import Ice
from curling_env.sheet import Direction
from curling_env.typing import Floats

FEWEST = 20
"""Least number of openings with one handle on one side that are fitted."""
NEAR_CALL = 4.0
"""Openings farther from the usual call than this [scales] are other calls, and do not count."""
RESAMPLES = 40
"""Resampled sets of games for the intervals."""
FIRST_SPEED, FIRST_LINE = 0.015, 0.004
"""First guess of the scales [m/s, rad]."""
TAILS = 3.0
"""Fewest degrees of freedom that are considered: with fewer a standard deviation means little."""


@dataclass(frozen=True, kw_only=True)
class Measured:
    """A number with its 95 % interval."""

    value: float
    low: float
    high: float

    @classmethod
    def of(cls, value: float, resampled: Sequence[float]) -> Measured:
        """A number with the interval of its resampled values."""
        low, high = np.quantile(np.asarray(resampled), [0.025, 0.975])
        return cls(value=value, low=float(low), high=float(high))


@dataclass(frozen=True, kw_only=True)
class Openings:
    """Errors of all hands together in the first deliveries of ends.

    Parameters
    ----------
    shots, struck : number of them, and of those that ran into a stone
    speed : standard deviation of the speed at release [m/s]
    line : standard deviation of the line of delivery [rad]
    by_handle : errors with the counter-clockwise handle over those with the clockwise one
    tails : degrees of freedom of Student's t
    slope : by how much the logit of a grade falls when the miss grows e-fold
    """

    shots: int
    struck: int
    speed: Measured
    line: Measured
    by_handle: Measured
    tails: float
    slope: Measured


@dataclass(frozen=True)
class _Opening:
    """One opening: its call, rest relative to that and whether its weight is known."""

    group: tuple[float, str]
    rest: tuple[float, float] | None
    stop: float
    graded: GradedShot
    game: int


def fit_openings(
    games: Sequence[TableGame], ice: Ice, *, resamples: int = RESAMPLES, seed: int = 0
) -> Openings:
    """Fit the errors of the first deliveries of all ends.

    Parameters
    ----------
    games : games of a table
    ice : the ice on which the rests are thrown
    resamples : number of resampled sets of games for the intervals
    seed : seed of the resampling

    Raises
    ------
    InputError : fewer openings than a fit needs
    """
    table = AimingTable(ice, Direction.AWAY)
    found = [one for k, game in enumerate(games) for one in _openings(game, k)]
    groups = {one.group for one in found}
    kept = [g for g in sorted(groups) if sum(one.group == g for one in found) >= FEWEST]
    found = [one for one in found if one.group in kept]
    rests = sum(one.rest is not None for one in found)
    if rests < FEWEST:
        raise InputError(f"has {rests} first draws at rest; a fit needs {FEWEST} or more")
    data = _Errors(found, table)
    best = data.fit(np.ones(len(found)))
    rng = np.random.default_rng(seed)
    owner = np.array([one.game for one in found])
    numbers = np.unique(owner)
    resampled: list[tuple[float, ...]] = []
    for _ in range(resamples):
        drawn = np.bincount(rng.choice(len(numbers), len(numbers)), minlength=len(numbers))
        weights = drawn[np.searchsorted(numbers, owner)].astype(np.float64)
        resampled.append((*data.fit(weights), data.slope(weights)))
    columns = np.array(resampled).T
    return Openings(
        shots=len(found),
        struck=len(found) - rests,
        speed=Measured.of(best[0], columns[0].tolist()),
        line=Measured.of(best[1], columns[1].tolist()),
        by_handle=Measured.of(best[2], columns[2].tolist()),
        tails=best[3],
        slope=Measured.of(data.slope(np.ones(len(found))), columns[4].tolist()),
    )


def _openings(game: TableGame, number: int) -> list[_Opening]:
    out: list[_Opening] = []
    for one in graded_shots([game]):
        shot = one.shot
        if shot.number or shot.task != "draw":
            continue
        after = {(stone.team, stone.number): stone for stone in shot.after}
        rest = after.get((shot.team, 0))
        struck = is_struck(shot)
        if rest is None and not struck:
            continue
        house = max(shot.before, key=lambda stone: stone.y)
        side = "none" if abs(house.x) < 0.3 else "right" if house.x > 0 else "left"
        place = None if struck or rest is None else (rest.x, rest.y)
        out.append(_Opening((shot.spin, side), place, house.y - 0.29, one, number))
    return out


class _Errors:
    """Speeds and lines of openings relative to the usual call, and their likelihood."""

    def __init__(self, found: Sequence[_Opening], table: AimingTable) -> None:
        self.groups = sorted({one.group for one in found})
        self.group = np.array([self.groups.index(one.group) for one in found])
        self.spin = np.array([one.group[0] for one in found])
        self.grade = np.array([one.graded.shot.grade for one in found], dtype=np.float64)
        own = table.delivery.spin
        x, y = (np.array([np.nan if o.rest is None else o.rest[k] for o in found]) for k in (0, 1))
        stop = np.array([one.stop for one in found])
        self.known = np.isfinite(x)
        middle = {k: float(np.nanmedian(x[self.group == k])) for k in range(len(self.groups))}
        usual = np.array([middle[k] for k in self.group])
        self.speed, self.line = np.full(len(found), np.nan), np.full(len(found), np.nan)
        for sign in (-1.0, 1.0):
            mine = self.spin == sign
            places = np.where(self.known, x, usual)[mine], np.where(self.known, y, stop)[mine]
            throws = table.draws(*places, sign * own)
            self.speed[mine], self.line[mine] = throws[:, 0], throws[:, 1]
        inside = np.isfinite(self.speed)
        for k in range(len(self.groups)):
            some = self.known & inside & (self.group == k)
            centre = np.median(self.line[some])
            spread = 1.4826 * np.median(np.abs(self.line[some] - centre))
            other = np.abs(self.line - centre) > NEAR_CALL * spread
            inside &= ~((self.group == k) & self.known & other)
        self.inside = inside
        self.x, self.y = x, y

    def fit(self, weights: Floats) -> tuple[float, float, float, float]:
        """Standard deviations of speed and line, their ratio by handle, and the tails."""
        count = len(self.groups)
        known = self.known & self.inside
        middles = [
            np.array([float(np.median(of[known & (self.group == k)])) for k in range(count)])
            for of in (self.speed, self.line)
        ]

        def loss(parameters: Floats) -> float:
            speeds = middles[0] + FIRST_SPEED * parameters[:count]
            lines = middles[1] + FIRST_LINE * parameters[count : 2 * count]
            sigma_v, sigma_a, handle, tails = parameters[2 * count :]
            degrees = TAILS + np.exp(np.clip(tails, -6, 5))
            factor = np.exp(handle * self.spin / 2)
            by_speed = (self.speed - speeds[self.group]) / (np.exp(sigma_v) * factor)
            by_line = (self.line - lines[self.group]) / (np.exp(sigma_a) * factor)
            log = student.logpdf(by_speed, degrees) - sigma_v - np.log(factor)
            log = np.where(self.known, log, student.logsf(by_speed, degrees))
            along = student.logpdf(by_line, degrees) - sigma_a - np.log(factor)
            log = log + np.where(self.known, along, 0.0)
            total = float(np.sum(np.where(self.inside, log, 0.0) * weights))
            return -total + 0.5 * (tails / 3) ** 2

        first = np.array([*np.zeros(2 * count), np.log(FIRST_SPEED), np.log(FIRST_LINE), 0.0, 1.0])
        found = minimize(loss, first, method="L-BFGS-B").x
        sigma_v, sigma_a, handle, tails = (float(value) for value in found[2 * count :])
        degrees = TAILS + float(np.exp(np.clip(tails, -6, 5)))
        widen = np.sqrt(degrees / (degrees - 2))
        return (
            float(np.exp(sigma_v) * widen),
            float(np.exp(sigma_a) * widen),
            float(np.exp(handle)),
            degrees,
        )

    def slope(self, weights: Floats) -> float:
        """Decrease of the logit of a grade when the miss grows e-fold, from stones at rest."""
        some = self.known & self.inside & (weights > 0)
        miss = np.zeros(len(self.group))
        for k in range(len(self.groups)):
            mine = some & (self.group == k)
            centre = np.median(self.x[mine]), np.median(self.y[mine])
            miss[mine] = np.hypot(self.x[mine] - centre[0], self.y[mine] - centre[1])
        log = np.log(np.maximum(miss[some], 0.05))
        grade, weight = self.grade[some], weights[some]

        def loss(parameters: Floats) -> float:
            steps = np.cumsum([parameters[0], *np.exp(np.clip(parameters[1:4], -8, 4))])
            ability = -parameters[4] * log
            above = 1 / (1 + np.exp(steps[None] - ability[:, None]))
            padded = np.hstack([np.ones((len(log), 1)), above, np.zeros((len(log), 1))])
            chances = -np.diff(padded, axis=1)[np.arange(len(log)), grade.astype(int)]
            return -float(np.sum(weight * np.log(np.maximum(chances, 1e-12))))

        start = np.array([-2.0, -1.0, 0.0, 0.0, 1.0])
        return float(minimize(loss, start, method="L-BFGS-B").x[4])
