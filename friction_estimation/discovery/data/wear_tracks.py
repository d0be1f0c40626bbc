"""Paths of the stones of a session, which wear the ice for later stones.

Every throw wears the ice, including excluded ones: each part of a session keeps the wear tracks of
all throws.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np
from scipy.ndimage import median_filter

from curling_env.physics.wear import passes_over
from curling_env.sheet import Sheet
from curling_env.typing import Floats, Indices
from curling_env.worn_tracks import WORN_WIDTH, WornTracks
from friction_estimation.discovery.data.outliers import robust_deviation, slow_basis
from friction_estimation.discovery.tuning import LEAST_ROWS, OUTLIER_DEVIATIONS

POINT_SPACING = 0.2
"""Distance between the kept points of a path [m]: the jitter of a stone at rest must not count as
wear."""
SMOOTHED_PERIODS = (8.0, 4.0, 2.0)
"""Shortest period of a smoothed path, and the next choice if the first does not fit [s]."""
FURTHEST_ASIDE = WORN_WIDTH / 4
"""Maximum distance of a smoothed path from the places where the stone was seen [m]."""
LONGEST_PATH = 60.0
"""Maximum length of a path [m]: 1.5 times the sheet's."""


@dataclass(frozen=True, kw_only=True, eq=False)
class WearTracks:
    """Paths on which stones ran.

    Parameters
    ----------
    orders : (p,) for each path, how many throws had been played before it
    paths : (n, 2) each, sheet frame [m]
    """

    orders: Indices = field(default_factory=lambda: np.empty(0, dtype=np.intp))
    paths: tuple[Floats, ...] = ()
    _passes: dict[Sheet, Floats] = field(default_factory=dict, repr=False)
    _layers: dict[tuple[float, float], Floats] = field(default_factory=dict, repr=False)

    @classmethod
    def of(cls, measured: Iterable[tuple[int, Floats]]) -> WearTracks:
        """Return the wear tracks of measured throws.

        Parameters
        ----------
        measured : for each throw how many were played before it, and its positions (n, 2) [m]
        """
        kept = [(order, path) for order, xy in measured if (path := _path(xy)) is not None]
        kept.sort(key=lambda entry: entry[0])
        orders = np.array([order for order, _ in kept], dtype=np.intp)
        return cls(orders=orders, paths=tuple(path for _, path in kept))

    def before(self, orders: Indices) -> Indices:
        """Return the number of paths before each of some throws, (k,)."""
        return np.searchsorted(self.orders, orders, side="left")

    def passes(self, sheet: Sheet) -> Floats:
        """Passes over each cell by the first 0, 1, ... p stones, (p + 1, rows, columns)."""
        if sheet not in self._passes:
            each = [np.zeros(sheet.shape), *(passes_over(sheet, [path]) for path in self.paths)]
            self._passes[sheet] = np.cumsum(each, axis=0)
        return self._passes[sheet]

    def tracks(self, sheet: Sheet) -> tuple[WornTracks, Floats]:
        """Return the cells over which running bands passed, for wear under contacts.

        Returns
        -------
        the cells, after no stone, and the passes over them by the first 0, 1, ... p stones,
        (p + 1, rows, columns)
        """
        fresh = WornTracks.none(sheet)
        size = sheet.width, sheet.length
        if size not in self._layers:
            layers = np.zeros((len(self.paths) + 1, *fresh.passes.shape))
            for k, path in enumerate(self.paths):
                layers[k + 1] = WornTracks(sheet, layers[k]).after([path]).passes
            self._layers[size] = layers
        return fresh, self._layers[size]


def smoothed_path(t: Floats, xy: Floats) -> Floats:
    """Return the path of a stone, (n, 2), from positions with noise.

    Contacts are sensitive to the side of a track, to the millimetre. A path is therefore smoothed,
    except for the last metres of a stone that rests, and unsmoothed where the smoothed path does
    not fit.

    Parameters
    ----------
    t : (n,) times [s]
    xy : (n, 2) measured positions, free of outliers [m]
    """
    away = np.hypot(*(xy - np.median(xy[-LEAST_ROWS:], axis=0)).T) > POINT_SPACING
    count = int(np.flatnonzero(away)[-1]) + 1 if away.any() else 0
    if count < 3 * LEAST_ROWS:
        return xy
    before, seen = t[:count], xy[:count]
    longest_gap = float(np.diff(before).max())
    for period in SMOOTHED_PERIODS:
        smooth = _slow_part(slow_basis(before, period), seen)
        aside = median_filter(seen - smooth, size=(5, 1), mode="nearest")
        if longest_gap < period / 2 and float(np.abs(aside).max()) < FURTHEST_ASIDE:
            return np.vstack([smooth, xy[count:]])
    return xy


def _slow_part(basis: Floats, values: Floats) -> Floats:
    """Return the projection of values (n, d) on a basis (n, K), ignoring outlying rows."""
    near, smooth = np.ones(len(values), dtype=bool), values
    for _ in range(2):
        smooth = basis @ np.linalg.lstsq(basis[near], values[near])[0]
        off = np.hypot(*(values - smooth).T)
        near = off <= OUTLIER_DEVIATIONS * robust_deviation(off) + 1e-12
    return smooth


def wear_refinement(sheet: Sheet) -> int:
    """Odd number of parts of a cell's side that are no wider than a worn track."""
    times = math.ceil(sheet.cell_size / WORN_WIDTH)
    return times + 1 - times % 2


def _path(xy: Floats) -> Floats | None:
    """Return points of a path at even distances; None for an impossible path."""
    if len(xy) == 0:
        return None
    kept = [xy[0]]
    for point in xy:
        if np.hypot(*(point - kept[-1])) >= POINT_SPACING:
            kept.append(point)
    path = np.array(kept)
    length = float(np.hypot(*np.diff(path, axis=0).T).sum())
    return path if len(path) > 1 and length <= LONGEST_PATH else None
