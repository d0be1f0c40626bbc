"""Errors of the places at which light gates time stones: displacements that all throws share.

How high a beam is, and so how long the stone is there, and how far the gate stands from its line
are known to about a centimetre. Each edge of the stone at each gate has its own displacement.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from curling_env.typing import Floats
from friction_estimation.discovery.data.gates import GateErrors
from friction_estimation.discovery.model.gaussian_field import CameraField


@dataclass(frozen=True, kw_only=True, eq=False)
class GatePlaces(CameraField):
    """Displacements along the sheet of the places at which stones are timed [m].

    Parameters
    ----------
    places : (n,) places along the sheet [m]
    """

    name = "systematic_error"
    places: Floats

    @classmethod
    def of(cls, errors: GateErrors) -> GatePlaces:
        """No displacement of the places of a session."""
        return cls(
            places=errors.places,
            amplitude=errors.place_sigma,
            values=np.zeros(len(errors.places)),
        )

    def columns(self, xy: Floats, theta: Floats) -> Floats:
        """Displacements per unit of each coefficient, (rows, 2, n)."""
        del theta  # a gate sees no heading
        nearest = np.argmin(np.abs(xy[:, 1, None] - self.places), axis=1)
        out = np.zeros((len(xy), 2, len(self.places)))
        out[np.arange(len(xy)), 1, nearest] = 1.0
        return out
