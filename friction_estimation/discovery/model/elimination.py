"""Elimination of the parameters of single throws: their releases and own frictions.

A throw enters a fit as the Gram matrix of its whitened columns. Its release is projected out, and
the factor on its friction is integrated over. What remains concerns the shared parameters only.
"""

from __future__ import annotations

import numpy as np

from curling_env.typing import Floats
from friction_estimation.discovery.data.session import Session
from friction_estimation.discovery.model.noise import SessionNoise
from friction_estimation.discovery.model.whitening import whiten_session
from friction_estimation.discovery.tuning import RELEASE_SIGMA


def gram_matrices(session: Session, noise: SessionNoise, columns: Floats) -> Floats:
    """Whitened Gram matrices of each throw, (k, m, m).

    Parameters
    ----------
    session, noise : throws, and the noise that whitens
    columns : (rows, 3, m) values for x, y and theta; the last column is NaN if nothing was measured
    """
    throws = range(len(session))
    return np.array([gram_matrix(session, noise, i, columns[session.rows(i)]) for i in throws])


def gram_matrix(session: Session, noise: SessionNoise, i: int, columns: Floats) -> Floats:
    """The same of the i-th throw alone, (m, m).

    Parameters
    ----------
    columns : (n, 3, m) as of `gram_matrices`, for the rows of this throw
    """
    rows, m = session.rows(i), columns.shape[2]
    work = np.array(columns, order="C")
    times, sigma = session.times[rows], session.sigma[rows]
    whiten_session(work, times, sigma, np.array([0, len(work)]), noise.table(), np.empty(m))
    flat = work.reshape(-1, m)
    return flat.T @ flat


def eliminate_states(grams: Floats) -> Floats:
    """Gram matrices with the release states projected out, (k, m-6, m-6)."""
    states = grams[:, :6, :6] + np.diag(1.0 / RELEASE_SIGMA**2)
    scale = 1.0 / np.sqrt(np.einsum("ijj->ij", states))
    scaled = states * scale[:, :, None] * scale[:, None, :] + 1e-13 * np.eye(6)
    cross = grams[:, :6, 6:] * scale[:, :, None]
    return grams[:, 6:, 6:] - np.swapaxes(cross, 1, 2) @ np.linalg.solve(scaled, cross)


def eliminate_factor(reduced: Floats, ln_factors: Floats, spread: float) -> tuple[Floats, Floats]:
    """Gram matrices with the random factor integrated out.

    Parameters
    ----------
    reduced : (k, m-6, m-6) from `eliminate_states`; factor first, residual last
    ln_factors : (k,) ln factors around which the columns were computed
    spread : τ

    Returns
    -------
    grams : (k, m-7, m-7)
    log_terms : (k,) ln(1 + τ²h)
    """
    if spread <= 0.0:
        # Without a spread the factor is one: the residual is that without the present deviation.
        out = reduced[:, 1:, 1:].copy()
        u = ln_factors[:, None]
        out[:, :, -1] += u * reduced[:, 0, 1:]
        out[:, -1, :] += u * reduced[:, 0, 1:]
        out[:, -1, -1] += ln_factors**2 * reduced[:, 0, 0]
        return out, np.zeros(len(reduced))
    h = reduced[:, 0, 0]
    own = h + spread**-2
    cross = reduced[:, 0, 1:].copy()
    cross[:, -1] -= ln_factors / spread**2
    out = reduced[:, 1:, 1:] - cross[:, :, None] * cross[:, None, :] / own[:, None, None]
    out[:, -1, -1] += ln_factors**2 / spread**2
    return out, np.log1p(spread**2 * h)
