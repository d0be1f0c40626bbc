"""Quadratics in the form of Gram matrices: their minima and residuals.

A Gram matrix (P + 1, P + 1) of P columns and a residual is the quadratic |residual - columns·step|²
of the step. As −2 ln of a density it is a Gaussian.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.linalg import solve_triangular

from curling_env.typing import Floats, Indices

NO_INFORMATION = 1e-100
"""Pivot of a parameter without information: its variance is huge but finite."""
RIDGES = (1e-10, 1e-8, 1e-6, 1e-3)
"""Fractions of the diagonal that are added in turn until there is a root."""


class Minimum(NamedTuple):
    """The minimum of quadratics, with parameters in units of `scale`.

    Parameters
    ----------
    value : (...) least value
    root : (..., P, P) Cholesky's root of the information
    half : (..., P) root⁻¹ of the right side
    scale : (..., P) units
    """

    value: Floats
    root: Floats
    half: Floats
    scale: Floats

    @property
    def step(self) -> Floats:
        """The step to the minimum, (..., P)."""
        transposed = np.swapaxes(self.root, -1, -2)
        return self.scale * _solved(transposed, self.half[..., None], lower=False)[..., 0]

    @property
    def covariance(self) -> Floats:
        """Inverse of the information, (..., P, P)."""
        inverse = _solved(self.root, np.broadcast_to(np.eye(len(self.root.T)), self.root.shape))
        inverse = inverse * self.scale[..., None, :]
        return np.swapaxes(inverse, -1, -2) @ inverse

    @property
    def pivots(self) -> Floats:
        """Roots of the pivots of the information, (..., P); their product is the root of det."""
        return np.einsum("...jj->...j", self.root) / self.scale

    @property
    def level(self) -> Floats:
        """−2 ln of the integral of the density over the parameters, up to a constant, (...)."""
        return self.value + 2.0 * np.log(self.pivots).sum(axis=-1)


def minimum_of(gram: Floats) -> Minimum:
    """Return the minimum of quadratics.

    Parameters
    ----------
    gram : (..., P + 1, P + 1) Gram matrices of the parameters and the residual

    Raises
    ------
    numpy.linalg.LinAlgError : an information without a root
    """
    root, scale = scaled_root(gram[..., :-1, :-1])
    half = _solved(root, (scale * gram[..., :-1, -1])[..., None])[..., 0]
    return Minimum(gram[..., -1, -1] - (half**2).sum(axis=-1), root, half, scale)


def project_out(gram: Floats, count: int) -> Floats:
    """Gram matrices of all except the first columns, with these optimised, (..., m-count,
    m-count).
    """
    root, scale = scaled_root(gram[..., :count, :count])
    half = _solved(root, scale[..., None] * gram[..., :count, count:])
    return gram[..., count:, count:] - np.swapaxes(half, -1, -2) @ half


def projected(whole: Floats, kept: Indices, others: Indices | None = None) -> Floats:
    """Return the quadratic in some parameters, with others optimised and the rest fixed.

    Parameters
    ----------
    whole : (P + 1, P + 1) Gram matrix of the parameters and the residual
    kept, others : their places; all others by default

    Returns
    -------
    (k + 1, k + 1) Gram matrix of those kept and the residual
    """
    others = np.setdiff1d(np.arange(len(whole) - 1), kept) if others is None else others
    order = np.concatenate([others, kept, [len(whole) - 1]]).astype(np.intp)
    return project_out(whole[order[:, None], order], len(others))


def scaled_root(matrix: Floats) -> tuple[Floats, Floats]:
    """Cholesky's root of information in units in which its diagonal is one, and these units.

    If rounding leaves it without a root, that of a nearby matrix.

    Parameters
    ----------
    matrix : (..., n, n) information

    Raises
    ------
    numpy.linalg.LinAlgError : no matrix nearby has a root
    """
    scale = 1.0 / np.sqrt(np.maximum(np.einsum("...jj->...j", matrix), NO_INFORMATION))
    scaled = matrix * scale[..., :, None] * scale[..., None, :]
    for ridge in RIDGES:
        try:
            root = np.linalg.cholesky(scaled + ridge * np.eye(matrix.shape[-1]))
        except np.linalg.LinAlgError:
            continue
        return np.asarray(root, dtype=np.float64), scale
    raise np.linalg.LinAlgError("Singular matrix")


def _solved(root: Floats, right: Floats, *, lower: bool = True) -> Floats:
    """Return the solution of triangular equations, as (..., n, r) as the right side."""
    if root.ndim == 2:
        solved = solve_triangular(root, right, lower=lower, check_finite=False)
        return np.asarray(solved, dtype=np.float64)
    return np.asarray(np.linalg.solve(root, right), dtype=np.float64)
