"""A camera that errs by a smooth ripple along the sheet, the same for all throws.

What is left of a lens or of a pose after calibration displaces every stone at the same place by the
same amount b(y). To a throw at speed v it looks like a friction that is off by b''v²/g, with
opposite signs for throws in opposite directions, and no number of throws averages it away. But it
follows v² and the direction, and μ follows neither: throws at several speeds and both ways tell
them apart.

Here is what any fit needs that has such a term: nodes along the sheet, how a measured place follows
them, and a prior of their displacements.
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

if TYPE_CHECKING:
    from friction_estimation.inversion.throw.path import Course


NODE_SPACING = 0.75
"""Between the nodes of the ripple [m]: the cubic between them follows waves from 2 m on."""
USUAL_RIPPLE, USUAL_RIPPLE_LENGTH = 0.003, 1.5
"""Scale of the half-Cauchy belief in the ripple's amplitude [m], centre of that in its length."""
SHORTEST_RIPPLE, LONGEST_RIPPLE = 0.7, 3.0
"""Lengths of the ripple's correlation [m], about a fifth of its waves. What is longer is a matter
of the camera's pose and lens, and close to what slopes and laws of speed do to a throw."""


@dataclass(frozen=True, kw_only=True)
class CameraBias:
    """Displacement of measured positions along the sheet.

    Parameters
    ----------
    nodes : (n,) along the sheet [m]
    values, sigma : (n,) displacement towards positive y, and its standard error [m]
    """

    nodes: Floats
    values: Floats
    sigma: Floats

    def __len__(self) -> int:
        return len(self.nodes)

    @property
    def size(self) -> float:
        """Root mean square [m], each node weighing by how well it is known."""
        if not len(self):
            return 0.0
        weights = 1.0 / np.maximum(self.sigma, 1e-5) ** 2
        return float(np.sqrt(weights @ self.values**2 / weights.sum()))

    def shares(self, y: Floats) -> Floats:
        """What each node adds at places along the sheet: (k, n), a smooth curve through them.

        Beyond the last nodes the displacement stays what it is there.
        """
        inside = np.clip(y, self.nodes[0], self.nodes[-1])
        eye = np.eye(len(self))
        return np.asarray(CubicSpline(self.nodes, eye, bc_type="natural")(inside))

    def at(self, y: Floats) -> Floats:
        """Displacement at places along the sheet, (k,) [m]."""
        return np.asarray(self.shares(y) @ self.values)

    def seen_along(self, course: Course, distance: Floats) -> Floats:
        """How a distance measured along a course responds to the displacement at each node.

        A throw towards negative y sees it with the other sign.

        Parameters
        ----------
        course : of the throw
        distance : (k,) along it [m]

        Returns
        -------
        (k, n) derivatives
        """
        if not len(self):
            return np.empty((len(distance), 0))
        ahead = course.heading_at(distance)[:, 1]
        return self.shares(course.at(distance)[:, 1]) * ahead[:, None]


NO_BIAS = CameraBias(nodes=np.empty(0), values=np.empty(0), sigma=np.empty(0))
"""A camera that does not err."""


def bias_over(ys: Sequence[Floats]) -> CameraBias:
    """One that is still zero, over all places where stones were seen."""
    low = min(float(y.min()) for y in ys)
    high = max(float(y.max()) for y in ys)
    count = max(int(np.ceil((high - low) / NODE_SPACING)) + 1, 6)
    nodes = np.linspace(low, high, count)
    return CameraBias(nodes=nodes, values=np.zeros(count), sigma=np.zeros(count))


def ripple_root(nodes: Floats, length: float) -> Floats:
    """A root R of the prior correlation R Rᵀ of the ripple at nodes along the sheet, (n, n).

    A displacement that is constant or grows evenly is left out of it: release states take up the
    first, and the second is an error of scale, which no throw tells from μ and speed.

    Parameters
    ----------
    nodes : (n,) along the sheet [m]
    length : of correlation [m]
    """
    correlation = matern(np.abs(nodes[:, None] - nodes[None]), length, 2.5)
    even, _ = np.linalg.qr(np.column_stack([np.ones_like(nodes), nodes]))
    correlation -= even @ (even.T @ correlation)
    correlation -= (correlation @ even) @ even.T
    values, vectors = eigh(correlation)
    return vectors * np.sqrt(np.maximum(values, 0.0))
