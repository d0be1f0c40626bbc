"""Bias and spread of an athlete's weight, line and rotation, over sessions.

The errors of an athlete's throws scatter about a bias, differently for each handle and weight. The
biases of these groups scatter about one of the athlete, and their covariances about a common one,
so that a group of few throws borrows from the others. The measurement error of every throw is known
and removed. The posterior is drawn by Gibbs sampling: every conditional is Gaussian or Wishart.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from math import inf, isfinite, pi
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import minimize_scalar
from scipy.special import chdtri, gammaln

from agents.coaching.calls import Handle, WeightClass
from agents.coaching.misses.causes import SessionCauses, ThrowCauses
from agents.coaching.tuning import (
    GIBBS_DRAWS,
    GIBBS_WARM_UP,
    GROUP_WEIGHT,
    TAIL_EVIDENCE,
    TAILS,
    USUAL_BIAS,
    USUAL_SPREAD,
)
from curling_env.sheet import HOG_TO_FAR_TEE
from curling_env.throw import Skill
from curling_env.typing import Floats, Integers

ERRORS = ("speed", "line", "spin")
"""Components of an error: m/s faster, m right at the far tee line, rad/s more turning."""
HANDLES: tuple[Handle, ...] = ("in-turn", "out-turn")
WEIGHT_CLASSES: tuple[WeightClass, ...] = ("guard", "draw", "hit")
_UNSEEN = 1e6
"""Variance of a component that was not measured."""


class Interval(NamedTuple):
    """Estimated number with its 95 % interval."""

    value: float
    low: float
    high: float


@dataclass(frozen=True, kw_only=True, eq=False)
class ErrorSummary:
    """Errors of some throws of an athlete.

    Parameters
    ----------
    handle : of all these throws; None for both
    weight : of all of them; None for every weight
    throws : number of throws
    bias : mean error of speed [m/s], line [m] and spin [rad/s]
    spread : standard deviations about it
    covariance : (3, 3) of speed, line and spin about the bias
    """

    handle: Handle | None
    weight: WeightClass | None
    throws: int
    bias: tuple[Interval, Interval, Interval]
    spread: tuple[Interval, Interval, Interval]
    covariance: Floats = field(repr=False)

    def ellipse(self, share: float = 0.5, points: int = 73) -> Floats:
        """Return the ellipse of line [m] and speed [m/s] around a share of the throws, (points, 2).

        Parameters
        ----------
        share : share of the throws inside, between 0 and 1
        points : number of points on the closed curve
        """
        values, vectors = np.linalg.eigh(self.covariance[np.ix_([1, 0], [1, 0])])
        angle = np.linspace(0.0, 2 * pi, points)
        radius = float(chdtri(2, 1 - share)) ** 0.5
        circle = np.column_stack([np.cos(angle), np.sin(angle)]) * np.sqrt(values) * radius
        return circle @ vectors.T + [self.bias[1].value, self.bias[0].value]

    @property
    def line_speed_correlation(self) -> float:
        """Correlation of line and speed about the bias."""
        return float(self.covariance[0, 1] / (self.covariance[0, 0] * self.covariance[1, 1]) ** 0.5)

    def as_dict(self) -> dict[str, object]:
        """Return the numbers by name."""
        found: dict[str, object] = {
            "handle": self.handle,
            "weight": self.weight,
            "throws": self.throws,
        }
        for kind in ("bias", "spread"):
            for name, one in zip(ERRORS, getattr(self, kind), strict=True):
                found |= {
                    f"{name}_{kind}": one.value,
                    f"{name}_{kind}_low": one.low,
                    f"{name}_{kind}_high": one.high,
                }
        found["line_speed_correlation"] = self.line_speed_correlation
        return found


@dataclass(frozen=True, kw_only=True, eq=False)
class AthleteErrors:
    """Errors of one athlete's throws.

    Parameters
    ----------
    name : the athlete; empty for throws without a name
    sessions : number of sessions with throws of theirs
    overall : all throws
    groups : by handle and weight, then by handle, then by weight; those with a throw
    errors : (n, 3) errors of the throws, as measured; NaN where one was not
    handles, weights : handle and weight class of each throw
    tails : degrees of freedom of the t-distribution of the errors; infinite if these throws are
        consistent with normal errors
    seconds_per_speed : change of hog-to-hog time per unit of speed, negative [s per m/s]; None if
        unknown
    turns_per_spin : turns of a throw per unit of spin [turns per rad/s]; None if unknown
    """

    name: str
    sessions: int
    overall: ErrorSummary
    groups: tuple[ErrorSummary, ...]
    errors: Floats = field(repr=False)
    handles: tuple[Handle | None, ...] = field(repr=False)
    weights: tuple[WeightClass, ...] = field(repr=False)
    tails: float = inf
    seconds_per_speed: float | None = None
    turns_per_spin: float | None = None

    @property
    def skill(self) -> Skill:
        """Return the spread of all throws as an execution error for planning and search.

        The bias is excluded: a player who knows it compensates for it, or trains it away.
        """
        return self.skill_of(self.overall)

    def skill_of(self, group: ErrorSummary) -> Skill:
        """Return the same from one group of throws."""
        speed, line, spin = (one.value for one in group.spread)
        # A line error counts to the right, the angle of a throw to the left.
        correlation = -group.line_speed_correlation
        of = " ".join(filter(None, (group.handle, group.weight)))
        return Skill(
            name=self.name or "athlete",
            sigma_speed=speed,
            sigma_angle=line / HOG_TO_FAR_TEE,
            sigma_spin=spin,
            tails=self.tails,
            correlation=correlation,
            source=f"measured on {group.throws} throws{f' ({of})' if of else ''}",
        )

    def as_dict(self) -> dict[str, object]:
        """Return the numbers by name, for JSON."""
        return {
            "athlete": self.name,
            "sessions": self.sessions,
            "seconds_per_speed": self.seconds_per_speed,
            "turns_per_spin": self.turns_per_spin,
            "tails": self.tails if isfinite(self.tails) else None,
            **self.overall.as_dict(),
            "groups": [group.as_dict() for group in self.groups],
        }


def athlete_errors(sessions: Sequence[SessionCauses], *, seed: int = 0) -> list[AthleteErrors]:
    """Estimate bias and spread of every athlete, by handle and weight, over sessions.

    Parameters
    ----------
    sessions : results of `hand_or_ice`, one per session
    seed : seed of the posterior draws

    Returns
    -------
    athletes with two throws or more, in order of their first throw
    """
    of: dict[str, list[tuple[int, ThrowCauses]]] = {}
    for number, session in enumerate(sessions):
        for one in session.throws:
            of.setdefault(one.athlete, []).append((number, one))
    return [
        _of_athlete(name, throws, np.random.default_rng([seed, k]))
        for k, (name, throws) in enumerate(of.items())
        if len(throws) > 1
    ]


def _of_athlete(
    name: str, throws: Sequence[tuple[int, ThrowCauses]], rng: np.random.Generator
) -> AthleteErrors:
    causes = [one for _, one in throws]
    errors, variances = map(np.array, zip(*map(_error_of, causes), strict=True))
    handles: tuple[Handle | None, ...] = tuple(
        one.call.handle or one.sheet.handle for one in causes
    )
    weights: tuple[WeightClass, ...] = tuple(one.call.weight_class for one in causes)
    kinds = list(dict.fromkeys(zip(handles, weights, strict=True)))
    group = np.array([kinds.index(kind) for kind in zip(handles, weights, strict=True)])
    bias, covariance = _sample(errors, variances, group, len(kinds), rng)
    counts = np.bincount(group, minlength=len(kinds))

    def summary(handle: Handle | None, weight: WeightClass | None) -> ErrorSummary | None:
        chosen = [
            k for k, (h, w) in enumerate(kinds) if handle in (None, h) and weight in (None, w)
        ]
        n = int(counts[chosen].sum())
        if not n:
            return None
        share = counts[chosen] / n
        return _summary(
            handle,
            weight,
            n,
            np.einsum("g,dgi->di", share, bias[:, chosen]),
            np.einsum("g,dgij->dij", share, covariance[:, chosen]),
        )

    overall = summary(None, None)
    assert overall is not None  # there are throws
    some_handles: list[Handle] = [h for h in HANDLES if h in handles]
    some_weights: list[WeightClass] = [w for w in WEIGHT_CLASSES if w in weights]
    found = [summary(h, w) for h in some_handles for w in some_weights]
    if len(some_weights) > 1:
        found += [summary(h, None) for h in some_handles]
    if len(some_handles) > 1:
        found += [summary(None, w) for w in some_weights]
    seen = np.where(np.einsum("nii->ni", variances) >= _UNSEEN, np.nan, errors)
    return AthleteErrors(
        name=name,
        sessions=len({number for number, _ in throws}),
        overall=overall,
        groups=tuple(group for group in found if group is not None),
        errors=seen,
        handles=handles,
        weights=weights,
        tails=tails_of(
            *squared_distances(
                seen, variances, group, bias.mean(axis=0), np.median(covariance, axis=0)
            )
        ),
        seconds_per_speed=_median(
            [
                one.errors.seconds.value / one.errors.speed.value
                for one in causes
                if one.errors.seconds is not None
                and one.errors.speed is not None
                and abs(one.errors.speed.value) > 1e-3
            ]
        ),
        turns_per_spin=_median(
            [
                measures.turns.value / abs(measures.spin.value)
                for measures in (one.sheet.measures for one in causes)
                if measures.turns is not None
                and measures.spin is not None
                and abs(measures.spin.value) > 0.2
            ]
        ),
    )


def _median(values: Sequence[float]) -> float | None:
    return float(np.median(values)) if values else None


def _error_of(one: ThrowCauses) -> tuple[Floats, Floats]:
    """Return the error (3,) of a throw and its covariance (3, 3)."""
    value, covariance = np.zeros(3), one.errors.covariance.copy()
    for k, name in enumerate(ERRORS):
        measured = getattr(one.errors, name)
        if measured is None:
            covariance[k], covariance[:, k] = 0.0, 0.0
            covariance[k, k] = _UNSEEN
        else:
            value[k] = measured.value
    return value, covariance + 1e-12 * np.eye(3)


def _summary(
    handle: Handle | None, weight: WeightClass | None, n: int, bias: Floats, covariance: Floats
) -> ErrorSummary:
    spread = np.sqrt(np.einsum("dii->di", covariance))

    def intervals(draws: Floats) -> tuple[Interval, Interval, Interval]:
        low, middle, high = np.quantile(draws, [0.025, 0.5, 0.975], axis=0)
        first, second, third = (
            Interval(float(middle[k]), float(low[k]), float(high[k])) for k in range(3)
        )
        return first, second, third

    scale = np.median(spread, axis=0)
    correlation = (covariance / spread[:, :, None] / spread[:, None, :]).mean(axis=0)
    return ErrorSummary(
        handle=handle,
        weight=weight,
        throws=n,
        bias=intervals(bias),
        spread=intervals(spread),
        covariance=correlation * np.outer(scale, scale),
    )


# --- the posterior -------------------------------------------------------------------------------


def _sample(
    errors: Floats, variances: Floats, group: Integers, groups: int, rng: np.random.Generator
) -> tuple[Floats, Floats]:
    """Draw each group's bias (d, groups, 3) and covariance (d, groups, 3, 3) from the posterior.

    Parameters
    ----------
    errors : (n, 3)
    variances : (n, 3, 3) covariances of their measurement errors
    group : (n,) the group of each throw
    """
    precision = np.linalg.inv(variances)
    counts = np.bincount(group, minlength=groups)
    usual = np.diag(np.square(USUAL_SPREAD))
    common = usual.copy()
    covariance = np.tile(usual, (groups, 1, 1))
    bias, centre = np.zeros((groups, 3)), np.zeros(3)
    apart = np.square(USUAL_BIAS)
    kept: list[tuple[Floats, Floats]] = []
    for draw in range(GIBBS_WARM_UP + GIBBS_DRAWS):
        # True error of each throw.
        inverse = np.linalg.inv(covariance)
        posterior = np.linalg.inv(precision + inverse[group])
        mean = np.einsum("nij,njk,nk->ni", posterior, precision, errors) + np.einsum(
            "nij,njk,nk->ni", posterior, inverse[group], bias[group]
        )
        root = np.linalg.cholesky(posterior)
        true = mean + np.einsum("nij,nj->ni", root, rng.standard_normal(mean.shape))
        # Bias of each group, and that of the athlete.
        total = np.zeros((groups, 3))
        np.add.at(total, group, true)
        for g in range(groups):
            spread = np.linalg.inv(counts[g] * inverse[g] + np.diag(1 / apart))
            middle = spread @ (inverse[g] @ total[g] + centre / apart)
            bias[g] = rng.multivariate_normal(middle, spread, method="cholesky")
        weight = groups / apart + 1 / np.square(4 * np.array(USUAL_BIAS))
        centre = (bias.sum(axis=0) / apart) / weight
        centre = centre + rng.standard_normal(3) / np.sqrt(weight)
        # Scatter between the groups' biases: inverse gamma, with a prior worth one group.
        off = ((bias - centre) ** 2).sum(axis=0) + np.square(USUAL_BIAS) / 4
        apart = off / rng.chisquare(groups + 1, 3)
        # Covariance of each group, and the common one.
        for g in range(groups):
            left = true[group == g] - bias[g]
            scale = (GROUP_WEIGHT - 4) * common + left.T @ left
            covariance[g] = np.linalg.inv(
                _wishart(GROUP_WEIGHT + counts[g], np.linalg.inv(scale), rng)
            )
        wanted = np.linalg.inv(usual) * 3 + (GROUP_WEIGHT - 4) * np.linalg.inv(covariance).sum(
            axis=0
        )
        common = _wishart(3 + groups * GROUP_WEIGHT, np.linalg.inv(wanted), rng)
        if draw >= GIBBS_WARM_UP:
            kept.append((bias.copy(), covariance.copy()))
    return np.array([b for b, _ in kept]), np.array([c for _, c in kept])


def _wishart(freedom: float, scale: Floats, rng: np.random.Generator) -> Floats:
    """Draw from a Wishart distribution, by Bartlett's decomposition."""
    size = len(scale)
    lower = np.tril(rng.standard_normal((size, size)), -1)
    lower[np.diag_indices(size)] = np.sqrt(rng.chisquare(freedom - np.arange(size)))
    root = np.linalg.cholesky(scale) @ lower
    return root @ root.T


def tails_of(distances: ArrayLike, measured: ArrayLike) -> float:
    """Estimate the degrees of freedom of the t-distribution of errors with these sizes.

    Maximum likelihood over the degrees of freedom and a common factor of all spreads. Tails are
    reported only if a normal distribution is far less likely: among few throws a wild one proves
    little.

    Parameters
    ----------
    distances : (n,) sum of the squares of each error over its spread (Mahalanobis, squared)
    measured : (n,) number of measured components

    Returns
    -------
    degrees of freedom, from the range of `TAILS`; infinite for normal errors
    """
    squares, count = np.asarray(distances, dtype=np.float64), np.asarray(measured)
    squares, count = squares[count > 0], count[count > 0]
    if not len(squares):
        return math.inf
    normal = _log_likelihood(squares, count, math.inf)
    found = [(_log_likelihood(squares, count, tails), tails) for tails in TAILS]
    best, tails = max(found)
    return tails if 2 * (best - normal) > TAIL_EVIDENCE else math.inf


def squared_distances(
    errors: Floats, variances: Floats, group: Integers, bias: Floats, covariance: Floats
) -> tuple[Floats, Integers]:
    """Return squared sizes of errors over their spread (n,), and numbers of measured components
    (n,).

    Parameters
    ----------
    errors : (n, 3); NaN where a component was not measured
    variances : (n, 3, 3) covariances of their measurement errors
    group : (n,) the group of each throw
    bias, covariance : (groups, 3) and (groups, 3, 3) of the errors of each group
    """
    sizes, count = np.zeros(len(errors)), np.isfinite(errors).sum(axis=1)
    for k, (error, variance, g) in enumerate(zip(errors, variances, group, strict=True)):
        seen = np.flatnonzero(np.isfinite(error))
        off = (error - bias[g])[seen]
        spread = (covariance[g] + variance)[np.ix_(seen, seen)]
        sizes[k] = off @ np.linalg.solve(spread, off) if len(seen) else 0.0
    return sizes, count


def _log_likelihood(squares: Floats, count: Integers, tails: float) -> float:
    """Return the log likelihood of the sizes with the most likely common factor of the spreads."""

    def given(log_factor: float) -> float:
        u = squares * math.exp(-2 * log_factor)
        if tails == math.inf:
            each = -count / 2 * math.log(2 * math.pi) - u / 2
        else:
            # The spreads are standard deviations, so the scale is smaller than they are.
            each = gammaln((tails + count) / 2) - gammaln(tails / 2)
            each -= count / 2 * math.log((tails - 2) * math.pi)
            each -= (tails + count) / 2 * np.log1p(u / (tails - 2))
        return float((each - count * log_factor).sum())

    found: Any = minimize_scalar(lambda f: -given(float(f)), bounds=(-2.0, 2.0), method="bounded")
    return -float(found.fun)
