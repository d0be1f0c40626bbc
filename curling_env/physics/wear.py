"""Wear of the ice along the paths of stones.

The effect `pebble_wear` has two parameters. Its `rate` acts on the whole sheet and belongs to the
force law. Its `along_path` acts where stones ran; it changes the friction map between throws, which
is done here for games and for sessions of lone throws alike.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from curling_env.ice import Ice
from curling_env.sheet import Sheet
from curling_env.typing import Floats

PATH_FPS = 30.0
"""Samples per second of the paths that wear the ice; between them a path is straight."""
WORN_WIDTH = 0.125
"""Width of the track that a stone wears, that of its running band [m]."""
STRIPS = 5
"""Parallel lines that stand for the band on wide cells; on narrow cells there are more."""


def wear_along_path(ice: Ice) -> float:
    """Change of ln μ by one pass of the band, from every `pebble_wear` of the ice."""
    return sum(
        effect.parameters.get("along_path", 0.0)
        for effect in ice.effects
        if effect.name == "pebble_wear"
    )


def wear_of(ice: Ice, paths: Iterable[Floats]) -> Floats:
    """Change of ln μ of every cell by stones that moved along these paths, (rows, columns).

    A pass changes a cell in proportion to the share of its area that the band covered. The wear of
    several paths adds up, in any order.

    Parameters
    ----------
    ice : an ice with `pebble_wear`
    paths : (n, 2) each, sheet frame [m]
    """
    return wear_along_path(ice) * passes_over(ice.sheet, paths)


def passes_over(sheet: Sheet, paths: Iterable[Floats]) -> Floats:
    """How often the running band passed over every cell, (rows, columns).

    A pass over part of a cell counts as that part.

    Parameters
    ----------
    sheet : the sheet with its cells
    paths : (n, 2) each, sheet frame [m]
    """
    covered = np.zeros(sheet.shape)
    for path in paths:
        covered += _area_covered(sheet, path)
    return covered / sheet.cell_size**2


def worn(ice: Ice, wear: Floats | None) -> Ice:
    """An ice after a change of ln μ by `wear` (rows, columns); None is no change."""
    if wear is None:
        return ice
    return replace(ice, friction=replace(ice.friction, mu=ice.friction.mu * np.exp(wear)))


def _area_covered(sheet: Sheet, xy: Floats) -> Floats:
    """Area of each cell that the band covered along a path (n, 2), (rows, columns) [m²]."""
    steps = np.diff(xy, axis=0)
    lengths = np.hypot(steps[:, 0], steps[:, 1])
    moves = lengths > 0
    starts, steps, lengths = xy[:-1][moves], steps[moves], lengths[moves]
    area = np.zeros(sheet.shape)
    across = (steps / lengths[:, None])[:, ::-1] * [1.0, -1.0]
    strips = STRIPS * math.ceil(2 * WORN_WIDTH / sheet.cell_size)
    for strip in range(strips):
        beside = starts + ((strip + 0.5) / strips - 0.5) * WORN_WIDTH * across
        step, share, middle = _pieces(sheet, beside, steps)
        np.add.at(area, sheet.cell_of(middle), share * lengths[step] * WORN_WIDTH / strips)
    return area


def _pieces(sheet: Sheet, starts: Floats, steps: Floats) -> tuple[NDArray[np.intp], Floats, Floats]:
    """Cut straight steps (n, 2) where they cross the lines between cells.

    Returns
    -------
    for each piece: the number of its step, its share of the step's length, and its middle (…, 2)
    """
    of_step, at = [np.arange(len(steps))], [np.zeros(len(steps))]
    for axis, half in enumerate((sheet.width / 2, sheet.length / 2)):
        begin = (starts[:, axis] + half) / sheet.cell_size
        end = (starts[:, axis] + steps[:, axis] + half) / sheet.cell_size
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
