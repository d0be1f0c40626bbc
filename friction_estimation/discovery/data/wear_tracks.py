"""Where the stones of a session ran: what they may have worn, for those that came after them.

Every throw wears the ice, whether or not it is among those that are searched: a session keeps the
lanes of all of them however it is split.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from curling_env.physics.wear import WORN_WIDTH, passes_over
from curling_env.sheet import Sheet
from curling_env.typing import Floats

STRIDE = 0.2
"""Distance of the points that a lane is kept by [m]: a measured stone at rest trembles, and must
not wear the ice by that."""
LONGEST = 60.0
"""Longest lane [m], half as long again as the sheet: what goes further is no stone's path."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Lanes:
    """Where stones ran.

    Parameters
    ----------
    orders : (p,) throws already played before each lane's
    paths : (n, 2) each, sheet frame [m]
    """

    orders: NDArray[np.intp] = field(default_factory=lambda: np.empty(0, dtype=np.intp))
    paths: tuple[Floats, ...] = ()
    _worked_out: dict[Sheet, Floats] = field(default_factory=dict, repr=False)

    @classmethod
    def of(cls, measured: Iterable[tuple[int, Floats]]) -> Lanes:
        """Lanes of measured throws, by order and positions (n, 2) [m]."""
        kept = [(order, path) for order, xy in measured if (path := _lane(xy)) is not None]
        kept.sort(key=lambda entry: entry[0])
        orders = np.array([order for order, _ in kept], dtype=np.intp)
        return cls(orders=orders, paths=tuple(path for _, path in kept))

    def before(self, orders: NDArray[np.intp]) -> NDArray[np.intp]:
        """How many of the lanes were there before each of some throws, (k,)."""
        return np.searchsorted(self.orders, orders, side="left")

    def passes(self, sheet: Sheet) -> Floats:
        """Passes over each cell once so many lanes were there, (p + 1, rows, columns)."""
        if sheet not in self._worked_out:
            each = [np.zeros(sheet.shape), *(passes_over(sheet, [path]) for path in self.paths)]
            self._worked_out[sheet] = np.cumsum(each, axis=0)
        return self._worked_out[sheet]


def times_to_tell_lanes_apart(sheet: Sheet) -> int:
    """Into how many a cell is divided, to be no wider than a lane; odd (`Ice.refined`)."""
    times = math.ceil(sheet.cell_size / WORN_WIDTH)
    return times + 1 - times % 2


def _lane(xy: Floats) -> Floats | None:
    """Points of a path, a stride from one to the next; None if it is no stone's path."""
    if len(xy) == 0:
        return None
    kept = [xy[0]]
    for point in xy:
        if np.hypot(*(point - kept[-1])) >= STRIDE:
            kept.append(point)
    path = np.array(kept)
    length = float(np.hypot(*np.diff(path, axis=0).T).sum())
    return path if len(path) > 1 and length <= LONGEST else None
