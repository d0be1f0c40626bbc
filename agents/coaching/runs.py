"""Simulated throws on ices: places of rest, line crossings, and times.

A throw is a row (speed, angle, spin, x), as in `agents.planning.rollouts`; places are from the
thrower's view, right of the centre line and past the tee played to.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from curling_env.ice import Ice
from curling_env.physics.batch import Rests, releases_of, throw_batch
from curling_env.physics.slides import NO_BOUNDS, SlideEnd
from curling_env.sheet import HOG_TO_FAR_TEE, HOG_TO_TEE, TEE_Y, Direction, to_delivery
from curling_env.typing import Floats, Indices

SPEED, ANGLE, SPIN, X = range(4)
"""Columns of a table of throws."""


@dataclass(frozen=True, kw_only=True)
class Place:
    """Place of a throw in its session, on which effects of the ice may depend.

    Parameters
    ----------
    direction : the end played to
    clock : start time [s]
    order : number of throws before it
    stone : number of its stone
    """

    direction: Direction = Direction.AWAY
    clock: float = 0.0
    order: int = 0
    stone: int = 0


def run(
    ices: Ice | Sequence[Ice],
    throws: Floats,
    place: Place,
    *,
    which: Indices | None = None,
    line: float | None = None,
    sweeps: Floats | None = None,
    fps: float | None = None,
    longest: float = 40.0,
    ahead: Floats | None = None,
) -> Rests:
    """Simulate throws (n, 4) on ices; in the sheet frame.

    Parameters
    ----------
    ices, which : as in `throw_batch`
    throws : (n, 4)
    place : place in the session of all of them
    line : line past the tee that ends a throw [m]
    sweeps : (n, 2) start and end of sweeping after the release [s]
    fps, longest : as in `throw_batch`
    ahead : (n,) start of each throw beyond the hog line [m]
    """
    table: NDArray[Any] = releases_of(throws, place.direction)
    table["clock"], table["order"], table["stone"] = place.clock, place.order, place.stone
    if ahead is not None:
        table["y"] += place.direction * ahead
    if sweeps is not None:
        table["sweep_start"], table["sweep_end"] = sweeps.T
    bounds = NO_BOUNDS.copy()
    if line is not None:
        bounds[3 if place.direction > 0 else 2] = place.direction * (line + TEE_Y)
    return throw_batch(ices, table, which=which, bounds=bounds, fps=fps, longest=longest)


def rests(
    ices: Ice | Sequence[Ice],
    throws: Floats,
    place: Place,
    *,
    which: Indices | None = None,
    sweeps: Floats | None = None,
) -> Floats:
    """Return the places of rest of throws, (n, 2): right, past [m]; NaN for one that never
    stops.
    """
    ends = run(ices, throws, place, which=which, sweeps=sweeps)
    xy = to_delivery(np.column_stack([ends.x, ends.y]), place.direction)
    return np.where((ends.end == SlideEnd.REST)[:, None], xy, np.nan)


def crossings(
    ices: Ice | Sequence[Ice],
    throws: Floats,
    place: Place,
    line: float,
    *,
    which: Indices | None = None,
    sweeps: Floats | None = None,
) -> tuple[Floats, Floats]:
    """Return the crossings of throws with a line across the sheet, (n,) right [m], and times, (n,)
    [s].

    NaN for one that does not reach it.

    Parameters
    ----------
    line : line past the tee [m]
    ices, throws, place, which, sweeps : as in `run`
    """
    ends = run(ices, throws, place, which=which, line=line, sweeps=sweeps)
    there = ends.end == SlideEnd.LEFT_BOUNDS
    return (
        np.where(there, place.direction * ends.x, np.nan),
        np.where(there, ends.time, np.nan),
    )


def hog_times(ices: Ice | Sequence[Ice], throws: Floats, place: Place) -> Floats:
    """Return times from hog line to hog line, (n,) [s]; NaN for a throw that stops before."""
    return crossings(ices, throws, place, -HOG_TO_TEE)[1]


def turns(ices: Ice | Sequence[Ice], throws: Floats, place: Place) -> Floats:
    """Return the number of full turns until rest, (n,), without sign."""
    return np.abs(run(ices, throws, place).theta) / (2 * np.pi)


def outcomes(
    ices: Ice | Sequence[Ice],
    throws: Floats,
    place: Place,
    line: float | None,
    *,
    which: Indices | None = None,
    sweeps: Floats | None = None,
) -> Floats:
    """Return the outcomes of throws, (n, 2): place of rest, or crossing of a line [m].

    Parameters
    ----------
    line : line past the tee, for hits; None for throws that should rest
    ices, throws, place, which, sweeps : as in `run`
    """
    if line is None:
        return rests(ices, throws, place, which=which, sweeps=sweeps)
    right, _ = crossings(ices, throws, place, line, which=which, sweeps=sweeps)
    return np.column_stack([right, np.where(np.isnan(right), np.nan, line)])


def angle_to_tee(broom: float, x: float) -> float:
    """Return the line of delivery from x on the hog line to a broom on the far tee line [rad]."""
    return float(np.arctan2(x - broom, HOG_TO_FAR_TEE))
