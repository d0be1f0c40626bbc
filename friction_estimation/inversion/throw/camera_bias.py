"""A bias of the camera: a smooth displacement along the sheet, the same for all throws.

The remaining error of a lens or a pose after calibration displaces every stone at the same place
by the same amount b(y). To a throw at speed v this looks like a friction that is off by b''v²/g,
with opposite signs for throws in opposite directions, and no number of throws averages it away.
But it follows v² and the direction, and μ follows neither, so throws at several speeds and in both
directions tell them apart.

This module holds what every fit with such a term needs: the nodes along the sheet, how a measured
position follows them, and a prior of their displacements.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.linalg import eigh

from curling_env.typing import Floats
from friction_estimation.inversion.matern import matern
from friction_estimation.inversion.tuning import CAMERA_BIAS_NODE_SPACING

if TYPE_CHECKING:
    from friction_estimation.inversion.throw.path import StonePath


@dataclass(frozen=True, kw_only=True)
class CameraBias:
    """Displacement of measured positions along the sheet.

    Parameters
    ----------
    nodes : (n,) positions along the sheet [m]
    values, sigma : (n,) displacement towards positive y, and its standard error [m]
    """

    nodes: Floats
    values: Floats
    sigma: Floats

    def __len__(self) -> int:
        return len(self.nodes)

    @property
    def size(self) -> float:
        """Root mean square [m], each node weighted by how well it is known."""
        if not len(self):
            return 0.0
        weights = 1.0 / np.maximum(self.sigma, 1e-5) ** 2
        return float(np.sqrt(weights @ self.values**2 / weights.sum()))

    def node_weights(self, y: Floats) -> Floats:
        """Weight of each node at positions along the sheet, (k, n): a natural cubic spline.

        Beyond the last nodes the displacement stays what it is there.
        """
        inside = np.clip(y, self.nodes[0], self.nodes[-1])
        eye = np.eye(len(self))
        return np.asarray(CubicSpline(self.nodes, eye, bc_type="natural")(inside))

    def at(self, y: Floats) -> Floats:
        """Displacement at positions along the sheet, (k,) [m]."""
        return np.asarray(self.node_weights(y) @ self.values)

    def along_path(self, path: StonePath, distance: Floats) -> Floats:
        """How a distance measured along a path responds to the displacement at each node.

        A throw towards negative y sees the displacement with the opposite sign.

        Parameters
        ----------
        path : path of the throw
        distance : (k,) distances along it [m]

        Returns
        -------
        (k, n) derivatives
        """
        if not len(self):
            return np.empty((len(distance), 0))
        ahead = path.heading_at(distance)[:, 1]
        return self.node_weights(path.at(distance)[:, 1]) * ahead[:, None]


NO_BIAS = CameraBias(nodes=np.empty(0), values=np.empty(0), sigma=np.empty(0))
"""The bias of a perfect camera."""


def zero_bias_over(ys: Sequence[Floats]) -> CameraBias:
    """A bias that is still zero, with nodes over all positions where stones were seen.

    Parameters
    ----------
    ys : positions along the sheet, one array for each throw [m]
    """
    low = min(float(y.min()) for y in ys)
    high = max(float(y.max()) for y in ys)
    count = max(int(np.ceil((high - low) / CAMERA_BIAS_NODE_SPACING)) + 1, 6)
    nodes = np.linspace(low, high, count)
    return CameraBias(nodes=nodes, values=np.zeros(count), sigma=np.zeros(count))


def bias_root(nodes: Floats, length: float) -> Floats:
    """A root R of the prior correlation R Rᵀ of the bias at its nodes, (n, n).

    A constant or evenly growing displacement is left out of it: release states take up the first,
    and the second is an error of scale, which no throw can tell from μ and speed.

    Parameters
    ----------
    nodes : (n,) positions along the sheet [m]
    length : correlation length [m]
    """
    correlation = matern(np.abs(nodes[:, None] - nodes[None]), length, 2.5)
    even, _ = np.linalg.qr(np.column_stack([np.ones_like(nodes), nodes]))
    correlation -= even @ (even.T @ correlation)
    correlation -= (correlation @ even) @ even.T
    values, vectors = eigh(correlation)
    return vectors * np.sqrt(np.maximum(values, 0.0))
