"""Tests of the residuals of a fit: whiteness, and throws with large residuals."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from curling_env.typing import Floats
from friction_estimation.discovery.data.session import Session
from friction_estimation.discovery.model.fit import SessionFit
from friction_estimation.discovery.model.linearisation import gram_matrix
from friction_estimation.discovery.model.minimum import project_out
from friction_estimation.discovery.tuning import (
    CLEARLY_SEEN,
    SLOWEST_NOISE_PERIOD,
    WHITE_RATIO,
    WHITE_RATIO_OF_FILM,
)


@dataclass(frozen=True, kw_only=True, eq=False)
class Misfit:
    """Slow residuals of every throw compared with those of noise alone.

    Parameters
    ----------
    chi2 : (k,) χ² of the slow cosines of x, y and heading, with release and friction projected out
    dof : (k,) expected χ² if nothing is missing
    tolerated : ratio of the two that still counts as white
    throw_tolerance : factor by which χ² of a single throw may exceed its expectation
    """

    chi2: Floats
    dof: Floats
    tolerated: float = WHITE_RATIO
    throw_tolerance: float = 1.0

    @property
    def excess(self) -> float:
        """χ² beyond expectation."""
        return float(self.chi2.sum() - self.dof.sum())

    @property
    def ratio(self) -> float:
        """χ² over its expectation."""
        return float(self.chi2.sum() / max(self.dof.sum(), 1.0))

    @property
    def chance(self) -> float:
        """Standard deviation of the excess for a complete model and known noise."""
        return float(np.sqrt(2.0 * max(self.dof.sum(), 1.0)))

    @property
    def z(self) -> float:
        """Excess in standard deviations."""
        return self.excess / self.chance

    @property
    def white(self) -> bool:
        """Return whether noise alone explains them."""
        return self.ratio < self.tolerated or self.z < CLEARLY_SEEN

    @property
    def surprise(self) -> Floats:
        """Excess of each throw in standard deviations, (k,)."""
        return (self.chi2 / self.throw_tolerance - self.dof) / np.sqrt(
            2.0 * np.maximum(self.dof, 1.0)
        )


def slow_columns(t: Floats) -> Floats:
    """Slow cosines of a throw, without the constant: possible shapes of an effect, (n, K)."""
    span = max(float(t[-1] - t[0]), 1e-9)
    count = max(2, min(int(2 * span / SLOWEST_NOISE_PERIOD), len(t) // 6))
    return np.cos(np.pi * (t - t[0])[:, None] / span * np.arange(1, count + 1))


def misfit_of(fitted: SessionFit) -> Misfit:
    """Slow misfit of a fit."""
    session, noise, columns = fitted.session, fitted.noise, fitted.columns
    chi2, dof = np.zeros(len(session)), np.zeros(len(session))
    residual = fitted.residuals
    for i in range(len(session)):
        rows = session.rows(i)
        slow = slow_columns(session.times[rows])
        k = slow.shape[1]
        channels = 3 if session.turns[i] else 2
        basis = np.zeros((len(slow), 3, channels * k))
        for channel in range(channels):
            basis[:, channel, channel * k : (channel + 1) * k] = slow
        stacked = np.concatenate([columns[rows, :, :7], basis, residual[rows][:, :, None]], axis=2)
        gram = gram_matrix(session, noise, i, stacked)
        scale = np.append(1.0 / np.sqrt(np.maximum(np.diag(gram)[7:-1], 1e-300)), 1.0)
        reduced = project_out(gram, 7) * scale[:, None] * scale
        values, vectors = np.linalg.eigh(reduced[:-1, :-1])
        seen = values > 1e-6 * values.max()
        parts = (vectors[:, seen].T @ reduced[:-1, -1]) / np.sqrt(values[seen])
        chi2[i], dof[i] = float((parts**2).sum()), float(seen.sum())
    tolerated = WHITE_RATIO_OF_FILM if session.smoothed else WHITE_RATIO
    return Misfit(
        chi2=chi2, dof=dof, tolerated=tolerated, throw_tolerance=throw_tolerance_of(session)
    )


def throw_tolerance_of(session: Session) -> float:
    """Factor by which χ² of a single throw may exceed the prediction from the noise of all.

    Some films are tracked better than others, because the appearance of the stone is learnt from
    each film.
    """
    return WHITE_RATIO_OF_FILM if session.smoothed else 1.0
