"""Intended throw: it reaches its call on the ice that the team believed in."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from agents.coaching.calls import Call
from agents.coaching.misses.released import Released
from agents.coaching.runs import (
    ANGLE,
    SPEED,
    SPIN,
    Place,
    X,
    angle_to_tee,
    hog_times,
    outcomes,
    turns,
)
from agents.coaching.throw_sheet import ThrowSheet
from agents.coaching.tuning import HABIT_THROWS
from curling_env.errors import InputError
from curling_env.ice import Ice
from curling_env.throw import MAX_SPEED
from curling_env.typing import Floats
from friction_estimation.tracks.measured import Measured

_STEPS = np.array([0.01, 0.002, 0.05])
"""Steps of the numerical derivatives, in speed, angle and spin."""
_LARGEST = np.array([0.3, 0.05, 0.5])
"""Largest corrections in one iteration."""
_SPEEDS = np.arange(0.4, 4.6, 0.05)
"""Initial speeds of the search [m/s]."""
_SLOWEST = 0.1
_ROUNDS = 15
_EXACT = 1e-3
"""Tolerance on the called outcome [m, or s]."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Intended:
    """Intended throw.

    Parameters
    ----------
    throw : (4,) speed, angle, spin, x on the hog line
    slopes : (4, 2) its derivatives by spin and x, which are not called
    outcome : (2,) its place of rest on the believed ice, or its crossing of the line of a hit [m]
    """

    throw: Floats
    slopes: Floats
    outcome: Floats


def intend(
    call: Call, believed: Ice, place: Place, *, spin: float, x: float, speed: float
) -> Intended:
    """Find the intended throw.

    It begins where the stone crossed the hog line: a thrower who slides out beside the centre line
    intends another angle. If a broom was called, the line is the one to the broom; otherwise it is
    the one that leads to the target. The weight is that of the called time; otherwise, for a stone
    that should rest, the one that carries to the target.

    Parameters
    ----------
    call : call with a target
    believed : ice that the team believed in
    place : place of the throw in its session
    spin : intended spin, unless turns were called [rad/s]
    x : crossing of the hog line [m]
    speed : intended speed of a hit, unless a time was called [m/s]

    Raises
    ------
    InputError : no throw on this ice reaches the call
    """
    solver = _Solver(call, believed, place, speed)
    throw = solver.solve(spin, x)
    slopes = np.column_stack(
        [
            (solver.solve(spin + 0.05, x, throw) - throw) / 0.05,
            (solver.solve(spin, x + 0.05, throw) - throw) / 0.05,
        ]
    )
    return Intended(throw=throw, slopes=slopes, outcome=solver.outcomes(throw[None])[0])


class _Solver:
    def __init__(self, call: Call, believed: Ice, place: Place, speed: float) -> None:
        if call.target is None:
            raise InputError(f"the call {call.text[:40]!r} names no target")
        self._call, self._ice, self._place, self._speed = call, believed, place, speed
        self._target = np.array(call.target)
        self._line = None if call.rests else float(self._target[1])

    def outcomes(self, throws: Floats) -> Floats:
        """Return the outcomes of throws (n, 4) on the believed ice, (n, 2)."""
        return outcomes(self._ice, throws, self._place, self._line)

    def solve(self, spin: float, x: float, near: Floats | None = None) -> Floats:
        """Return the throw (4,) with this spin from this place."""
        free = [SPEED, ANGLE]
        if self._call.turns is not None:
            free.append(SPIN)
        throw = self._start(spin, x) if near is None else near.copy()
        if near is not None:
            throw[X] = x
            if SPIN not in free:
                throw[SPIN] = spin
        left = self._left(throw[None], x)[0]
        for _ in range(_ROUNDS):
            if np.abs(left).max() < 0.05 * _EXACT:
                break
            tried = np.vstack([throw + _unit(k) * _STEPS[k] for k in free])
            slopes = ((self._left(tried, x) - left).T) / _STEPS[free]
            if not np.isfinite(slopes).all():
                break
            change = np.linalg.lstsq(slopes, -left, rcond=None)[0]
            change = np.clip(change, -_LARGEST[free], _LARGEST[free])
            for damping in (1.0, 0.3, 0.1):
                moved = throw.copy()
                moved[free] += damping * change
                moved[SPEED] = np.clip(moved[SPEED], _SLOWEST, 0.99 * MAX_SPEED)
                after = self._left(moved[None], x)[0]
                if np.isfinite(after).all() and np.abs(after).max() < np.abs(left).max():
                    throw, left = moved, after
                    break
            else:
                break
        if not np.abs(left).max() < 10 * _EXACT:
            raise InputError(f"no throw on the believed ice reaches the call: {self._call.text}")
        return throw

    def _start(self, spin: float, x: float) -> Floats:
        """Return the best of a table of straight throws, turned towards the target."""
        throws = np.tile([0.0, 0.0, spin, x], (len(_SPEEDS), 1))
        throws[:, SPEED] = _SPEEDS
        ends = self.outcomes(throws)
        if self._call.hog_to_hog is not None:
            off = np.abs(hog_times(self._ice, throws, self._place) - self._call.hog_to_hog)
        elif self._line is not None:
            off = np.abs(_SPEEDS - self._speed)
        else:
            off = np.abs(ends[:, 1] - self._target[1])
        if not np.isfinite(off).any():
            raise InputError("no throw reaches the target on the believed ice")
        throw = throws[int(np.nanargmin(off))].copy()
        right = ends[int(np.nanargmin(off)), 0]
        wanted = self._target[0] - (right if np.isfinite(right) else x) + x
        throw[ANGLE] = angle_to_tee(wanted if self._call.broom is None else self._call.broom, x)
        return throw

    def _left(self, throws: Floats, x: float) -> Floats:
        """Return the residuals of throws (n, 4) for each requirement, (n, 2) or (n, 3)."""
        call = self._call
        ends = self.outcomes(throws)
        if call.broom is None:
            line = ends[:, 0] - self._target[0]
        else:
            line = 30.0 * (throws[:, ANGLE] - angle_to_tee(call.broom, x))
        if call.hog_to_hog is not None:
            weight = hog_times(self._ice, throws, self._place) - call.hog_to_hog
        elif self._line is not None:
            weight = throws[:, SPEED] - self._speed
        else:
            weight = ends[:, 1] - self._target[1]
        wishes = [weight, line]
        if call.turns is not None:
            wishes.append(turns(self._ice, throws, self._place) - call.turns)
        return np.column_stack(wishes)


def _unit(k: int) -> Floats:
    unit = np.zeros(4)
    unit[k] = 1.0
    return unit


@dataclass(frozen=True, kw_only=True)
class Habits:
    """Usual rotation and speeds of athletes.

    Parameters
    ----------
    spins : |spin| of throws, by athlete [rad/s]; the empty name has those of all athletes
    speeds : speeds of hits by athlete and named weight [m/s]; likewise
    """

    spins: Mapping[str, Sequence[float]]
    speeds: Mapping[tuple[str, str], Sequence[float]]

    def spin(self, athlete: str) -> Measured | None:
        """Return the usual rotation, without sign; None with too few throws."""
        return _usual(self.spins.get(athlete, ())) or _usual(self.spins.get("", ()))

    def speed(self, athlete: str, call: Call) -> Measured | None:
        """Return the usual speed of a hit of this weight; None with too few throws."""
        if call.weight is None:
            return None
        return _usual(self.speeds.get((athlete, call.weight), ())) or _usual(
            self.speeds.get(("", call.weight), ())
        )


def habits_of(throws: Sequence[tuple[ThrowSheet, Released]]) -> Habits:
    """Collect the habits of all athletes from the throws of a session."""
    spins: dict[str, list[float]] = {"": []}
    speeds: dict[tuple[str, str], list[float]] = {}
    for sheet, released in throws:
        names = {sheet.athlete, ""}
        for name in names:
            if released.spin_seen:
                spins.setdefault(name, []).append(abs(float(released.throw[SPIN])))
            if sheet.call is not None and sheet.call.weight is not None:
                speed = float(released.throw[SPEED])
                speeds.setdefault((name, sheet.call.weight), []).append(speed)
    return Habits(spins=spins, speeds=speeds)


def _usual(values: Sequence[float]) -> Measured | None:
    """Return the median of enough values, and its standard error."""
    if len(values) < HABIT_THROWS:
        return None
    array = np.array(values)
    count = len(array)
    # Standard error of the median for Gaussian values, plus the uncertainty of the spread of few
    # values.
    wider = 1.25 * ((count - 1) / max(count - 3, 1)) ** 0.5
    return Measured(float(np.median(array)), wider * float(array.std(ddof=1)) / count**0.5)
