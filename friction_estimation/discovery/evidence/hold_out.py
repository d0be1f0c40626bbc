"""Held-out throws: they are not used in any fit, and are forecast.

For the forecast gap the release is estimated from the first seconds of a throw only; then its path
and rest are predicted. A perfect model has errors too, because the first seconds are noisy and the
friction varies from throw to throw: the noise floor.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from curling_env.physics.state import State
from curling_env.typing import Flags, Floats, Indices
from friction_estimation.discovery.data.session import Session
from friction_estimation.discovery.evidence.posterior import release_precisions
from friction_estimation.discovery.model.fit import SessionFit, fit
from friction_estimation.discovery.model.linearisation import gram_matrix
from friction_estimation.discovery.model.model import Model, predict
from friction_estimation.discovery.model.noise import SessionNoise
from friction_estimation.discovery.tuning import HELD_OUT_SHARE, LEAST_THROWS


@dataclass(frozen=True, kw_only=True, eq=False)
class ForecastGap:
    """Forecast errors of throws.

    Parameters
    ----------
    path_rms : root mean square distance over all rows after the first seconds [m]
    rest_error : the same at the last row that was measured, at rest where the stone rests [m]
    predicted : (rows, 2) forecast positions
    """

    path_rms: float
    rest_error: float
    predicted: Floats

    def numbers(self) -> dict[str, float]:
        """Return the gap for a report."""
        return {
            "path_rms_m": float(f"{self.path_rms:.4g}"),
            "rest_error_m": float(f"{self.rest_error:.4g}"),
        }


def choose_held_out(session: Session, rng: np.random.Generator) -> Indices:
    """Indices of throws to hold out, spread over directions, spins, speeds and time.

    If possible, every stone and swept throws stay among the others.
    """
    n = len(session)
    if n < LEAST_THROWS:
        return np.empty(0, dtype=np.intp)
    states = session.first_states
    speed = np.hypot(states[:, 2], states[:, 3])
    rank = np.argsort(np.argsort(speed)) / max(n - 1, 1)
    features = np.column_stack(
        [
            np.sign(states[:, State.VY]),
            np.sign(states[:, State.OMEGA]),
            2 * rank - 1,
            2 * session.orders / max(n - 1, 1) - 1,
        ]
    )
    swept = np.array([bool(session.swept[session.rows(i)].any()) for i in range(n)])
    kinds = (session.stones, swept)

    def score(chosen: Indices) -> float:
        rest = np.setdiff1d(np.arange(n), chosen)
        lost = sum(len(np.unique(kind)) - len(np.unique(kind[rest])) for kind in kinds)
        bias = np.abs(features[chosen].mean(axis=0) - features.mean(axis=0)).sum()
        spread = np.abs(features[chosen].std(axis=0) - features.std(axis=0)).sum()
        return float(bias + 0.5 * spread + 3.0 * lost)

    count = max(2, round(HELD_OUT_SHARE * n))
    tried = [np.sort(rng.choice(n, count, replace=False)) for _ in range(300)]
    return min(tried, key=score)


def forecast(model: Model, session: Session, noise: SessionNoise) -> ForecastGap:
    """Forecast every throw from its first seconds and compare with what was measured."""
    early = session.early
    short = session.without_rows(~early)
    # The friction of a single throw is not known in advance: its factor stays one.
    plain = replace(model, spread=0.0)
    states = fit(plain, short, noise, shared=False).states
    predicted = predict(model, session, states, np.zeros(len(session)))[:, :2]
    miss = np.nan_to_num(session.observed[:, :2] - predicted)
    return _gap(session, (miss**2).sum(axis=1), ~early, predicted)


def noise_floor(fitted: SessionFit, session: Session) -> ForecastGap:
    """Return the forecast gap that a perfect model would have on these throws."""
    model, noise = fitted.model, fitted.noise
    early = session.early
    whole = fit(model, session, noise, shared=False)
    predicted, columns = whole.predicted, whole.columns
    prior, variance = release_precisions(session), np.empty(len(session.times))
    for i in range(len(session)):
        rows = session.rows(i)
        known = np.where(early[rows, None], session.observed[rows], np.nan)
        own = np.concatenate([columns[rows, :, :7], known[:, :, None]], axis=2)
        gram = gram_matrix(session, noise, i, own)
        covariance = np.linalg.inv(gram[:6, :6] + np.diag(prior[i]))
        # A throw with higher friction looks like one released with less speed.
        taken_for_release = covariance @ gram[:6, 6]
        seen = np.isfinite(session.observed[rows, :2])
        reach = columns[rows][:, :2, :6] * seen[:, :, None]
        by_friction = columns[rows][:, :2, 6] * seen - reach @ taken_for_release
        spread = (model.spread * by_friction) ** 2
        variance[rows] = (
            np.einsum("ncj,jk,nck->n", reach, covariance, reach)
            + spread.sum(axis=1)
            + seen.sum(axis=1) * (noise.position * session.sigma[rows, 0]) ** 2
        )
    return _gap(session, variance, ~early, predicted[:, :2])


def _gap(session: Session, squared: Floats, late: Flags, predicted: Floats) -> ForecastGap:
    counted = late if late.any() else np.ones(len(late), dtype=bool)
    last = session.starts[1:] - 1
    return ForecastGap(
        path_rms=float(np.sqrt(squared[counted].mean())),
        rest_error=float(np.sqrt(squared[last].mean())),
        predicted=predicted,
    )
