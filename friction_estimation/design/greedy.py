"""Next throw of a design: the variance that it would remove.

The information of a throw is a few rows, each a combination of unknowns measured with unit noise.
Throws are chosen one by one, each time the one that removes most (greedy A-optimal design).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from curling_env.typing import Floats, Indices


class Informative(NamedTuple):
    """Information of one throw.

    Parameters
    ----------
    touched : (t,) the unknowns that it depends on
    rows : (r, t) what it measures of them, in units of the noise
    """

    touched: Indices
    rows: Floats


def variance_removed(
    covariance: Floats, throw: Informative, counted: Indices, weights: Floats | None = None
) -> float:
    """Fall of the weighted sum of variances by one throw.

    Parameters
    ----------
    covariance : (P, P) of the unknowns before it
    throw : what it tells
    counted : (c,) the unknowns whose variances count
    weights : (c,) weights of these; all alike by default
    """
    across = covariance[np.ix_(counted, throw.touched)] @ throw.rows.T
    removed = across * np.linalg.solve(_inner(covariance, throw), across.T).T
    return float((removed if weights is None else weights[:, None] * removed).sum())


def covariance_after(covariance: Floats, throw: Informative) -> Floats:
    """Return the covariance of the unknowns after a throw, (P, P)."""
    spreading = covariance[:, throw.touched] @ throw.rows.T
    return covariance - spreading @ np.linalg.solve(_inner(covariance, throw), spreading.T)


def _inner(covariance: Floats, throw: Informative) -> Floats:
    """Covariance of what the throw measures, noise included."""
    own = covariance[np.ix_(throw.touched, throw.touched)]
    return np.eye(len(throw.rows)) + throw.rows @ own @ throw.rows.T
