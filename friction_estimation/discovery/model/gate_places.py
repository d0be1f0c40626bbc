"""Errors of the places at which light gates time stones: displacements that all throws share.

How high a beam is, and so how long the stone is there, and how far the gate stands from its line
are known to about a centimetre. Each edge of the stone at each gate has its own displacement.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from curling_env.typing import Floats, Indices
from friction_estimation.discovery.data.gates import GateErrors


@dataclass(frozen=True, kw_only=True, eq=False)
class GatePlaces:
    """Displacements along the sheet of the places at which stones are timed.

    Parameters
    ----------
    places : (g,) places along the sheet [m]
    amplitude : standard deviation of each displacement [m]
    values : (g,) displacements [m]
    held : whether they stay as they are, and are no parameters of a fit
    """

    places: Floats
    amplitude: float
    values: Floats
    held: bool = False

    @classmethod
    def of(cls, errors: GateErrors) -> GatePlaces:
        """No displacement of the places of a session."""
        return cls(
            places=errors.places,
            amplitude=errors.place_sigma,
            values=np.zeros(len(errors.places)),
        )

    def __len__(self) -> int:
        """Number of displacements that a fit may change."""
        return 0 if self.held else len(self.values)

    @property
    def amplitudes(self) -> Floats:
        """The one amplitude that is tried: it is stated, (1,) [m]."""
        return np.array([self.amplitude])

    def columns(self, xy: Floats, theta: Floats) -> Floats:
        """Displacements per unit of each coefficient, (rows, 2, g)."""
        out = np.zeros((len(xy), 2, len(self.places)))
        out[np.arange(len(xy)), 1, self._nearest(xy)] = 1.0
        return out

    def displacement(self, xy: Floats, theta: Floats) -> Floats:
        """Displacements of places (rows, 2), (rows, 2) [m]."""
        return np.column_stack([np.zeros(len(xy)), self.values[self._nearest(xy)]])

    def _nearest(self, xy: Floats) -> Indices:
        return np.argmin(np.abs(xy[:, 1, None] - self.places), axis=1)

    @property
    def deviations(self) -> Floats:
        """Prior standard deviation of each displacement, (g,) [m]."""
        return np.full(len(self.values), self.amplitude)

    @property
    def hyperprior(self) -> float:
        """−2 ln of the prior density of the amplitude, which is known."""
        return 0.0

    def at(self, values: Floats) -> GatePlaces:
        """The same with other displacements."""
        return replace(self, values=values)

    def with_amplitude(self, amplitude: float) -> GatePlaces:
        """The same with another amplitude."""
        return replace(self, amplitude=amplitude)
