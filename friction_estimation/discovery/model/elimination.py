"""Elimination of the parameters of single throws: their releases and own frictions.

A throw enters a fit as the Gram matrix of its whitened columns. Its release is projected out, and
the factor on its friction is integrated over. What remains concerns the shared parameters only.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from curling_env.typing import Floats
from friction_estimation.discovery.data.session import Session
from friction_estimation.discovery.model.minimum import project_out, scaled_root
from friction_estimation.discovery.model.noise import SessionNoise
from friction_estimation.discovery.model.whitening import whiten_session
from friction_estimation.discovery.tuning import RELEASE_SIGMA


def gram_matrices(session: Session, noise: SessionNoise, columns: Iterable[Floats]) -> Floats:
    """Whitened Gram matrices of each throw, (k, m, m).

    Parameters
    ----------
    session, noise : throws, and the noise that whitens
    columns : (n, 3, m) for each throw, values for x, y and theta; the last column is NaN where
        nothing was measured
    """
    return np.array([gram_matrix(session, noise, i, each) for i, each in enumerate(columns)])


def gram_matrix(session: Session, noise: SessionNoise, i: int, columns: Floats) -> Floats:
    """The same of the i-th throw alone, (m, m)."""
    rows, m = session.rows(i), columns.shape[2]
    work = np.array(columns, order="C")
    times, sigma = session.times[rows], session.sigma[rows]
    whiten_session(work, times, sigma, np.array([0, len(work)]), noise.table(), np.empty(m))
    flat = work.reshape(-1, m)
    return flat.T @ flat


def eliminate_states(grams: Floats) -> Floats:
    """Gram matrices with the release states projected out, (k, m-6, m-6)."""
    return project_out(_believed(grams), 6)


def release_steps(grams: Floats, changes: Floats) -> Floats:
    """Steps of the releases that are best after steps of all else, (n, k, 6).

    Parameters
    ----------
    grams : (k, m, m) Gram matrices of releases, other parameters and residual
    changes : (n, k, m-7) steps of the other parameters
    """
    root, scale = release_roots(grams)
    right = grams[:, :6, -1] - np.einsum("kij,nkj->nki", grams[:, :6, 6:-1], changes)
    inverse = np.linalg.inv(root)
    return scale * np.einsum("kji,kjl,nkl->nki", inverse, inverse, scale * right)


def release_roots(grams: Floats) -> tuple[Floats, Floats]:
    """Roots of the information on each release, (k, 6, 6), and their units (k, 6)."""
    return scaled_root(_believed(grams)[:, :6, :6])


def _believed(grams: Floats) -> Floats:
    """Gram matrices with the weak prior of a release."""
    out = grams.copy()
    out[:, range(6), range(6)] += RELEASE_SIGMA**-2
    return out


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
