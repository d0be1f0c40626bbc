"""A ripple of the camera: a smooth displacement along the sheet, the same for all throws.

The error that a calibration leaves displaces every stone at the same place by the same b(y). To a
throw at speed v this looks like a friction that is off by b''v²/g, with opposite signs for throws
in opposite directions, and no number of throws averages it away. But it follows v² and the
direction, and μ follows neither, so that throws at several speeds and in both directions tell them
apart. It is written as a Gaussian field along the sheet, as the friction map is one over it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.linalg import eigh

from curling_env.typing import Floats
from friction_estimation.design.matern import matern
from friction_estimation.discovery.model.gaussian_field import CameraField
from friction_estimation.discovery.tuning import (
    RIPPLE_AMPLITUDES,
    RIPPLE_NODE_SPACING,
    USUAL_RIPPLE,
)


@dataclass(frozen=True, kw_only=True, eq=False)
class CameraRipple(CameraField):
    """A displacement of measured places towards positive y, smooth along the sheet [m].

    Parameters
    ----------
    nodes : (n,) places along the sheet [m]
    length : distance over which it changes [m]
    """

    name = "ripple"
    nodes: Floats
    length: float
    amplitude: float = USUAL_RIPPLE

    @cached_property
    def root(self) -> Floats:
        """Displacement of the nodes by one unit of each coefficient, (n, n).

        An even displacement and one that grows evenly are excluded: releases take up the first, and
        the second is an error of scale, which no throw can tell from friction and speed.
        """
        correlation = matern(np.abs(self.nodes[:, None] - self.nodes), self.length, 2.5)
        even, _ = np.linalg.qr(np.column_stack([np.ones_like(self.nodes), self.nodes]))
        correlation -= even @ (even.T @ correlation)
        correlation -= (correlation @ even) @ even.T
        values, vectors = eigh(correlation)
        return np.asarray(vectors * np.sqrt(np.maximum(values, 0.0)))

    @cached_property
    def _spline(self) -> CubicSpline:
        return CubicSpline(self.nodes, self.root, bc_type="natural")

    def patterns_at(self, y: Floats) -> Floats:
        """Displacement at places along the sheet by one unit of each coefficient, (k, n).

        Beyond the last nodes the displacement stays what it is there.
        """
        return np.asarray(self._spline(np.clip(y, self.nodes[0], self.nodes[-1])))

    def columns(self, xy: Floats, theta: Floats) -> Floats:
        """Displacements of places (rows, 2) per unit of each coefficient, (rows, 2, n)."""
        del theta  # a ripple turns with no stone
        patterns = self.patterns_at(xy[:, 1])
        return np.stack([np.zeros_like(patterns), patterns], axis=1)

    @property
    def amplitudes(self) -> Floats:
        """Amplitudes that may be tried [m]."""
        return RIPPLE_AMPLITUDES

    @property
    def hyperprior(self) -> float:
        """−2 ln of the prior density of the amplitude, a half-Cauchy, up to a constant."""
        return 2.0 * float(np.log1p((self.amplitude / USUAL_RIPPLE) ** 2))


def ripple_over(places: Sequence[Floats], length: float) -> CameraRipple:
    """A ripple of zero over all places where stones were seen.

    Parameters
    ----------
    places : positions (k, 2) of stones, one array for each throw [m]
    length : distance over which it changes [m]
    """
    low = min(float(xy[:, 1].min()) for xy in places)
    high = max(float(xy[:, 1].max()) for xy in places)
    count = max(int(np.ceil((high - low) / RIPPLE_NODE_SPACING)) + 1, 6)
    return CameraRipple(nodes=np.linspace(low, high, count), length=length, values=np.zeros(count))
