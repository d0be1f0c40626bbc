"""What all frames of a camera err by together: its pose, its lens, the outline of the stone.

A tracker states in `sigma_xy` how far a place may be off. What of that the residuals do not show as
noise is common to all frames and all throws: it bends every path alike, is taken for friction, and
no number of throws averages it away. It is carried into the standard errors of the estimate as a
displacement along the sheet that varies smoothly with the place. The estimate itself stays.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from curling_env.sheet import Sheet
from friction_estimation.camera_bias import CameraBias
from friction_estimation.matern import matern

Floats = NDArray[np.float64]

SPACING = 2.0
"""Between nodes along the sheet [m]."""
LENGTH = 8.0
"""Over which the errors of pose, lens and outline are alike [m]. On 39 sessions of two throws that
`friction_estimation.synthetic` filmed from the end, a gantry and the side, with corners marked 3 px
off, the intervals of all sessions and of 77 of the 78 throws hold μ; 24 and 51 did without this and
without a doubt about stones whose turn was not seen. Errors are 0.2 to 1.3 standard errors."""


@dataclass(frozen=True, kw_only=True)
class SharedError:
    """A displacement along the sheet, common to all throws, of which only the size is known.

    Parameters
    ----------
    nodes : (n,) along the sheet [m]
    root : (n, n) R of its covariance R Rᵀ at the nodes [m]
    """

    nodes: Floats
    root: Floats

    @property
    def basis(self) -> CameraBias:
        """By which a throw sees the nodes."""
        nothing = np.zeros(len(self.nodes))
        return CameraBias(nodes=self.nodes, values=nothing, sigma=nothing)


def nodes_of(sheet: Sheet) -> Floats:
    """Places along the sheet where the displacement is counted, (n,) [m]."""
    count = int(np.ceil(sheet.length / SPACING)) + 1
    return np.linspace(-sheet.length / 2, sheet.length / 2, count)


def shared_error(
    sheet: Sheet, places: Sequence[Floats], sigmas: Sequence[Floats], noise: float
) -> SharedError | None:
    """What tracks say of themselves and their noise does not show; None where there is nothing.

    Parameters
    ----------
    sheet : on which stones were measured
    places : for each throw, along the sheet [m]
    sigmas : for each throw, stated standard errors of its rows [m]; empty where nobody stated any
    noise : standard deviation of a row about its path [m]
    """
    nodes = nodes_of(sheet)
    variances: list[Floats] = []
    for y, sigma in zip(places, sigmas, strict=True):
        if len(sigma) != len(y):
            continue
        order = np.argsort(y)
        order = order[np.isfinite(sigma[order])]
        if len(order):
            variances.append(np.interp(nodes, y[order], sigma[order] ** 2))
    if not variances:
        return None
    left = np.maximum(np.mean(variances, axis=0) - noise**2, 0.0)
    if not left.any():
        return None
    alike = matern(np.abs(nodes[:, None] - nodes[None]), LENGTH, 2.5)
    lower = np.linalg.cholesky(alike + 1e-9 * np.eye(len(nodes)))
    return SharedError(nodes=nodes, root=np.sqrt(left)[:, None] * lower)
