"""Differences of execution errors between tasks, teams, players and handles: a hierarchical fit.

The logarithm of a shot's errors over those of all shots is a sum of effects, one of each kind.
Effects of a kind are normal about 0, with a scatter that is estimated from all shots (empirical
Bayes), so that effects of few shots shrink to 0.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.special import logsumexp, softmax
from scipy.stats import chi2

from curling_env.typing import Floats, Indices

GRID: Floats = np.arange(-1.0, 1.01, 0.1)
"""Logarithms of errors over those of all shots at which likelihoods are known."""
SCATTERS: Floats = np.append(0.02, np.arange(0.05, 1.01, 0.05))
"""Candidate scatters [e-folds]; the first is practically zero."""
ROUNDS = 12
"""Number of rounds in which effects and scatters are estimated in turn."""


@dataclass(frozen=True, kw_only=True)
class Effects:
    """Effects of one kind on the logarithm of errors.

    Parameters
    ----------
    scatter, low, high : standard deviation of the effects, with its 95 % interval
    mean, variance : (m,) of each effect, given the shots
    """

    scatter: float
    low: float
    high: float
    mean: Floats
    variance: Floats

    def alone(self, k: int) -> tuple[float, float]:
        """Return an effect and its precision from its shots alone, without the other effects."""
        precision = max(1 / self.variance[k] - 1 / self.scatter**2, 0.0)
        if precision < 1e-9:
            return 0.0, 0.0
        return float(self.mean[k] / (precision * self.variance[k])), float(precision)


def fit_scatter(curves: Floats, owners: Mapping[str, Indices]) -> dict[str, Effects]:
    """Estimate effects and their scatter: the scatter maximises the likelihood with all effects of
    the kind integrated out, and its interval follows from χ² of one degree.

    Parameters
    ----------
    curves : (n, len(GRID)) log-likelihood of each shot by the logarithm of its errors
    owners : for each kind, the owner of each shot, (n,) from 0
    """
    mean = {kind: np.zeros(owner.max() + 1) for kind, owner in owners.items()}
    found: dict[str, Effects] = {}
    prior = -0.5 * (GRID / SCATTERS[:, None]) ** 2
    prior -= logsumexp(prior, axis=1, keepdims=True)
    for _ in range(ROUNDS):
        for kind, owner in owners.items():
            rest = sum(mean[k][of] for k, of in owners.items() if k != kind)
            total = np.zeros((len(mean[kind]), len(GRID)))
            np.add.at(total, owner, _shifted(curves, np.asarray(rest)))
            likelihood = logsumexp(total[:, None] + prior, axis=2).sum(axis=0)
            best = int(np.argmax(likelihood))
            close = SCATTERS[likelihood > likelihood[best] - 0.5 * chi2.ppf(0.95, 1)]
            chance = softmax(total + prior[best], axis=1)
            mean[kind] = chance @ GRID
            found[kind] = Effects(
                scatter=float(SCATTERS[best]),
                low=float(close[0]),
                high=float(close[-1]),
                mean=mean[kind],
                variance=np.maximum(chance @ GRID**2 - mean[kind] ** 2, 1e-6),
            )
    return found


def _shifted(curves: Floats, by: Floats) -> Floats:
    """Return the curves with their argument moved by a number each; flat beyond the grid."""
    place = (GRID + by.reshape(-1, 1) - GRID[0]) / (GRID[1] - GRID[0])
    place = np.clip(np.broadcast_to(place, curves.shape), 0, len(GRID) - 1.001)
    low = place.astype(np.intp)
    part = place - low
    left, right = (np.take_along_axis(curves, low + k, axis=1) for k in (0, 1))
    return (1 - part) * left + part * right
