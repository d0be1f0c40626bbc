"""Wear of the ice along the paths of stones.

The effect `pebble_wear` has three parameters. Its `rate` acts on the whole sheet and belongs to the
force law. The others act along stones' tracks. `along_path` changes the friction map between
throws, and acts on a stone at its centre. `under_contacts` acts on each contact of the running band
separately, in the force law, which needs the tracks.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from curling_env.ice import Ice
from curling_env.sheet import Sheet
from curling_env.typing import Floats
from curling_env.worn_tracks import WORN_WIDTH, WornTracks, area_covered

PATH_FPS = 30.0
"""Samples per second of the paths that wear the ice; between them a path is straight."""
STRIPS = 5
"""Number of parallel lines that represent the band on wide cells; narrow cells have more."""


def wear_along_path(ice: Ice) -> float:
    """Return the change of ln μ by one pass of the band, from every `pebble_wear` of the ice."""
    return _wear(ice, "along_path")


def wear_under_contacts(ice: Ice) -> float:
    """Return the change of ln μ under a contact by one pass of the band, from every
    `pebble_wear`.
    """
    return _wear(ice, "under_contacts")


def _wear(ice: Ice, parameter: str) -> float:
    return sum(e.parameters.get(parameter, 0.0) for e in ice.effects if e.name == "pebble_wear")


def wear_of(ice: Ice, paths: Iterable[Floats]) -> Floats:
    """Return the change of ln μ of every cell, (rows, columns), from stones on these paths.

    A pass changes a cell in proportion to the share of its area that the band covered. The wear of
    several paths, (n, 2) each in the sheet frame [m], adds up in any order.
    """
    return wear_along_path(ice) * passes_over(ice.sheet, paths)


def passes_over(sheet: Sheet, paths: Iterable[Floats]) -> Floats:
    """Return the passes of the running band over every cell, (rows, columns), on paths (n, 2) each
    [m].

    A pass over part of a cell counts as that part.
    """
    covered = np.zeros(sheet.shape)
    strips = STRIPS * math.ceil(2 * WORN_WIDTH / sheet.cell_size)
    for path in paths:
        covered += area_covered(path, (sheet.width, sheet.length), sheet.shape, strips)
    return covered / sheet.cell_size**2


def with_wear_in_map(ice: Ice) -> Ice:
    """Return the same ice with all wear along paths in the cells of its map, as in games."""
    if wear_under_contacts(ice) == 0.0:
        return ice
    effects = list(ice.effects)
    for k, effect in enumerate(effects):
        if effect.name == "pebble_wear":
            parameters = dict(effect.parameters)
            moved = parameters.pop("under_contacts", 0.0)
            parameters["along_path"] = parameters.get("along_path", 0.0) + moved
            effects[k] = replace(effect, parameters=parameters)
    return replace(ice, effects=tuple(effects))


def worn(ice: Ice, wear: Floats | None) -> Ice:
    """Return an ice after a change of ln μ by `wear` (rows, columns); None means no change."""
    if wear is None:
        return ice
    return replace(ice, friction=replace(ice.friction, mu=ice.friction.mu * np.exp(wear)))


class IceInUse:
    """Ice on which stones are thrown one after the other.

    Attributes
    ----------
    remembers : true if tracks of stones matter
    now : current ice
    """

    def __init__(self, ice: Ice) -> None:
        self._first = ice
        self._wear: Floats | None = None
        self._under_contacts = wear_under_contacts(ice) != 0.0
        self._in_map = wear_along_path(ice) != 0.0
        self.remembers = self._under_contacts or self._in_map
        self.now = ice

    def ran(self, path: Floats) -> None:
        """Register that a stone ran along a path (n, 2), sheet frame [m]."""
        if not self.remembers:
            return
        if self._in_map:
            added = wear_of(self._first, [path])
            self._wear = added if self._wear is None else self._wear + added
        tracks = self.now.tracks
        if self._under_contacts:
            tracks = WornTracks.none(self._first.sheet) if tracks is None else tracks
            tracks = tracks.after([path])
        self.now = replace(worn(self._first, self._wear), tracks=tracks)
