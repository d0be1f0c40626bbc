"""Level of each stone against its set, from scattered measurements of single throws."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import minimize_scalar
from scipy.special import stdtrit

from curling_env.typing import Floats, Integers


@dataclass(frozen=True, kw_only=True, eq=False)
class Levels:
    """Ln factor of each stone against the set.

    Parameters
    ----------
    value : (k,)
    covariance : (k, k)
    freedom : degrees of freedom of its scale
    between : variance from throw to throw
    noise : (k,) variance of one throw of each stone, including its measurement
    """

    value: Floats
    covariance: Floats
    freedom: float
    between: float
    noise: Floats

    def interval(self, weights: Floats) -> tuple[float, float, float]:
        """Return a weighted sum, and the ends of its interval."""
        value = float(weights @ self.value)
        half = float(np.sqrt(weights @ self.covariance @ weights)) * self.reach
        return value, value - half, value + half

    @property
    def reach(self) -> float:
        """Half-width of a 95 % interval [standard errors]."""
        return float(stdtrit(self.freedom, 0.975))


def levels(measured: Floats, stone: Integers, count: int, others: Sequence[Floats]) -> Levels:
    """Estimate the level of each stone by restricted likelihood.

    Parameters
    ----------
    measured : (n, 2) measured number of each throw, and its standard error
    stone : (n,) the stone of each
    count : number of stones
    others : (n,) each, further covariates; dropped if confounded with the stones
    """
    value, variance = measured[:, 0], measured[:, 1] ** 2
    design = np.eye(count)[stone]
    for other in others:
        size = float(np.ptp(other))
        wider = np.column_stack([design, (other - other.mean()) / (size or 1.0)])
        enough = len(value) - wider.shape[1] >= 2
        if size > 0 and enough and np.linalg.cond(wider) < 50.0:
            design = wider

    def solve(between: float) -> tuple[Floats, Floats, float]:
        weight = 1 / (variance + between)
        normal = design.T @ (design * weight[:, None])
        inverse = np.linalg.inv(normal)
        found = inverse @ (design.T @ (weight * value))
        left = value - design @ found
        _, log_determinant = np.linalg.slogdet(normal)
        cost = float((weight * left**2).sum() - np.log(weight).sum() + log_determinant)
        return found, np.asarray(inverse, dtype=np.float64), cost

    free = max(len(value) - design.shape[1], 1)
    plain = value - design @ np.linalg.lstsq(design, value, rcond=None)[0]
    most = 4 * float(plain @ plain) / free + 1e-10
    best: Any = minimize_scalar(
        lambda root: solve(root**2)[2], bounds=(0.0, most**0.5), method="bounded"
    )
    between = min(0.0, float(best.x) ** 2, key=lambda variance: solve(variance)[2])
    found, inverse, _ = solve(between)
    centre = np.eye(count) - 1 / count
    noise = between + np.array([float(variance[stone == k].mean()) for k in range(count)])
    return Levels(
        value=centre @ found[:count],
        covariance=np.asarray(centre @ inverse[:count, :count] @ centre, dtype=np.float64),
        freedom=float(free),
        between=between,
        noise=noise,
    )
