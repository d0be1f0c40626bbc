"""Score tests: all candidates at once, linearised around the present fit.

Every candidate is a few columns of sensitivities. With releases, friction and the model's own
parameters projected out, they show how much each candidate would gain and how small an effect the
data could have shown.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from curling_env.typing import Floats
from friction_estimation.discovery.model.candidates import Term
from friction_estimation.discovery.model.elimination import eliminate_factor, eliminate_states
from friction_estimation.discovery.model.fit import SessionFit, linearise
from friction_estimation.discovery.model.model import Model
from friction_estimation.discovery.model.quadratic import (
    prior_gram,
    profile_amplitudes,
    profile_spread,
)
from friction_estimation.discovery.tuning import CLEARLY_SEEN, LEAST_SPREAD


@dataclass(frozen=True, kw_only=True)
class CandidateScore:
    """The score of one candidate around the present fit.

    Parameters
    ----------
    term : candidate at its neutral values
    gain : fall of −2 ln likelihood if everything stays linear
    smallest : for each parameter the smallest value that these data would have shown clearly
    """

    term: Term
    gain: float
    smallest: dict[str, float]


def score_candidates(fitted: SessionFit, terms: Sequence[Term]) -> list[CandidateScore]:
    """The scores of candidates around a fit, the most promising first."""
    if not terms:
        return []
    model = fitted.model.with_terms(*terms)
    _, _, reduced = linearise(model, fitted.session, fitted.noise, fitted.states, fitted.ln_factors)
    own = len(fitted.model.vector)
    places: list[list[int]] = []
    position = own
    for term in terms:
        places.append(list(range(position, position + len(term.free))))
        position += len(term.free)
    prior = prior_gram(model, reduced.shape[1] - 1)
    base = _least(reduced, fitted, prior, list(range(own)))
    grams, _ = eliminate_factor(reduced, fitted.ln_factors, fitted.model.spread)
    total = grams.sum(axis=0) + prior
    projected = _project(total, own)
    scores: list[CandidateScore] = []
    for term, place in zip(terms, places, strict=True):
        gain = base - _least(reduced, fitted, prior, [*range(own), *place])
        inner = projected[np.ix_(np.array(place) - own, np.array(place) - own)]
        covariance = np.linalg.pinv(inner)
        sigma = np.sqrt(np.maximum(np.diag(covariance), 0.0))
        smallest = {n: CLEARLY_SEEN * float(s) for n, s in zip(term.free, sigma, strict=True)}
        scores.append(CandidateScore(term=term, gain=float(gain), smallest=smallest))
    return sorted(scores, key=lambda score: -score.gain)


def least_deviance(fitted: SessionFit, model: Model, reduced: Floats) -> float:
    """F at its minimum over all shared parameters of a model that is linear around a fit.

    Parameters
    ----------
    fitted : fit
    model : model with the parameters of the columns
    reduced : (k, m, m) Gram matrices, as of `eliminate_factor`
    """
    count = reduced.shape[1] - 2
    prior = prior_gram(model, count + 1)
    around = replace(fitted, model=replace(model, spread=fitted.model.spread))
    return _least(reduced, around, prior, list(range(count)))


def _least(reduced: Floats, fitted: SessionFit, prior: Floats, kept: list[int]) -> float:
    """F at its minimum over some of the shared parameters and the spread."""
    chosen = np.array([*kept, reduced.shape[1] - 2])
    columns = np.concatenate([[0], chosen + 1])
    part = reduced[:, columns[:, None], columns]
    model = fitted.model
    spreads = np.array([*np.geomspace(LEAST_SPREAD, 0.3, 14), max(model.spread, LEAST_SPREAD)])
    own = prior[np.ix_(chosen, chosen)]
    spread, _, least = profile_spread(part, fitted.ln_factors, own, spreads)
    if not model.fields:
        return least
    grams, log_terms = eliminate_factor(part, fitted.ln_factors, spread)
    total = grams.sum(axis=0)
    return profile_amplitudes(model, total)[1] + float(log_terms.sum())


def _project(total: Floats, own: int) -> Floats:
    """Information of the candidates' columns, with the model's own projected out."""
    inner = total[:own, :own]
    scale = 1.0 / np.sqrt(np.maximum(np.diag(inner), 1e-300))
    scaled = inner * scale[:, None] * scale + 1e-10 * np.eye(own)
    cross = scale[:, None] * total[:own, own:-1]
    return total[own:-1, own:-1] - cross.T @ np.linalg.solve(scaled, cross)


def throw_deviances(fitted: SessionFit) -> Floats:
    """Deviance of every throw under a fit whose shared parameters were not fitted to it, (k,)."""
    reduced = eliminate_states(fitted.grams)
    grams, log_terms = eliminate_factor(reduced, fitted.ln_factors, fitted.model.spread)
    return grams[:, -1, -1] + log_terms


def sign_flip_p(improvements: Floats, rng: np.random.Generator) -> float:
    """Probability of so large a mean improvement if the sign of each throw is chance."""
    n = len(improvements)
    if n == 0 or improvements.sum() <= 0:
        return 1.0
    # No single throw may decide, even if it gains a thousand times more than the others.
    capped = np.clip(improvements, -9.0, 9.0)
    if n <= 14:
        signs = 1.0 - 2.0 * ((np.arange(2**n)[:, None] >> np.arange(n)) & 1)
        sums = signs @ capped
        return float((sums >= capped.sum() - 1e-9).mean())
    signs = rng.choice([-1.0, 1.0], size=(20_000, n))
    return float(((signs @ capped >= capped.sum() - 1e-9).sum() + 1) / 20_001)


def holm(p_values: Sequence[float]) -> list[float]:
    """P values with Holm's step-down correction, in the order given."""
    order = np.argsort(p_values)
    corrected = np.empty(len(p_values))
    worst = 0.0
    for rank, i in enumerate(order):
        worst = max(worst, min(1.0, (len(p_values) - rank) * float(p_values[i])))
        corrected[i] = worst
    return corrected.tolist()
