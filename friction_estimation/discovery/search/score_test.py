"""Score tests: all candidates at once, linearised around the present fit.

Every candidate is a few columns of sensitivities. With releases, friction and the model's own
parameters projected out, they show how much each candidate would gain and how small an effect the
data could have shown.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from friction_estimation.discovery.model.candidates import Term
from friction_estimation.discovery.model.fit import SessionFit
from friction_estimation.discovery.model.minimum import projected
from friction_estimation.discovery.tuning import CLEARLY_SEEN


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
    linear = fitted.linear_with(*terms)
    own = np.arange(len(fitted.model.vector))
    others = np.arange(len(own), len(linear.model.vector))
    base = linear.least(own)
    information = projected(linear.total(), others, own)
    scores: list[CandidateScore] = []
    position = 0
    for term in terms:
        place = np.arange(position, position + len(term.free))
        position += len(term.free)
        covariance = np.linalg.pinv(information[np.ix_(place, place)])
        sigma = np.sqrt(np.maximum(np.diag(covariance), 0.0))
        smallest = {n: CLEARLY_SEEN * float(s) for n, s in zip(term.free, sigma, strict=True)}
        gain = base - linear.least(np.concatenate([own, others[place]]))
        scores.append(CandidateScore(term=term, gain=float(gain), smallest=smallest))
    return sorted(scores, key=lambda score: -score.gain)
