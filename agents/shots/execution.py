"""Errors of execution by task, from the positions of stones, without known calls.

From the real position before a shot a grid of throws is simulated with its handle. Each throw has a
value, the probability of winning after it; its stones end near their real places or not; and it
matches the named task or not. A team is assumed to call a matching throw, with a probability that
rises with its value, averaged over the errors of the hand. Errors, and the slope of this
probability, maximise the likelihood of the real places (joint estimation of execution and decision
skill: Archibald and Nieves-Rivera 2019). Errors follow Student's t.
"""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.ndimage import map_coordinates
from scipy.optimize import minimize
from scipy.special import expit
from scipy.stats import chi2

from agents.playing.drawn_record import places_of
from agents.playing.search.evaluator import PositionEvaluator
from agents.playing.search.networks import network_for
from agents.playing.search.positions import position_of
from agents.playing.search.tuning import HIT_WEIGHTS
from agents.playing.search.value_network import skill_feature
from agents.shots.checks import LINES, RULES
from agents.shots.grades import GradedShot
from agents.shots.inversion import Inversion, distances, is_struck
from agents.shots.scatter import GRID, fit_scatter
from agents.shots.table import Shot
from curling_env.errors import InputError
from curling_env.game.rules.teams import STONES_PER_TEAM
from curling_env.ice import Ice
from curling_env.throw import SKILLS
from curling_env.typing import Flags, Floats, Indices, Progress, no_progress

DRAWS = ("draw", "freeze", "raise", "guard")
"""Tasks thrown with the weight of a draw; a front is a guard."""
HITS = ("takeout", "hit and roll", "clearing", "promotion takeout", "double takeout")
"""Tasks thrown with more weight."""
SPEED_SHOWN = DRAWS[:3]
"""Tasks that show errors of speed: the weight of a hit hardly changes the stones, and the depth of
a guard is the team's choice.
"""
STEP = 2**0.5
"""Ratio of neighbouring scales of errors."""
SPEEDS = np.geomspace(0.004, 0.004 * STEP**11, 12)
LINE_SCALES = np.geomspace(0.0007, 0.0007 * STEP**11, 12)
"""Tried scales of errors of speed [m/s] and line [rad]."""
BASE = np.arange(1, 8)
"""Indices of the scales of Student's t; those of its parts lie `PARTS` steps beside them."""
PARTS = np.arange(-1, 5)
TAILS = (3.0, 5.0, 10.0, 1000.0)
"""Degrees of freedom; with fewer than 3 a standard deviation means little."""
TEMPERATURES: Floats = np.array([0.0015, 0.0025, 0.004, 0.0065, 0.01, 0.02, 0.05, 10.0])
"""Tried differences of the win probability that make a call e times as likely."""
OTHERWISE: Floats = np.array([0.0, 0.15, 0.4])
"""Tried shares of random calls, in which all matching throws are equally likely."""
DRAW_WEIGHTS: Floats = np.arange(0.90, 1.13, 0.0057)
WEIGHTS_OF_HITS: Floats = np.linspace(1.1, 1.9, 12)
"""Speeds of the grid, relative to the draw to the button."""
ACROSS, DRAW_LINES, HIT_LINES = 0.075, 0.002, 0.0015
"""Number of lines to each side of the centre, and their spacing for draws and hits [rad]."""
NEAR, EXPLAINED = 0.1, 0.7
"""Distance from the real places at which the closeness of a throw is 1/√e, and maximum distance of
an explanation [m]."""
MOVED, TOUCHING = 0.05, 0.15
"""Minimum movement of a struck stone, and maximum gap of a freeze [m]."""
RESAMPLES = 40
"""Number of resampled sets of games for the intervals."""
FEWEST = 20
"""Minimum number of first draws at rest with one handle on one side."""


@dataclass(frozen=True, kw_only=True)
class Measured:
    """Number with its 95 % interval."""

    value: float
    low: float
    high: float

    @classmethod
    def of(cls, value: float, resampled: Sequence[float]) -> Measured:
        """Return a number with the interval from its resampled values."""
        low, high = np.quantile(np.asarray(resampled), [0.025, 0.975])
        return cls(value=float(value), low=float(low), high=float(high))


@dataclass(frozen=True, kw_only=True)
class TaskErrors:
    """Errors of the shots of one task.

    Parameters
    ----------
    task : the task
    shots, unexplained : number of shots that count, and of those that no throw explains
    speed : standard deviation of the speed at release [m/s]; None where none is shown
    line : standard deviation of the line of delivery [rad]
    temperature : difference of the probability of winning that makes a call e times as likely
    otherwise : share of calls that follow no value
    """

    task: str
    shots: int
    unexplained: int
    speed: Measured | None
    line: Measured
    temperature: float
    otherwise: float


@dataclass(frozen=True, kw_only=True)
class Execution:
    """Errors of all hands together, by task, and differences between owners.

    Parameters
    ----------
    shots : number of shots
    speed, line : standard deviations for all shots of the table, as often as each is thrown [m/s,
        rad]
    tails : degrees of freedom of Student's t
    tasks : the errors of each task
    scatter : standard deviation of the logarithm of errors between tasks, teams, players and
        handles, by the places of stones alone
    players : for each player, the logarithm of its errors over those of all shots, and the
        precision of that number, by the places of its stones alone
    by_handle : errors with the counter-clockwise handle over those with the clockwise one
    slope : by how much the logit of a grade falls when a miss grows e-fold
    """

    shots: int
    speed: Measured
    line: Measured
    tails: float
    tasks: list[TaskErrors]
    scatter: dict[str, Measured]
    players: dict[Hashable, tuple[float, float]]
    by_handle: Measured
    slope: Measured


class _Likelihood(NamedTuple):
    """Log-likelihoods of shots of one task.

    Parameters
    ----------
    values : (shots, intents, tails, speeds, lines); one speed for hits. An intent is one of
        `TEMPERATURES` with one of `OTHERWISE`
    shots : the shots
    unexplained : number of shots that no throw explains
    weight : number of shots of the table for each of them
    """

    values: Floats
    shots: list[GradedShot]
    unexplained: int
    weight: float


def fit_execution(
    shots: Sequence[GradedShot],
    ice: Ice,
    *,
    positions: int,
    seed: int = 0,
    progress: Progress = no_progress,
) -> Execution:
    """Fit errors of execution.

    Parameters
    ----------
    shots : graded shots of a table
    ice : the ice on which they are thrown
    positions : number of shots of each task
    seed : seed of the choice of shots and of the resampling
    progress : called after every task

    Raises
    ------
    InputError : fewer first draws than a fit needs, or no draws that throws explain
    """
    rng, maps = np.random.default_rng(seed), _Maps(ice)
    by_handle, slope = _first_draws(shots, rng)
    found: dict[str, _Likelihood] = {}
    tasks = (*DRAWS, *HITS)
    for k, task in enumerate(tasks):
        own = [one for one in shots if task_of(one) == task]
        some = [own[i] for i in rng.permutation(len(own))[:positions].tolist()]
        each = [(one, maps.log_likelihood(one)) for one in some]
        kept = [(one, values) for one, values in each if values is not None]
        if kept:
            values = np.array([values for _, values in kept])
            lost, weight = len(each) - len(kept), len(own) / len(kept)
            found[task] = _Likelihood(values, [one for one, _ in kept], lost, weight)
        progress("tasks", k + 1, len(tasks))
    if not any(task in found for task in DRAWS):
        raise InputError("has no draws, guards, freezes or raises that throws of this ice explain")
    return _together(found, by_handle, slope, rng)


def task_of(one: GradedShot) -> str:
    """Return the task of a shot as one of `DRAWS` and `HITS`, or another."""
    return "guard" if one.shot.task == "front" else one.shot.task


# --- one shot ----------------------------------------------------------------------------------


class _Maps:
    """Grids of throws on one ice, and their outcomes."""

    def __init__(self, ice: Ice) -> None:
        self.inversion = Inversion(ice)
        skill = skill_feature(SKILLS["champion"])
        self.evaluator = PositionEvaluator(network_for(RULES, ice), RULES, LINES, skill)
        parts = np.concatenate([[-np.inf], (PARTS[1:] + PARTS[:-1]) / 2, [np.inf]])
        # A part of Student's t is normal with a scale of sqrt(tails / χ²) times its own.
        self.weights = [
            np.diff(chi2.sf(tails * STEP ** (-2 * np.clip(parts, -50, 50)), tails))
            for tails in TAILS
        ]

    def log_likelihood(self, one: GradedShot) -> Floats | None:
        """Return (intents, tails, speeds, lines); None if no throw explains the shot."""
        task, shot = task_of(one), one.shot
        speeds, lines = self._grid(task, shot.spin)
        spin = shot.spin * self.inversion.table.delivery.spin
        throws = np.column_stack(
            [np.repeat(speeds, lines.shape[1]), lines.ravel(), np.full(lines.size, spin)]
        )
        simulator, number = self.inversion.simulator, shot.number
        before = np.broadcast_to(
            position_of(self.inversion.end_before(shot)), (len(throws), 2 * STONES_PER_TEAM, 2)
        )
        after = simulator.rule(before, number, *simulator.slide(before, number, throws))
        apart = distances(after, position_of(self.inversion.end_after(shot)))
        off = np.sqrt((apart**2).sum(axis=1))
        meant = self._meant(task, before, after, number)
        closeness = self._closeness(shot, speeds, lines, off)
        if not meant.any() or off.min() > EXPLAINED or not closeness.any():
            return None
        by_score = self.evaluator.game_odds.by_score(one.lead, one.ends_left)
        hammers = self.evaluator.values_to_hammer(after, number + 1, by_score)
        value = 1 - hammers if simulator.mover(number) else hammers
        grid = _Grid(speeds, lines, value.reshape(lines.shape), closeness,
                     meant.reshape(lines.shape), task in DRAWS)  # fmt: skip
        return grid.log_likelihood(self.weights)

    def _grid(self, task: str, sign: float) -> tuple[Floats, Floats]:
        """Return speeds (n,) and the lines of each (n, m)."""
        table = self.inversion.table
        spin, centre = sign * table.delivery.spin, np.zeros(1)
        if task in HITS:
            weights, spacing = WEIGHTS_OF_HITS, HIT_LINES
            middle = [table.hits(centre, centre, weight, spin)[0, 1] for weight in HIT_WEIGHTS]
            middles = np.interp(weights, HIT_WEIGHTS, middle)
        else:
            weights, spacing = DRAW_WEIGHTS, DRAW_LINES
            middles = np.full(len(weights), table.draws(centre, centre, spin)[0, 1])
        across = np.arange(-ACROSS, ACROSS + 1e-9, spacing)
        return weights * table.button_speed, middles[:, None] + across

    def _closeness(self, shot: Shot, speeds: Floats, lines: Floats, off: Floats) -> Floats:
        """Return the closeness of each throw's stones to their real places, (speeds, lines).

        A stone that touched nothing has one exact throw, which lies between four of the grid.
        """
        if is_struck(shot) or shot.stone not in places_of(shot.after):
            near = np.exp(-0.5 * (off**2 - off.min() ** 2) / NEAR**2)
            return near.reshape(lines.shape)
        throw = self.inversion.throw_of(shot)
        if throw is None:
            return np.zeros(lines.shape)
        along = 1 - np.abs(speeds - throw.throw.speed) / (speeds[1] - speeds[0])
        across = 1 - np.abs(lines[0] - throw.throw.angle) / (lines[0, 1] - lines[0, 0])
        return np.maximum(along, 0.0)[:, None] * np.maximum(across, 0.0)

    def _meant(self, task: str, before: Floats, after: Floats, number: int) -> Flags:
        """Return which throws match the task, (n,)."""
        simulator = self.inversion.simulator
        slot, first = simulator.slot(number), STONES_PER_TEAM * (1 - simulator.mover(number))
        there, rest = np.isfinite(before[:, :, 0]), after[:, slot]
        stays = np.isfinite(rest[:, 0])
        gone = there & np.isnan(after[:, :, 0])
        out = gone[:, first : first + STONES_PER_TEAM].sum(axis=1)
        if task in HITS:
            enough = out >= (2 if task == "double takeout" else 1)
            return enough & stays if task == "hit and roll" else enough
        way = np.hypot(*(after - before).transpose(2, 0, 1))
        moved = np.where(there, np.nan_to_num(way, nan=np.inf), 0.0).max(axis=1)
        if task == "raise":
            return (moved > MOVED) & ~gone.any(axis=1)
        if task == "freeze":
            apart = np.hypot(*(after - rest[:, None]).transpose(2, 0, 1))
            apart[:, slot] = np.inf
            gap = np.nan_to_num(apart, nan=np.inf).min(axis=1) - 2 * LINES.stone_radius
            return stays & (gap < TOUCHING) & (moved < 2 * LINES.stone_radius)
        in_house = np.hypot(rest[:, 0], rest[:, 1]) <= LINES.reach
        wanted = in_house if task == "draw" else ~in_house & (rest[:, 1] < 0)
        return stays & wanted & (moved < MOVED)


class _Grid(NamedTuple):
    """A grid of throws, (speeds, lines): their values, closeness to a real shot, and purpose."""

    speeds: Floats
    lines: Floats
    value: Floats
    closeness: Floats
    meant: Flags
    is_draw: bool

    def log_likelihood(self, weights: Sequence[Floats]) -> Floats:
        """Return (intents, tails, speeds, lines), by the weights of the parts of each t."""
        speeds = BASE.tolist() if self.is_draw else [None]
        out = np.empty((len(TEMPERATURES), len(OTHERWISE), len(TAILS), len(speeds), len(BASE)))
        known: dict[tuple[int | None, int], Floats] = {}
        for i, speed in enumerate(speeds):
            for j, line in enumerate(BASE.tolist()):
                pairs = [(None if speed is None else speed + m, line + m) for m in PARTS.tolist()]
                for pair in pairs:
                    if pair not in known:
                        known[pair] = self._averaged(*pair)
                parts = np.array([known[pair] for pair in pairs])
                for k, weight in enumerate(weights):
                    value, closeness = np.tensordot(weight, parts, 1)
                    for t, temperature in enumerate(TEMPERATURES.tolist()):
                        chance = np.exp((value - value.max()) / temperature)
                        valued = chance @ closeness / chance.sum()
                        out[t, :, k, i, j] = valued + OTHERWISE * (closeness.mean() - valued)
        return np.log(out + 1e-12).reshape(-1, *out.shape[2:])

    def _averaged(self, speed: int | None, line: int) -> Floats:
        """Return value and closeness averaged over normal errors around each meant throw, (2, n).

        Throws beyond the grid are unknown: their value is the mean of the others, and they are not
        close.
        """
        across = _kernel(self.lines[0], float(LINE_SCALES[line]))
        along = np.eye(len(self.speeds))
        if speed is not None:
            along = _kernel(self.speeds, float(SPEEDS[speed]))
        inside = along.sum(axis=1)[:, None] * across.sum(axis=1)
        value = along @ self.value @ across.T / inside
        return np.array([value[self.meant], (along @ self.closeness @ across.T)[self.meant]])


def _kernel(places: Floats, scale: float) -> Floats:
    """Return normal weights of neighbouring grid points, whose sum is 1 on an infinite grid."""
    step = float(places[1] - places[0])
    total = np.exp(-0.5 * (step * np.arange(-500, 501) / scale) ** 2).sum()
    return np.exp(-0.5 * ((places[:, None] - places) / scale) ** 2) / total


# --- all shots ---------------------------------------------------------------------------------


class _Fit(NamedTuple):
    """Maximum-likelihood fit of the errors.

    Parameters
    ----------
    tails : index into `TAILS`
    place : indices of the scales of speed and line of all tasks together, with fractions
    places, intents : those of each task, and the index of its intent
    """

    tails: int
    place: Floats
    places: dict[str, Floats]
    intents: dict[str, int]

    def deviations(self, place: Floats) -> Floats:
        """Return the standard deviations of speed and line, (2,)."""
        tails = TAILS[self.tails]
        first = np.array([SPEEDS[BASE[0]], LINE_SCALES[BASE[0]]])
        return first * STEP**place * np.sqrt(tails / (tails - 2))


def _fit(found: Mapping[str, _Likelihood], weights: Mapping[str, Floats]) -> _Fit:
    totals = {task: np.tensordot(weights[task], one.values, 1) for task, one in found.items()}
    # Tasks are weighted by their frequency; those without information on speed are constant over
    # it.
    pooled = sum(
        found[task].weight * total.max(axis=0 if task in SPEED_SHOWN else (0, 2), keepdims=True)[0]
        for task, total in totals.items()
    )
    peaks = [_peak(surface) for surface in np.asarray(pooled)]
    tails = int(np.argmax([height for height, _ in peaks]))
    at_tails = {task: total[:, tails] for task, total in totals.items()}
    return _Fit(
        tails=tails,
        place=peaks[tails][1],
        places={task: _peak(total.max(axis=0))[1] for task, total in at_tails.items()},
        intents={task: int(np.argmax(total.max(axis=(1, 2)))) for task, total in at_tails.items()},
    )


def _peak(surface: Floats) -> tuple[float, Floats]:
    """Return the maximum of a surface, and the top of a parabola through it."""
    top = np.unravel_index(np.argmax(surface), surface.shape)
    place = np.array(top, dtype=np.float64)
    for axis, k in enumerate(top):
        if 0 < k < surface.shape[axis] - 1:
            line = np.moveaxis(surface, axis, 0)[(slice(None), *np.delete(top, axis))]
            before, here, after = line[k - 1 : k + 2]
            place[axis] += 0.5 * (before - after) / min(before - 2 * here + after, -1e-9)
    return float(surface.max()), place


def _together(
    found: Mapping[str, _Likelihood],
    by_handle: Measured,
    slope: Measured,
    rng: np.random.Generator,
) -> Execution:
    games = sorted({one.game.key for lot in found.values() for one in lot.shots})
    owners = {
        task: np.array([games.index(one.game.key) for one in lot.shots], dtype=np.intp)
        for task, lot in found.items()
    }

    def fit(counts: Indices) -> _Fit:
        return _fit(found, {task: counts[own].astype(np.float64) for task, own in owners.items()})

    best = fit(np.ones(len(games), dtype=np.intp))
    drawn = [
        np.bincount(rng.choice(len(games), len(games)), minlength=len(games))
        for _ in range(RESAMPLES)
    ]
    others = [fit(counts) for counts in drawn]
    names, who = _owners([one for lot in found.values() for one in lot.shots])
    curves = _curves(found, best)
    effects = fit_scatter(curves, who)
    persons = fit_scatter(curves, {kind: who[kind] for kind in ("task", "handle", "player")})

    def measured(k: int, task: str | None = None) -> Measured:
        each = [
            one.deviations(one.place if task is None else one.places[task])[k]
            for one in (best, *others)
        ]
        return Measured.of(each[0], each[1:])

    return Execution(
        shots=sum(len(lot.shots) for lot in found.values()),
        speed=measured(0),
        line=measured(1),
        tails=TAILS[best.tails],
        tasks=[
            TaskErrors(
                task=task,
                shots=len(lot.shots),
                unexplained=lot.unexplained,
                speed=measured(0, task) if task in SPEED_SHOWN else None,
                line=measured(1, task),
                temperature=float(TEMPERATURES[best.intents[task] // len(OTHERWISE)]),
                otherwise=float(OTHERWISE[best.intents[task] % len(OTHERWISE)]),
            )
            for task, lot in found.items()
        ],
        scatter={
            kind: Measured(value=one.scatter, low=one.low, high=one.high)
            for kind, one in effects.items()
        },
        players={name: persons["player"].alone(k) for k, name in enumerate(names["player"])},
        by_handle=by_handle,
        slope=slope,
    )


def _owners(shots: Sequence[GradedShot]) -> tuple[dict[str, list[Hashable]], dict[str, Indices]]:
    """Return the owners of effects of each kind, and which of them each shot has."""
    kinds: dict[str, list[Hashable]] = {
        "task": [task_of(one) for one in shots],
        "team": [one.team for one in shots],
        "player": [one.player for one in shots],
        "handle": [one.shot.spin > 0 for one in shots],
    }
    names = {kind: list(dict.fromkeys(each)) for kind, each in kinds.items()}
    places = {kind: {name: k for k, name in enumerate(each)} for kind, each in names.items()}
    return names, {
        kind: np.array([places[kind][name] for name in each]) for kind, each in kinds.items()
    }


def _curves(found: Mapping[str, _Likelihood], fit: _Fit) -> Floats:
    """Return the log-likelihood of every shot by the logarithm of its errors, (n, len(GRID))."""
    curves: list[Floats] = []
    for task, lot in found.items():
        surface = lot.values[:, fit.intents[task], fit.tails]
        steps = fit.place[:, None] + GRID / np.log(STEP)
        at = np.broadcast_arrays(np.arange(len(surface))[:, None], *steps[:, None])
        curves.append(map_coordinates(surface, at, order=1, mode="nearest"))
    return np.concatenate(curves)


# --- first draws -------------------------------------------------------------------------------


def _first_draws(
    shots: Sequence[GradedShot], rng: np.random.Generator
) -> tuple[Measured, Measured]:
    """Return misses by handle, and the slope of grades, from first deliveries.

    Only the placed stones are on the ice then: all teams call nearly the same draw for a handle and
    a side of the power play, so a miss is the distance from the usual place.
    """
    groups: dict[tuple[float, int], list[tuple[float, float, int]]] = {}
    for one in shots:
        shot, rest = one.shot, places_of(one.shot.after).get(one.shot.stone)
        if not shot.number and shot.task == "draw" and rest is not None and not is_struck(shot):
            side = round(max(shot.before, key=lambda stone: stone.y).x)
            groups.setdefault((shot.spin, side), []).append((rest.x, rest.y, shot.grade or 0))
    kept = [(spin, np.array(own)) for (spin, _), own in groups.items() if len(own) >= FEWEST]
    if not kept:
        most = max(map(len, groups.values()), default=0)
        raise InputError(f"has {most} first draws at rest alike; a fit needs {FEWEST} or more")
    off = [np.hypot(*(own[:, :2] - np.median(own[:, :2], axis=0)).T) for _, own in kept]
    miss = np.log(np.maximum(np.concatenate(off), 0.05))
    grade = np.concatenate([own[:, 2] for _, own in kept]).astype(np.intp)
    left = np.concatenate([np.full(len(own), spin > 0) for spin, own in kept])

    def both(some: Indices) -> tuple[float, float]:
        logs, handle = miss[some], left[some]
        apart = logs[handle].mean() - logs[~handle].mean() if 0 < handle.sum() < len(some) else 0.0
        return float(np.exp(apart)), _slope(logs, grade[some])

    count = len(miss)
    found = [both(np.arange(count))]
    found += [both(rng.integers(count, size=count)) for _ in range(RESAMPLES)]
    by_handle, slope = (Measured.of(each[0], each[1:]) for each in zip(*found, strict=True))
    return by_handle, slope


def _slope(log_miss: Floats, grades: Indices) -> float:
    """Return the slope of the logit of a grade over the logarithm of a miss."""

    def loss(parameters: Floats) -> float:
        steps = np.cumsum([parameters[0], *np.exp(np.clip(parameters[1:4], -8, 4))])
        above = expit(-parameters[4] * log_miss[:, None] - steps)
        padded = np.hstack([np.ones((len(above), 1)), above, np.zeros((len(above), 1))])
        chances = -np.diff(padded, axis=1)[np.arange(len(above)), grades]
        return -float(np.log(np.maximum(chances, 1e-12)).sum())

    return float(minimize(loss, [-2.0, -1.0, 0.0, 0.0, 1.0], method="L-BFGS-B").x[4])
