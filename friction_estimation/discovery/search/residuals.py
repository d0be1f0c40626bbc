"""What a fit leaves: is it white, and if not, where is it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from curling_env.typing import Floats
from friction_estimation.discovery.data.outliers import SLOWEST_PERIOD
from friction_estimation.discovery.data.session import Session
from friction_estimation.discovery.model.fit import Fit, gram_matrices

TOLERATED = 1.15
"""Slow residuals this much larger than the noise foretells are still called white: the noise's own
spectrum is an estimate."""
TOLERATED_FADING = 1.25
"""The same for noise with a memory, most of which is slower than what it is learnt from. With 16
throws and a memory of 0.3 s its slow part is found to 8 % (standard deviation, measured): three
of those."""
TOLERATED_SLOW = 2.0
"""The same for tracks that err slowly, whose noise is learnt from what swings within seconds and
carried on to what lasts for a throw."""
SURE = 4.0
"""Standard deviations of χ² beyond which residuals are not white."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Misfit:
    """Slow residuals of every throw against what noise alone would leave.

    Parameters
    ----------
    chi2 : (k,) of slow cosines of x, y and heading, releases and friction projected out
    dof : (k,) its expectation if nothing were missing
    tolerated : ratio of the two that still counts as white
    doubt : factor by which the noise of a single throw may exceed what was found of all
    """

    chi2: Floats
    dof: Floats
    tolerated: float = TOLERATED
    doubt: float = 1.0

    @property
    def excess(self) -> float:
        """χ² beyond expectation."""
        return float(self.chi2.sum() - self.dof.sum())

    @property
    def ratio(self) -> float:
        return float(self.chi2.sum() / max(self.dof.sum(), 1.0))

    @property
    def chance(self) -> float:
        """Standard deviation of the excess if nothing were missing and the noise were known."""
        return float(np.sqrt(2.0 * max(self.dof.sum(), 1.0)))

    @property
    def uncertainty(self) -> float:
        """The same with the noise as well known as it is: to a third of what is tolerated."""
        return float(np.hypot(self.chance, (self.tolerated - 1.0) / 3.0 * self.dof.sum()))

    @property
    def z(self) -> float:
        """Excess in standard deviations."""
        return self.excess / self.chance

    @property
    def white(self) -> bool:
        return self.ratio < self.tolerated or self.z < SURE

    @property
    def surprise(self) -> Floats:
        """Excess of each throw in standard deviations, (k,)."""
        return (self.chi2 / self.doubt - self.dof) / np.sqrt(2.0 * np.maximum(self.dof, 1.0))

    def without(self, left_out: NDArray[np.intp]) -> Misfit:
        """The misfit of the other throws."""
        keep = np.setdiff1d(np.arange(len(self.chi2)), left_out)
        return replace(self, chi2=self.chi2[keep], dof=self.dof[keep])


def slow_columns(t: Floats) -> Floats:
    """Slow cosines of a throw, (n, K): what an effect could look like, from the second on."""
    span = max(float(t[-1] - t[0]), 1e-9)
    count = max(2, min(int(2 * span / SLOWEST_PERIOD), len(t) // 6))
    return np.cos(np.pi * (t - t[0])[:, None] / span * np.arange(1, count + 1))


def misfit(fitted: Fit, columns: Floats) -> Misfit:
    """Slow misfit of a fit.

    Parameters
    ----------
    columns : (rows, 3, 7 + P) sensitivities at the fit; the first seven are the throw's own
    """
    session, noise = fitted.session, fitted.noise
    chi2, dof = np.zeros(len(session)), np.zeros(len(session))
    residual = fitted.residuals
    for i in range(len(session)):
        rows = session.rows(i)
        one = session.only([i])
        slow = slow_columns(session.times[rows])
        k = slow.shape[1]
        channels = 3 if session.turns[i] else 2
        basis = np.zeros((len(slow), 3, channels * k))
        for channel in range(channels):
            basis[:, channel, channel * k : (channel + 1) * k] = slow
        stacked = np.concatenate([columns[rows, :, :7], basis, residual[rows][:, :, None]], axis=2)
        gram = gram_matrices(one, noise, stacked)[0]
        scale = 1.0 / np.sqrt(np.maximum(np.diag(gram), 1e-300))
        scale[-1] = 1.0
        gram = gram * scale[:, None] * scale
        own = gram[:7, :7] + 1e-10 * np.eye(7)
        left = gram[7:, 7:] - gram[7:, :7] @ np.linalg.solve(own, gram[:7, 7:])
        values, vectors = np.linalg.eigh(left[:-1, :-1])
        seen = values > 1e-6 * values.max()
        parts = (vectors[:, seen].T @ left[:-1, -1]) / np.sqrt(values[seen])
        chi2[i], dof[i] = float((parts**2).sum()), float(seen.sum())
    tolerated = TOLERATED_FADING if noise.remembers else TOLERATED
    if session.errs_slowly:
        tolerated = TOLERATED_SLOW
    return Misfit(chi2=chi2, dof=dof, tolerated=tolerated, doubt=doubt_of(session))


def doubt_of(session: Session) -> float:
    """Factor by which χ² of a single throw may exceed what the noise of all foretells.

    One film is tracked better than the next: the look of its stone is learnt from itself.
    """
    return TOLERATED_SLOW if session.errs_slowly else 1.0
