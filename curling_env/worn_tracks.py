"""Number of passes of running bands over the ice, on cells narrower than a band."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from curling_env.sheet import Sheet
from curling_env.typing import Floats, Indices

WORN_WIDTH = 0.125
"""Width of the track that a stone wears, that of its running band [m]."""
CELL_WIDTH, CELL_LENGTH = 0.0125, 0.2
"""Maximum sides of the cells, across the sheet and along it [m]. Stones run along the sheet, and
the wear under their bands varies across it.
"""
STRIPS = 50
"""Number of parallel lines that represent the band on these cells."""


@dataclass(frozen=True, eq=False)
class WornTracks:
    """Number of passes of bands over each place of a sheet.

    Parameters
    ----------
    sheet : the sheet
    passes : (rows, columns) passes at the centre of each cell, rows from y = −L/2 upward and
        columns from x = −W/2; linear interpolation between them is as sharp as the cells allow
    """

    sheet: Sheet
    passes: Floats

    @classmethod
    def none(cls, sheet: Sheet) -> WornTracks:
        """Return a sheet on which no stone has run."""
        return cls(sheet, np.zeros(_shape(sheet)))

    @cached_property
    def spacing(self) -> tuple[float, float]:
        """Width and length of the cells [m]."""
        rows, columns = self.passes.shape
        return self.sheet.width / columns, self.sheet.length / rows

    @property
    def origin(self) -> tuple[float, float]:
        """Centre of the first cell, sheet frame [m]."""
        width, length = self.spacing
        return (width - self.sheet.width) / 2, (length - self.sheet.length) / 2

    def after(self, paths: Iterable[Floats]) -> WornTracks:
        """Return the same after more stones ran along paths (n, 2) each, sheet frame [m]."""
        size, shape = (self.sheet.width, self.sheet.length), self.passes.shape
        area = sum((area_covered(path, size, shape, STRIPS) for path in paths), np.zeros(shape))
        return WornTracks(self.sheet, self.passes + _sharpened(area / math.prod(self.spacing)))


def _sharpened(shares: Floats) -> Floats:
    """Sharpen cell averages so that linear interpolation between cell centres is unbiased.

    A share of a cell is an average, and linear interpolation from centre to centre blurs it
    further: with both, a place is known to half of a cell, root mean square. Subtracting an eighth
    of the second difference corrects this.
    """
    sharp = shares.copy()
    sharp[:, 1:-1] -= np.diff(shares, 2, axis=1) / 8
    sharp[1:-1] -= np.diff(shares, 2, axis=0) / 8
    return sharp


def _shape(sheet: Sheet) -> tuple[int, int]:
    return math.ceil(sheet.length / CELL_LENGTH - 1e-9), math.ceil(sheet.width / CELL_WIDTH - 1e-9)


def area_covered(
    xy: Floats, size: tuple[float, float], shape: tuple[int, int], strips: int
) -> Floats:
    """Return the area of each cell that the band covered along a path, (rows, columns) [m²].

    Parameters
    ----------
    xy : (n, 2) path, straight between its points, sheet frame [m]. Parts off the ice count for the
        nearest cell
    size : width and length of all cells together, whose middle is that of the sheet [m]
    shape : rows and columns of cells
    strips : number of parallel lines that represent the band
    """
    spacing = size[0] / shape[1], size[1] / shape[0]
    steps = np.diff(xy, axis=0)
    lengths = np.hypot(steps[:, 0], steps[:, 1])
    moves = lengths > 0
    starts, steps, lengths = xy[:-1][moves], steps[moves], lengths[moves]
    area = np.zeros(shape)
    across = (steps / lengths[:, None])[:, ::-1] * [1.0, -1.0]
    for strip in range(strips):
        beside = starts + ((strip + 0.5) / strips - 0.5) * WORN_WIDTH * across
        step, share, middle = _pieces(beside, steps, size, spacing)
        row, column = (
            np.clip(np.floor((middle[:, k] + size[k] / 2) / spacing[k]), 0, shape[1 - k] - 1)
            for k in (1, 0)
        )
        place = row.astype(np.intp), column.astype(np.intp)
        np.add.at(area, place, share * lengths[step] * WORN_WIDTH / strips)
    return area


def _pieces(
    starts: Floats, steps: Floats, size: tuple[float, float], spacing: tuple[float, float]
) -> tuple[Indices, Floats, Floats]:
    """Cut straight steps (n, 2) where they cross the lines between cells.

    Returns
    -------
    for each piece: the number of its step, its share of the step's length, and its middle (…, 2)
    """
    of_step, at = [np.arange(len(steps))], [np.zeros(len(steps))]
    for axis in (0, 1):
        begin = (starts[:, axis] + size[axis] / 2) / spacing[axis]
        end = (starts[:, axis] + steps[:, axis] + size[axis] / 2) / spacing[axis]
        low = np.floor(np.minimum(begin, end))
        crossed = (np.floor(np.maximum(begin, end)) - low).astype(np.intp)
        step = np.repeat(np.arange(len(steps)), crossed)
        nth = np.arange(len(step)) - np.repeat(np.cumsum(crossed) - crossed, crossed)
        line = low[step] + 1 + nth
        of_step.append(step)
        at.append((line - begin[step]) / (end - begin)[step])
    step, place = np.concatenate(of_step), np.concatenate(at)
    order = np.lexsort((place, step))
    step, place = step[order], place[order]
    until = np.where(np.diff(step, append=-1) == 0, np.roll(place, -1), 1.0)
    middle = starts[step] + ((place + until) / 2)[:, None] * steps[step]
    return step, until - place, middle
