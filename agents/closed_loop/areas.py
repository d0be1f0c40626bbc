"""Heavy and keen areas of a friction map, in a curler's words."""

from __future__ import annotations

from dataclasses import dataclass
from typing import cast

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import label

from curling_env.ice import Ice
from curling_env.sheet import HOG_LINE_Y, TEE_Y
from curling_env.typing import Flags, Floats
from curling_env.units import FOOT, Units

MIN_DIFFERENCE = 0.03
"""Relative difference from the mean that a curler notices: 3 %, a metre of draw weight."""
MIN_STANDARD_ERRORS = 2.0
"""Number of standard errors by which a cell must differ from the mean."""
MIN_CELLS = 6
"""Minimum number of connected cells in an area; 1.5 m² in cells of 0.5 m."""


@dataclass(frozen=True, kw_only=True)
class Area:
    """Connected cells that are all heavier, or all keener, than the rest of the ice.

    Parameters
    ----------
    cells : (rows, columns) true in the cells of the area
    difference : mean friction in the area over the mean of the ice, minus one
    sigma : standard error of the difference, with errors of neighbouring cells fully correlated
    y_low, y_high : its limits along the sheet [m]
    x : its middle across the sheet [m]
    """

    cells: Flags
    difference: float
    sigma: float
    y_low: float
    y_high: float
    x: float

    @property
    def kind(self) -> str:
        """``heavy`` or ``keen``."""
        return "heavy" if self.difference > 0 else "keen"

    @property
    def place(self) -> str:
        """Position of the area for a thrower at the home end, in metres."""
        return self.place_in(Units.METRES)

    def place_in(self, units: Units) -> str:
        """Return the position of the area for a thrower at the home end."""
        if abs(self.x) <= 0.35:
            side = "around the centre line"
        else:
            side = f"{'right' if self.x > 0 else 'left'} of the centre line"
        return f"{side}, {_along(self.y_low, units)} to {_along(self.y_high, units)}"


def relative(values: Floats, observed: Flags) -> Floats:
    """Return the friction over its mean in the observed cells, minus one."""
    return values / values[observed].mean() - 1.0


def find_areas(ice: Ice) -> list[Area]:
    """Find heavy and keen areas among the observed cells, the most different first."""
    friction, sheet = ice.friction, ice.sheet
    observed = friction.observed
    if not observed.any():
        return []
    difference = relative(friction.mu, observed)
    sigma = friction.sigma / friction.mu[observed].mean()
    threshold = np.maximum(MIN_DIFFERENCE, MIN_STANDARD_ERRORS * sigma)
    x, y = np.meshgrid(sheet.x_centres, sheet.y_centres)
    areas: list[Area] = []
    for sign in (1.0, -1.0):
        clear = observed & (sign * difference > threshold)
        groups, count = cast("tuple[NDArray[np.int32], int]", label(clear))
        for k in range(1, count + 1):
            cells = groups == k
            if cells.sum() < MIN_CELLS:
                continue
            areas.append(
                Area(
                    cells=cells,
                    difference=float(difference[cells].mean()),
                    sigma=float(sigma[cells].mean()),
                    y_low=float(y[cells].min()) - sheet.cell_size / 2,
                    y_high=float(y[cells].max()) + sheet.cell_size / 2,
                    x=float(x[cells].mean()),
                )
            )
    return sorted(areas, key=lambda area: -abs(area.difference) * float(area.cells.sum()) ** 0.5)


def _along(y: float, units: Units) -> str:
    """Format a distance along the sheet for a thrower at the home end."""

    def away(metres: float) -> str:
        return f"{metres:.0f} m" if units is Units.METRES else f"{metres / FOOT:.0f} ft"

    if y < -HOG_LINE_Y:
        return f"{away(-HOG_LINE_Y - y)} before the near hog line"
    if y < -1.0:
        return f"{away(y + HOG_LINE_Y)} past the near hog line"
    if y <= 1.0:
        return "mid-sheet"
    if y < HOG_LINE_Y:
        return f"{away(HOG_LINE_Y - y)} short of the far hog line"
    if y < TEE_Y:
        return f"{away(TEE_Y - y)} short of the far tee"
    return f"{away(y - TEE_Y)} past the far tee"
