"""Sheet and stone: every measured length, the cells, and the two frames.

*Sheet frame*: fixed to the ice, origin mid-sheet on the centre line, y from the home end to the
away end, x to the right looking along +y, counter-clockwise positive. Maps and tracks are in this
frame.

*Delivery frame*: origin at the playing tee, +y along the direction of play. Actions and
observations are in this frame. The two differ by a half-turn or not at all, and only this module
converts.

Lengths are in metres and those of the World Curling rule book (R1, "Sheet") unless noted otherwise.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import ArrayLike

from curling_env.errors import InputError
from curling_env.typing import Flags, Floats, Indices, Integers

TEE_Y = 17.3735
"""Distance of each tee from mid-sheet [m]."""
HOG_LINE_Y = 10.9725
"""Distance of each hog line's sheet-side edge from mid-sheet [m]."""
BACK_LINE_Y = TEE_Y + 1.829
"""Distance of each back line from mid-sheet [m]."""
HACK_Y = BACK_LINE_Y + 1.829
"""Distance of each hack from mid-sheet [m]."""
HOG_TO_TEE = TEE_Y - HOG_LINE_Y
"""Distance from a hog line to the tee of the same end [m]."""
HOG_TO_FAR_TEE = HOG_LINE_Y + TEE_Y
"""Distance from a hog line to the tee of the other end [m]."""

HOUSE_RADIUS = 1.829
"""Outer radius of the 12-foot ring [m]."""
RING_RADII = (1.829, 1.219, 0.610, 0.152)
"""Outer radii of the 12-, 8- and 4-foot rings and of the button [m]."""
HOG_LINE_WIDTH = 0.1016
"""Width of a painted hog line [m]."""
LINE_WIDTH = 0.0127
"""Width of a painted tee, back or centre line [m]."""


MAX_LENGTH = 500.0
"""Longest sheet accepted [m]."""
MAX_CELLS = 1e7
"""Maximum number of cells of a sheet; at the usual 0.5 m there are 801."""
STONE_BOUNDS = {
    "mass": (0.1, 1000.0),
    "radius": (0.01, 1.0),
    "height": (0.001, 1.0),
    "inertia": (1e-6, 1000.0),
    "restitution": (0.0, 1.0),
    "stone_friction": (0.0, 100.0),
}
"""Bounds of a stone's values in their units, far beyond the rule book's."""


class Direction(IntEnum):
    """End that is played to."""

    AWAY = 1
    """From the home end towards +y."""
    HOME = -1
    """From the away end towards -y."""


@dataclass(frozen=True, kw_only=True)
class Sheet:
    """Sheet of ice divided into square cells.

    Parameters
    ----------
    length, width : size of the ice [m]
    cell_size : side of a friction cell [m]

    Raises
    ------
    InputError : a length that is not positive, or a sheet too small for both houses

    Source
    ------
    Default: the paper's table 1, 44.5 × 4.5 m in 9 × 89 cells of 0.5 m.
    """

    length: float = 44.5
    width: float = 4.5
    cell_size: float = 0.5

    def __post_init__(self) -> None:
        least = 2 * BACK_LINE_Y, 2 * HOUSE_RADIUS
        if not (least[0] <= self.length <= MAX_LENGTH and least[1] <= self.width <= MAX_LENGTH):
            raise InputError(
                f"a sheet must fit both houses, at least {least[0]:.2f} × {least[1]:.2f} m, and "
                f"be at most {MAX_LENGTH:g} m long and wide, got {self.length} × {self.width} m"
            )
        if not 0 < self.cell_size <= self.width:
            raise InputError(
                f"cell_size must be above 0 and at most the sheet's width, got {self.cell_size} m"
            )
        if self.length * self.width / self.cell_size**2 > MAX_CELLS:
            raise InputError(
                f"cells of {self.cell_size} m are too small; expected at most {MAX_CELLS:g} cells"
            )

    @property
    def shape(self) -> tuple[int, int]:
        """Number of rows (along y) and columns (along x) of cells, including a partial last
        cell.
        """
        return (
            int(np.ceil(self.length / self.cell_size - 1e-9)),
            int(np.ceil(self.width / self.cell_size - 1e-9)),
        )

    @property
    def x_centres(self) -> Floats:
        """Cell centres across the sheet, shape (columns,) [m]."""
        cells = np.arange(self.shape[1], dtype=np.float64)
        return -self.width / 2 + (cells + 0.5) * self.cell_size

    @property
    def y_centres(self) -> Floats:
        """Cell centres along the sheet, shape (rows,) [m]."""
        cells = np.arange(self.shape[0], dtype=np.float64)
        return -self.length / 2 + (cells + 0.5) * self.cell_size

    def cell_of(self, xy: ArrayLike) -> tuple[Indices, Indices]:
        """Return row and column of the cell of each point.

        Parameters
        ----------
        xy : (..., 2) points in the sheet frame [m]; points off the ice take the nearest cell
        """
        points = np.asarray(xy, dtype=np.float64)
        rows, columns = self.shape
        row = np.floor((points[..., 1] + self.length / 2) / self.cell_size)
        column = np.floor((points[..., 0] + self.width / 2) / self.cell_size)
        return (
            np.clip(row, 0, rows - 1).astype(np.intp),
            np.clip(column, 0, columns - 1).astype(np.intp),
        )

    def cells_around(
        self, xy: ArrayLike
    ) -> tuple[tuple[Indices, Indices], tuple[Indices, Indices], Floats, Floats]:
        """Return the four cells around each point for bilinear interpolation.

        Parameters
        ----------
        xy : (..., 2) points in the sheet frame [m]; points beyond the outermost centres take their
            value

        Returns
        -------
        rows, columns : of the cells before and after each point
        u, v : its position between the two rows and columns, 0 to 1
        """
        points = np.asarray(xy, dtype=np.float64)
        rows, columns = self.shape
        row = np.clip((points[..., 1] - self.y_centres[0]) / self.cell_size, 0, rows - 1)
        column = np.clip((points[..., 0] - self.x_centres[0]) / self.cell_size, 0, columns - 1)
        i = np.minimum(row.astype(np.intp), max(rows - 2, 0))
        j = np.minimum(column.astype(np.intp), max(columns - 2, 0))
        after = np.minimum(i + 1, rows - 1), np.minimum(j + 1, columns - 1)
        return (i, after[0]), (j, after[1]), row - i, column - j

    def contains(self, xy: ArrayLike) -> Flags:
        """Return whether each point is on the ice; `xy` (..., 2) in the sheet frame [m]."""
        points = np.abs(np.asarray(xy, dtype=np.float64))
        return (points[..., 0] <= self.width / 2) & (points[..., 1] <= self.length / 2)

    @property
    def corners(self) -> dict[str, tuple[float, float]]:
        """Return the four corners of the ice by their names in a scene file, sheet frame [m]."""
        x, y = self.width / 2, self.length / 2
        return {
            "home_left": (-x, -y),
            "home_right": (x, -y),
            "away_left": (-x, y),
            "away_right": (x, y),
        }


PAPER_SHEET = Sheet()
"""The paper's sheet: 44.5 × 4.5 m, 9 × 89 cells of 0.5 m (its table 1)."""
WORLD_CURLING_SHEET = Sheet(length=45.720, width=4.750)
"""The rule book's sheet: 45.720 × 4.750 m."""


def tee(direction: Direction) -> Floats:
    """Return the centre of the house played to, sheet frame, shape (2,) [m]."""
    return np.array([0.0, direction * TEE_Y])


_TEE = np.array([0.0, TEE_Y])


def to_delivery(xy: ArrayLike, direction: Direction | Integers) -> Floats:
    """Convert points (..., 2) from the sheet frame to the delivery frame [m].

    Parameters
    ----------
    xy : points in the sheet frame [m]
    direction : one for all points, or an array of 1 (away) and -1 (home) that broadcasts with xy
    """
    return direction * np.asarray(xy, dtype=np.float64) - _TEE


def to_sheet(xy: ArrayLike, direction: Direction | Integers) -> Floats:
    """Convert points (..., 2) from the delivery frame to the sheet frame [m]; see `to_delivery`."""
    return direction * (np.asarray(xy, dtype=np.float64) + _TEE)


@dataclass(frozen=True, kw_only=True)
class Stone:
    """Curling stone.

    Parameters
    ----------
    mass : mass with the handle [kg]
    radius : radius of the body seen from above [m]
    height : height of the body above the ice, without the handle [m]
    band_radius : radius of the running band, the ring that touches the ice [m]; 0 makes the contact
        a point, so that friction acts on the centre's velocity only and never turns the stone
    inertia : moment of inertia about the vertical axis [kg m²]; a lone stone's motion depends only
        on mass·band_radius²/inertia
    restitution : restitution of a collision of two stones, 0 to 1
    stone_friction : Coulomb friction between two stones

    Raises
    ------
    InputError : a value out of range for a stone

    Source
    ------
    Mass 19.1 kg with handle, radius 0.145 m (circumference ≤0.914 m), height ≥0.1143 m: rule book
    C1. Running band about 12 cm across. Inertia ½mR², known to ±10 %. Restitution 0.85: no
    measurement is published, simulators use 0.5 to 1. Stone friction 0.2: other simulators' choice.
    """

    mass: float = 19.1
    radius: float = 0.145
    height: float = 0.1143
    band_radius: float = 0.0625
    inertia: float = 0.2008
    restitution: float = 0.85
    stone_friction: float = 0.2

    def __post_init__(self) -> None:
        bounds = STONE_BOUNDS | {"band_radius": (0.0, self.radius)}
        for name, (low, high) in bounds.items():
            value = getattr(self, name)
            if not low <= value <= high:
                raise InputError(f"stone {name} must be between {low:g} and {high:g}, got {value}")

    @property
    def spin_coupling(self) -> float:
        """Coupling of sliding friction to the spin: mass·band_radius²/inertia."""
        return self.mass * self.band_radius**2 / self.inertia


RULE_BOOK_STONE = Stone()
"""Stone of the World Curling rule book."""
PAPER_STONE = Stone(mass=19.96, radius=0.105, height=0.15, inertia=0.5 * 19.96 * 0.105**2)
"""Stone of the paper's table 2: 19.96 kg, 0.21 m across, 0.15 m high with the handle.

The diameter is far from the rule book's 0.29 m; it is kept because the paper's tables use it.
"""
