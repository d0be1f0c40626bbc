"""Differences of execution errors between tasks, teams, players and handles: a hierarchical fit.

The logarithm of a shot's errors over those of all shots is a sum of effects, one of each kind.
Effects of a kind are normal about 0, and how much they scatter is estimated from all shots
(empirical Bayes), so that few shots of a player say little about it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from curling_env.typing import Floats, Indices

GRID: Floats = np.arange(-1.0, 1.01, 0.1)
"""Logarithms of errors over those of all shots at which likelihoods are known."""
ROUNDS = 12
"""Rounds in which effects and scatters are estimated in turn."""
FIRST_SCATTER, LEAST_SCATTER = 0.3, 0.02
"""Scatter at the beginning, and the least one [e-folds]."""


@dataclass(frozen=True, kw_only=True)
class Effects:
    """Effects of one kind on the logarithm of errors.

    Parameters
    ----------
    scatter : standard deviation of the effects
    mean, variance : (m,) of each effect, given the shots
    """

    scatter: float
    mean: Floats
    variance: Floats

    def alone(self, k: int) -> tuple[float, float]:
        """Return an effect and its precision by its shots alone, without the other effects."""
        precision = max(1 / self.variance[k] - 1 / self.scatter**2, 0.0)
        if precision < 1e-9:
            return 0.0, 0.0
        return float(self.mean[k] / (precision * self.variance[k])), float(precision)


def fit_scatter(
    curves: Floats, owners: Mapping[str, Indices], weights: Floats
) -> dict[str, Effects]:
    """Estimate effects and their scatter.

    Parameters
    ----------
    curves : (n, len(GRID)) log-likelihood of each shot by the logarithm of its errors
    owners : for each kind, the owner of each shot, (n,) from 0
    weights : (n,) how often each shot counts
    """
    found = {
        kind: Effects(
            scatter=FIRST_SCATTER,
            mean=np.zeros(owner.max() + 1),
            variance=np.full(owner.max() + 1, FIRST_SCATTER**2),
        )
        for kind, owner in owners.items()
    }
    for _ in range(ROUNDS):
        for kind, owner in owners.items():
            rest = sum(found[k].mean[of] for k, of in owners.items() if k != kind)
            total = np.zeros((len(found[kind].mean), len(GRID)))
            np.add.at(total, owner, weights[:, None] * _shifted(curves, np.asarray(rest)))
            total -= 0.5 * (GRID / found[kind].scatter) ** 2
            chance = np.exp(total - total.max(axis=1, keepdims=True))
            chance /= chance.sum(axis=1, keepdims=True)
            mean = chance @ GRID
            variance = np.maximum(chance @ GRID**2 - mean**2, 1e-6)
            scatter = float(np.sqrt(np.mean(mean**2 + variance)))
            scatter = max(scatter, LEAST_SCATTER)
            found[kind] = Effects(scatter=scatter, mean=mean, variance=variance)
    return found


def _shifted(curves: Floats, by: Floats) -> Floats:
    """Return the curves with their argument moved by a number each; flat beyond the grid."""
    place = (GRID + by.reshape(-1, 1) - GRID[0]) / (GRID[1] - GRID[0])
    place = np.clip(np.broadcast_to(place, curves.shape), 0, len(GRID) - 1.001)
    low = place.astype(np.intp)
    part = place - low
    left, right = (np.take_along_axis(curves, low + k, axis=1) for k in (0, 1))
    return (1 - part) * left + part * right
