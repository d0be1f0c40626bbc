"""Number and kinds of throws needed for a map of a given detail.

Throws are chosen one by one, each of the kind that leaves the smallest error over the ice in play
(greedy A-optimal design by the Cramér–Rao bound). The estimator comes within some 10 % of that
bound; if friction varies from throw to throw, more throws are needed.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from curling_env.errors import InputError
from curling_env.physics.motion import GRAVITY
from curling_env.sheet import HOG_LINE_Y, PAPER_SHEET, TEE_Y, Direction, Sheet
from curling_env.throw import MAX_SPEED, Release, Throw
from curling_env.typing import Flags, Floats, Indices, Progress, no_progress
from curling_env.units import FOOT, Units
from curling_env.units import speed as speed_in
from friction_estimation.design.cramer_rao import (
    ThrowResponse,
    check_positive,
    field_covariance,
    throw_response,
    uniform_bound,
)

_MAX_THROWS = 200
"""Maximum number of throws of a design."""
_MAX_CELLS = 4000
"""Maximum number of cells: their covariance takes 128 MB."""
_HALF_WIDTH_PLAYED = 1.5
"""Half-width of the ice in play [m]. A draw curls by at most a metre and a half, and few throws
come nearer to the side."""
_SPEEDS_TRIED = (0.8, 1.0, 1.25)
"""Default speeds, as multiples of the speed of a draw to the tee."""


@dataclass(frozen=True, kw_only=True)
class ThrowKind:
    """A kind of throw: its speed [m/s], its line beside the centre line [m], and its direction."""

    speed: float
    line: float
    direction: Direction

    @property
    def release(self) -> Release:
        """Its release at the hog line, straight along the sheet."""
        return Throw(speed=self.speed, x=self.direction * self.line).release(self.direction)


@dataclass(frozen=True, kw_only=True)
class Design:
    """The throws of a planned measurement.

    Parameters
    ----------
    resolution, precision : wanted detail [m] and wanted error [part of μ]
    kinds : every throw in the order chosen
    error : (throws,) root-mean-square error of μ over the ice played on after each throw [part of
        μ]
    even_error : error of one number for the whole sheet from the same throws [part of μ]
    """

    resolution: float
    precision: float
    kinds: tuple[ThrowKind, ...]
    error: tuple[float, ...]
    even_error: float

    @property
    def reached(self) -> bool:
        """True if the throws reach the wanted precision."""
        return self.error[-1] <= self.precision

    @property
    def counts(self) -> dict[ThrowKind, int]:
        """Number of throws of each kind, the most frequent first."""
        return dict(Counter(self.kinds).most_common())

    def in_words(self, units: Units = Units.METRES) -> str:
        """Return the design in plain words, with lengths and speeds in these units."""
        n = len(self.kinds)
        feet = units is Units.FEET
        unit, name = (FOOT, "ft") if feet else (1.0, "m")
        detail = f"{self.resolution / unit:{'.1f' if feet else 'g'}} {name}"
        wanted = f"{100 * self.precision:g} % at a resolution of {detail}"
        if not self.reached:
            return (
                f"{wanted} is out of reach: {n} throws give {100 * self.error[-1]:.2g} %; choose "
                "a coarser resolution, more exact positions, or slower throws"
            )
        by_speed = sorted(Counter(kind.speed for kind in self.kinds).items())
        speeds = ", ".join(f"{count} at {speed_in(speed, units)}" for speed, count in by_speed)
        away = sum(kind.direction is Direction.AWAY for kind in self.kinds)
        lines = sorted({kind.line for kind in self.kinds})
        beside = [f"{line / unit:{'+.1f' if feet else '+g'}}" if line else "0" for line in lines]
        where = ", ".join(beside).replace("-", "−")
        return (
            f"{wanted} takes {n} {'throw' if n == 1 else 'throws'}: {speeds}; {away} of them from "
            f"the home end and {n - away} from the away end; on lines {where} {name} beside "
            "the centre line. Throw half of them with the in-turn and half with the out-turn."
        )

    def summary(self) -> dict[str, Any]:
        """Return the design in numbers, for JSON."""
        return {
            "resolution_m": self.resolution,
            "precision_percent": 100 * self.precision,
            "reached": self.reached,
            "throws": len(self.kinds),
            "error_percent": 100 * self.error[-1],
            "error_of_one_number_percent": 100 * self.even_error,
            "error_percent_after_throws": [round(100 * error, 4) for error in self.error],
            "kinds": [
                {
                    "times": times,
                    "speed": kind.speed,
                    "from": "home" if kind.direction is Direction.AWAY else "away",
                    "line_x_m": kind.line,
                }
                for kind, times in self.counts.items()
            ],
            "words": self.in_words(),
        }


def draw_speeds(mu: float) -> tuple[float, ...]:
    """Speed of a draw to the tee on ice of this friction, and a slower and a faster one [m/s]."""
    draw = float(np.sqrt(2 * GRAVITY * mu * (TEE_Y + HOG_LINE_Y)))
    return tuple(round(min(part * draw, MAX_SPEED), 2) for part in _SPEEDS_TRIED)


def design_throws(
    *,
    resolution: float,
    precision: float,
    noise: float = 0.005,
    fps: float = 30.0,
    mu: float = 0.009,
    speeds: Sequence[float] | None = None,
    spread: float = 0.05,
    sheet: Sheet = PAPER_SHEET,
    progress: Progress = no_progress,
) -> Design:
    """Choose the fewest throws that measure the friction of the ice with a wanted error.

    Friction is assumed to vary by `spread` and to be alike over `resolution`. The error is the
    root-mean-square error of a cell's μ over the ice between the tees and within 1.5 m of the
    centre line.

    Parameters
    ----------
    resolution : wanted detail, the length over which friction is alike [m]
    precision : wanted error of μ, as a part of it
    noise : standard deviation of a measured position [m], independent from frame to frame
    fps : frames a second
    mu : expected friction
    speeds : speeds that can be thrown [m/s]; around a draw to the tee by default
    spread : standard deviation of ln μ over the sheet; sheets vary by 2 to 5 %
    sheet : sheet with its cells
    progress : called after each throw chosen

    Raises
    ------
    InputError : numbers that make no sense, or detail finer than a cell or than can be weighed
    """
    check_positive(
        resolution=resolution, precision=precision, noise=noise, fps=fps, mu=mu, spread=spread
    )
    if resolution < sheet.cell_size:
        raise InputError(
            f"the resolution cannot be finer than a cell of {sheet.cell_size:g} m, "
            f"got {resolution:g} m"
        )
    sheet = _coarse_enough(sheet, resolution)
    chosen = tuple(speeds) if speeds else draw_speeds(mu)
    kinds = [
        ThrowKind(speed=speed, line=line, direction=direction)
        for speed in chosen
        for line in _lines(resolution)
        for direction in (Direction.AWAY, Direction.HOME)
    ]
    rows = [
        _informative_rows(throw_response(kind.release, mu=mu, fps=fps, sheet=sheet), noise)
        for kind in kinds
    ]
    covariance = field_covariance(sheet, spread=spread, length=resolution)
    played = np.flatnonzero(_played(sheet))
    thrown: list[int] = []
    errors: list[float] = []
    while len(thrown) < _MAX_THROWS:
        best = first_of_best([variance_removed(covariance, row, played) for row in rows])
        covariance = covariance_after(covariance, rows[best])
        thrown.append(best)
        errors.append(float(np.sqrt(np.diag(covariance)[played].mean())))
        progress("choose throws", min(1.0, precision / errors[-1]))
        if errors[-1] <= precision:
            break
    listed = tuple(kinds[k] for k in thrown)
    thrown_speeds, seen = [kind.speed for kind in listed], HOG_LINE_Y + TEE_Y
    even = uniform_bound(thrown_speeds, mu=mu, noise=noise, fps=fps, distance=seen)
    return Design(
        resolution=resolution,
        precision=precision,
        kinds=listed,
        error=tuple(errors),
        even_error=even / mu,
    )


def _coarse_enough(sheet: Sheet, resolution: float) -> Sheet:
    """Return the sheet with cells no finer than the detail requires.

    Raises
    ------
    InputError : more cells than the covariance matrix may have
    """
    side = max(sheet.cell_size, min(resolution / 2, PAPER_SHEET.cell_size))
    coarse = replace(sheet, cell_size=side)
    cells = coarse.shape[0] * coarse.shape[1]
    if cells > _MAX_CELLS:
        raise InputError(
            f"a resolution of {resolution:g} m needs {cells} cells on this sheet; expected at "
            f"most {_MAX_CELLS}: choose a coarser resolution"
        )
    return coarse


def _lines(resolution: float) -> Floats:
    """Positions of lines over the ice in play, at most the detail or 1 m apart [m]."""
    count = 1 + 2 * int(np.ceil(_HALF_WIDTH_PLAYED / min(resolution, 1.0)))
    return np.linspace(-_HALF_WIDTH_PLAYED, _HALF_WIDTH_PLAYED, count)


def _played(sheet: Sheet) -> Flags:
    """Cells between the tees on the ice in play, (cells,)."""
    x = np.tile(sheet.x_centres, sheet.shape[0])
    y = np.repeat(sheet.y_centres, sheet.shape[1])
    return (np.abs(x) <= _HALF_WIDTH_PLAYED) & (np.abs(y) <= TEE_Y)


def _informative_rows(throw: ThrowResponse, noise: float) -> Informative:
    """Response in units of the noise, compressed to its informative directions."""
    _, size, across = np.linalg.svd(throw.response / noise, full_matrices=False)
    informed = size > 0.3  # a smaller one explains less than a tenth of the variance of any cell
    return Informative(throw.touched, size[informed, None] * across[informed])


# --- next throw: the variance that it would remove ------------------------------------------------


class Informative(NamedTuple):
    """Information of one throw.

    Parameters
    ----------
    touched : (t,) the unknowns that it depends on
    rows : (r, t) what it measures of them, in units of the noise
    """

    touched: Indices
    rows: Floats


def variance_removed(
    covariance: Floats, throw: Informative, counted: Indices, weights: Floats | None = None
) -> float:
    """Fall of the weighted sum of variances by one throw.

    Parameters
    ----------
    covariance : (P, P) of the unknowns before it
    throw : what it tells
    counted : (c,) the unknowns whose variances count
    weights : (c,) weights of these; all alike by default
    """
    across = covariance[np.ix_(counted, throw.touched)] @ throw.rows.T
    removed = across * np.linalg.solve(_inner(covariance, throw), across.T).T
    return float((removed if weights is None else weights[:, None] * removed).sum())


def first_of_best(gains: Sequence[float]) -> int:
    """Return the index of the largest gain; the first of several that differ by rounding alone.

    Mirror images teach the same, and which rounds up differs from one processor to another.
    """
    return int(np.flatnonzero(np.array(gains) >= (1 - 1e-9) * max(gains))[0])


def covariance_after(covariance: Floats, throw: Informative) -> Floats:
    """Return the covariance of the unknowns after a throw, (P, P)."""
    spreading = covariance[:, throw.touched] @ throw.rows.T
    return covariance - spreading @ np.linalg.solve(_inner(covariance, throw), spreading.T)


def _inner(covariance: Floats, throw: Informative) -> Floats:
    """Covariance of what the throw measures, noise included."""
    own = covariance[np.ix_(throw.touched, throw.touched)]
    return np.eye(len(throw.rows)) + throw.rows @ own @ throw.rows.T
