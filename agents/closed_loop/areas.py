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

NOTABLE = 0.03
"""Difference from the mean that a curler would call heavy or keen: 3 %, a metre of draw weight."""
SURE = 2.0
"""Standard errors by which a cell must differ."""
LEAST_CELLS = 6
"""Cells that make an area: with the paper's cells, 1.5 m²."""
CENTRE_STRIP = 0.35
"""Areas whose middle lies within this of the centre line are called central [m]."""


@dataclass(frozen=True, kw_only=True)
class Area:
    """Connected cells that differ from the rest of the ice in one sense.

    Parameters
    ----------
    cells : (rows, columns) which they are
    difference : mean friction in it over the mean of the ice, less one
    sigma : standard error of that, errors of neighbouring cells taken as fully alike
    y_low, y_high : where it begins and ends along the sheet [m]
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
        """Where it is, seen by one who throws from the home end."""
        if abs(self.x) <= CENTRE_STRIP:
            side = "around the centre line"
        else:
            side = f"{'right' if self.x > 0 else 'left'} of the centre line"
        return f"{side}, {_along(self.y_low)} to {_along(self.y_high)}"


def relative(values: Floats, observed: Flags) -> Floats:
    """Friction over its mean in the observed cells, less one."""
    return values / values[observed].mean() - 1.0


def find_areas(ice: Ice) -> list[Area]:
    """Heavy and keen areas among the observed cells, the most different first."""
    friction, sheet = ice.friction, ice.sheet
    observed = friction.observed
    if not observed.any():
        return []
    difference = relative(friction.mu, observed)
    sigma = friction.sigma / friction.mu[observed].mean()
    x, y = np.meshgrid(sheet.x_centres, sheet.y_centres)
    areas: list[Area] = []
    for sign in (1.0, -1.0):
        clear = observed & (sign * difference > np.maximum(NOTABLE, SURE * sigma))
        groups, count = cast("tuple[NDArray[np.int32], int]", label(clear))
        for k in range(1, count + 1):
            cells = groups == k
            if cells.sum() < LEAST_CELLS:
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


def _along(y: float) -> str:
    """A place along the sheet, thrown from the home end."""
    if y < -HOG_LINE_Y:
        return f"{-HOG_LINE_Y - y:.0f} m before the near hog line"
    if y < -1.0:
        return f"{y + HOG_LINE_Y:.0f} m past the near hog line"
    if y <= 1.0:
        return "mid-sheet"
    if y < HOG_LINE_Y:
        return f"{HOG_LINE_Y - y:.0f} m short of the far hog line"
    if y < TEE_Y:
        return f"{TEE_Y - y:.0f} m short of the far tee"
    return f"{y - TEE_Y:.0f} m past the far tee"
