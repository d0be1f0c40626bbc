"""The Bayesian bound of a friction map, which plans and estimates are compared with."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from curling_env.sheet import PAPER_SHEET, Sheet
from curling_env.throw import Release
from curling_env.typing import Flags, Floats
from friction_estimation.design.cramer_rao import field_covariance, throw_response


@dataclass(frozen=True, kw_only=True)
class CellBound:
    """Smallest standard error of μ per cell.

    Parameters
    ----------
    sigma : (rows, columns) standard error of μ
    crossed : (rows, columns) cells that a stone's centre crosses
    """

    sigma: Floats
    crossed: Flags

    @property
    def rmse(self) -> float:
        """Root mean square of sigma over the crossed cells."""
        return float(np.sqrt((self.sigma[self.crossed] ** 2).mean()))


def cell_bound(
    releases: Sequence[Release],
    *,
    mu: float,
    noise: float,
    fps: float,
    spread: float,
    length: float,
    smoothness: float = 2.5,
    sheet: Sheet = PAPER_SHEET,
) -> CellBound:
    """Smallest standard error of μ in every cell of a map measured with given throws.

    Parameters
    ----------
    releases : releases of the throws, sheet frame
    mu : level of the friction
    noise : standard deviation of a measured position [m], independent from frame to frame
    fps : frames a second
    spread : standard deviation of ln μ over the sheet
    length : correlation length of the Matérn field [m]
    smoothness : order of the Matérn field: 1.5, 2.5 or infinity
    sheet : sheet with its cells
    """
    rows, columns = sheet.shape
    information = np.zeros((rows * columns, rows * columns))
    crossed = np.zeros((rows, columns), dtype=np.bool_)
    for release in releases:
        throw = throw_response(release, mu=mu, fps=fps, sheet=sheet)
        crossed.flat[throw.crossed] = True
        touched = throw.touched
        information[np.ix_(touched, touched)] += throw.response.T @ throw.response / noise**2
    prior = field_covariance(sheet, spread=spread, length=length, smoothness=smoothness)
    values, vectors = np.linalg.eigh(information)
    informed = values > 1e-3
    basis = np.sqrt(values[informed])[:, None] * vectors[:, informed].T
    seen_prior = basis @ prior
    inner = np.eye(len(basis)) + seen_prior @ basis.T
    gain = np.linalg.solve(inner, seen_prior)
    variance = np.diag(prior) - (seen_prior * gain).sum(axis=0)
    sigma = mu * np.sqrt(np.maximum(variance, 0.0)).reshape(rows, columns)
    return CellBound(sigma=sigma, crossed=crossed)
