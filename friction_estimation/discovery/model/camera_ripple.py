"""A ripple of the camera: a smooth displacement along the sheet, the same for all throws.

The error that a calibration leaves displaces every stone at the same place by the same b(y). To a
throw at speed v this looks like a friction that is off by b''v²/g, with opposite signs for throws
in opposite directions, and no number of throws averages it away. But it follows v² and the
direction, and μ follows neither, so that throws at several speeds and in both directions tell them
apart. It is written as a Gaussian field along the sheet, as the friction map is one over it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.linalg import eigh

from curling_env.typing import Floats
from friction_estimation.design.matern import matern
from friction_estimation.discovery.tuning import (
    RIPPLE_AMPLITUDES,
    RIPPLE_NODE_SPACING,
    USUAL_RIPPLE,
)


@dataclass(frozen=True, kw_only=True, eq=False)
class CameraRipple:
    """A displacement of measured places towards positive y, smooth along the sheet.

    Parameters
    ----------
    nodes : (n,) places along the sheet [m]
    length : distance over which it changes [m]
    amplitude : standard deviation of the displacement [m]
    values : (n,) coefficients
    """

    nodes: Floats
    length: float
    amplitude: float = USUAL_RIPPLE
    values: Floats

    def __len__(self) -> int:
        return len(self.values)

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
        out = np.zeros((len(xy), 2, len(self)))
        out[:, 1] = self.patterns_at(xy[:, 1])
        return out

    def displacement(self, xy: Floats, theta: Floats) -> Floats:
        """Displacements of places (rows, 2), (rows, 2) [m]."""
        del theta
        return np.column_stack([np.zeros(len(xy)), self.patterns_at(xy[:, 1]) @ self.values])

    @property
    def amplitudes(self) -> Floats:
        """Amplitudes that may be tried [m]."""
        return RIPPLE_AMPLITUDES

    @property
    def deviations(self) -> Floats:
        """Prior standard deviation of each coefficient, (n,) [m]."""
        return np.full(len(self), self.amplitude)

    @property
    def hyperprior(self) -> float:
        """−2 ln of the prior density of the amplitude, a half-Cauchy, up to a constant."""
        return 2.0 * float(np.log1p((self.amplitude / USUAL_RIPPLE) ** 2))

    def at(self, values: Floats) -> CameraRipple:
        """The same with other coefficients."""
        return replace(self, values=values)

    def with_amplitude(self, amplitude: float) -> CameraRipple:
        """The same with another amplitude."""
        return replace(self, amplitude=amplitude)


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
