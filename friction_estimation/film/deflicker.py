"""Correction of flickering or switched lights: every frame is brought to the brightness of the
first.

Lamps on alternating current pulse a hundred times a second or more often, and a camera reads its
rows one after the other. Bands of light and shade then run over the film, so that every row is
corrected separately. Only even areas are compared, so that a camera that sways or is knocked is not
mistaken for changing light.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from curling_env.typing import Flags, Floats, Image

CELL_ROWS, CELL_COLUMNS = 4, 16
"""Size of the cells of the picture whose brightness is compared [px]; bands are some hundred rows
wide."""
STEADY_SHARE = 0.05
"""Maximum relative deviation of the light in every row that needs no correction."""
DARK_LEVEL, SATURATED_LEVEL = 24, 250
"""Grey levels below and above which a cell does not show the brightness of the light."""
DARK_SHARE = 0.3
"""Minimum brightness of a cell over the brightest: the rest is the hall, where noise and distance
from the lamps matter more than a lamp that flickers.
"""
BRIGHT_QUANTILE = 0.95
"""Quantile of the cells' brightness that represents the brightest."""
EVEN_SHARE, EVEN_LEVELS = 0.04, 4.0
"""Maximum relative and absolute differences within an even area [share, grey levels]."""
EVEN_CELLS = (5, 3)
"""Number of rows and columns of cells of such an area."""
MOVED_SHARE = 0.15
"""Relative difference of a cell from its row above which an object is in front of it."""
MIN_CELLS, MIN_ROW_CELLS = 100, 8
"""Minimum number of usable cells in a frame, and in a row."""
ROW_WEIGHTS = np.array([0.1, 0.25, 0.3, 0.25, 0.1])
"""Weights of a row's neighbours in its gain."""
BAND_SPREAD = 0.01
"""Maximum spread of the rows' gains for a common correction."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Deflicker:
    """Brightness of a film's first frame.

    Parameters
    ----------
    cells : (rows, columns) brightness of the first frame
    even : (rows, columns) cells that are neither dark nor saturated nor near an edge
    """

    cells: Image
    even: Flags

    @classmethod
    def of(cls, frame: Image) -> Deflicker:
        """Make the correction from the first frame, BGR."""
        cells = _cells(frame)
        return cls(cells=cells, even=_even(cells))

    def gains(self, frame: Image) -> Floats:
        """Return the brightness of each row of `cells` over that of the first frame, (rows,).

        Moving objects are excluded; a row without usable cells takes its neighbours' gain.
        """
        now = _cells(frame)
        alike = np.ones(len(self.cells))
        if now.shape != self.cells.shape:
            return alike
        lit = self.even & (now < SATURATED_LEVEL) & (now > 0)
        if np.count_nonzero(lit) < MIN_CELLS:
            return alike
        ratio = np.where(lit, now / np.maximum(self.cells, 1).astype(np.float64), np.inf)
        count = lit.sum(axis=1)
        rows = np.flatnonzero(count >= MIN_ROW_CELLS)
        if len(rows) < len(ROW_WEIGHTS):
            return alike * np.median(ratio[lit])
        # Sums, because the median of a dark row is a ratio of two small whole numbers.
        middle = np.sort(ratio[rows], axis=1)[np.arange(len(rows)), count[rows] // 2]
        still = np.abs(ratio[rows] / middle[:, None] - 1) < MOVED_SHARE
        before, after = ((part[rows] * still).sum(axis=1) for part in (self.cells, now))
        everywhere = np.interp(np.arange(len(alike)), rows, after / before)
        padded = np.pad(everywhere, len(ROW_WEIGHTS) // 2, mode="reflect", reflect_type="odd")
        return np.convolve(padded, ROW_WEIGHTS, mode="valid")

    def corrected(self, frame: Image) -> Image:
        """Return the frame at the first frame's brightness."""
        gains = self.gains(frame)
        if np.ptp(gains) < BAND_SPREAD:
            alike = 1 / float(np.median(gains))
            return np.asarray(cv2.convertScaleAbs(frame, alpha=alike), dtype=np.uint8)
        at = (np.arange(frame.shape[0]) + 0.5) / CELL_ROWS - 0.5
        scale = (1 / np.interp(at, np.arange(len(gains)), gains)).astype(np.float32)
        whole = np.broadcast_to(scale[:, None, None], frame.shape)
        even = cv2.multiply(frame, np.ascontiguousarray(whole), dtype=cv2.CV_8U)
        return np.asarray(even, dtype=np.uint8)


def deflicker_for(sample: Sequence[tuple[float, Image]]) -> Deflicker | None:
    """Return the correction that a film needs; None if its light is steady.

    Parameters
    ----------
    sample : times [s] and frames, BGR, spread over the film
    """
    if not sample:
        return None
    first = Deflicker.of(sample[0][1])
    gains = np.array([first.gains(frame) for _, frame in sample])
    # People may fill a row now and then, but a band runs over all rows.
    low, high = np.quantile(gains, [0.05, 0.95])
    return first if high / low - 1 > STEADY_SHARE else None


def _cells(frame: Image) -> Image:
    """Return the mean brightness of the green channel in every cell of the picture, (rows,
    columns).
    """
    size = max(frame.shape[1] // CELL_COLUMNS, 1), max(frame.shape[0] // CELL_ROWS, 1)
    green = cv2.extractChannel(frame, 1)
    return np.asarray(cv2.resize(green, size, interpolation=cv2.INTER_AREA), dtype=np.uint8)


def _even(cells: Image) -> Flags:
    """Return the cells in even areas of medium brightness."""
    level = cells.astype(np.float32)
    area = np.ones(EVEN_CELLS, dtype=np.uint8)
    differs = cv2.morphologyEx(level, cv2.MORPH_GRADIENT, area)
    dark = max(DARK_LEVEL, DARK_SHARE * float(np.quantile(cells, BRIGHT_QUANTILE)))
    usable = (cells > dark) & (cells < SATURATED_LEVEL)
    return np.asarray(usable & (differs < EVEN_SHARE * level + EVEN_LEVELS), dtype=bool)
