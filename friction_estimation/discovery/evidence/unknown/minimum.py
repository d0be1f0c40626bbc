"""The minimum of a quadratic, from its Gram matrix."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.linalg import solve_triangular

from curling_env.typing import Floats


class Minimum(NamedTuple):
    """The minimum of a quadratic.

    Parameters
    ----------
    half : root⁻¹ of the right side, with parameters in units of `scale`
    value : value at the minimum
    pivots : roots of the pivots of the information
    root : Cholesky's root of the information in units of `scale`
    scale : units of the parameters
    """

    half: Floats
    value: float
    pivots: Floats
    root: Floats
    scale: Floats


def minimum_of(gram: Floats) -> Minimum:
    """The minimum of a quadratic.

    Parameters
    ----------
    gram : (n + 1, n + 1) Gram matrix of the parameters and the residual
    """
    inner = gram[:-1, :-1]
    scale = 1.0 / np.sqrt(np.maximum(inner.diagonal(), 1e-300))
    root = root_of(inner * scale[:, None] * scale)
    half = solve_triangular(root, scale * gram[:-1, -1], lower=True, check_finite=False)
    return Minimum(half, float(gram[-1, -1] - half @ half), root.diagonal() / scale, root, scale)


def best_step(gram: Floats) -> Floats:
    """The parameters at which a quadratic is least, (n,); `gram` as of `minimum_of`."""
    at = minimum_of(gram)
    return at.scale * solve_triangular(at.root.T, at.half, lower=False, check_finite=False)


def root_of(matrix: Floats) -> Floats:
    """Cholesky's root of a matrix (n, n) of unit diagonal; of one nearby where it has none."""
    for little in (1e-9, 1e-6, 1e-3):
        try:
            root = np.linalg.cholesky(matrix + little * np.eye(len(matrix)))
            return np.asarray(root, dtype=np.float64)
        except np.linalg.LinAlgError:
            continue
    return np.eye(len(matrix))
