"""Ice of a session before each of its throws, and samples within its standard errors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from agents.coaching.tuning import DRAWS
from curling_env.analysis.ice_uncertainty import plausible_ices
from curling_env.ice import Ice
from curling_env.physics.wear import passes_over, wear_along_path, wear_under_contacts, worn
from curling_env.typing import Floats
from curling_env.worn_tracks import WornTracks


@dataclass(frozen=True, kw_only=True)
class IceBefore:
    """Ice before a throw.

    Parameters
    ----------
    ice : the estimate
    others : samples within its standard errors; the ice alone if it has none
    """

    ice: Ice
    others: Sequence[Ice]


class SessionIce:
    """Ice of a session, worn by its stones if it has that effect.

    Parameters
    ----------
    ice : ice before the first throw
    rng : source of the sampled errors
    draws : number of sampled ices
    """

    def __init__(self, ice: Ice, rng: np.random.Generator, draws: int = DRAWS) -> None:
        self._now = IceBefore(ice=ice, others=plausible_ices(ice, draws, rng))
        self._first = self._now
        self._wears = wear_along_path(ice) != 0.0 or wear_under_contacts(ice) != 0.0
        self._passes = np.zeros(ice.sheet.shape)
        self._tracks = WornTracks.none(ice.sheet)

    @property
    def now(self) -> IceBefore:
        """Return the ice before the next throw."""
        return self._now

    def ran(self, xy: Floats) -> None:
        """Register that a stone ran along a path (n, 2), sheet frame [m]."""
        if not self._wears:
            return
        self._passes += passes_over(self._first.ice.sheet, [xy])
        self._tracks = self._tracks.after([xy])

        def after(ice: Ice) -> Ice:
            now = worn(ice, wear_along_path(ice) * self._passes)
            return replace(now, tracks=self._tracks)

        self._now = IceBefore(
            ice=after(self._first.ice), others=[after(ice) for ice in self._first.others]
        )
