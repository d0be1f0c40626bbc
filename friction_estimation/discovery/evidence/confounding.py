"""Effects that the data cannot distinguish, and throws that would."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from curling_env.physics.state import State
from friction_estimation.discovery.evidence.next_throws import (
    in_words,
    is_playable,
    is_seen,
    lay_out,
    noise_of_rows,
    trial_throws,
)
from friction_estimation.discovery.model.candidates import candidates, effect_of
from friction_estimation.discovery.model.fit import SessionFit, fit
from friction_estimation.discovery.model.model import predict
from friction_estimation.discovery.search.selection import score_candidates, try_term, without_term
from friction_estimation.discovery.tuning import LEAST_GAIN, RIVAL_GAIN


@dataclass(frozen=True, kw_only=True, eq=False)
class Alternative:
    """A candidate that the data cannot rule out in place of a named effect.

    Parameters
    ----------
    name : effect of the candidate
    throw : throw that would separate the two, in words
    strength : difference of −2 ln likelihood that this throw would bring
    """

    name: str
    throw: str
    strength: float


def alternatives(fitted: SessionFit, label: str) -> list[Alternative]:
    """Return candidates that fit as well as a named effect.

    Parameters
    ----------
    fitted : fit with the effect
    label : label of its term
    """
    without = without_term(fitted, label)
    gain = without.deviance - fitted.deviance
    rivals = [
        score
        for score in score_candidates(without, candidates(fitted.session, without.model.terms))
        if effect_of(score.term.label) != effect_of(label)
        and score.gain > min(RIVAL_GAIN * gain, gain - LEAST_GAIN)
    ]
    found: list[Alternative] = []
    for rival in rivals[:3]:
        trial = try_term(without, rival.term)
        worse = gain - trial.gain
        if worse < LEAST_GAIN and trial.gain > trial.needed:
            throw, strength = separating_throw(fitted, trial.fit)
            found.append(
                Alternative(name=effect_of(rival.term.label), throw=throw, strength=strength)
            )
    return found


def separating_throw(one: SessionFit, other: SessionFit) -> tuple[str, float]:
    """Return the playable throw whose predicted paths differ most between two models.

    Release and friction of a throw are unknown in advance, so differences that another release or
    friction would remove do not count.

    Returns
    -------
    the throw in words, and the difference of −2 ln likelihood that it would bring; no words where
    no throw can be made, or light gates would time it
    """
    if one.session.gates is not None:
        return "", 0.0
    sheet, terms = one.model.ice.sheet, (*one.model.terms, *other.model.terms)
    throws = trial_throws(one, terms)
    session, states = lay_out(one.session, throws)
    ideal = predict(one.model, session, states, np.zeros(len(session)))
    paths = [ideal[session.rows(i)] for i in range(len(session))]
    playable = np.array([is_playable(path, sheet) for path in paths])
    if not playable.any():
        return "", 0.0
    session = replace(session, xy=ideal[:, :2], theta=ideal[:, State.THETA])
    session = session.without_rows(~is_seen(ideal))  # a stone is seen at its release
    adapted = fit(other.model, session, noise_of_rows(one), states=states, shared=False)
    grams, log_terms = adapted.linear.each()
    scores = np.where(playable, grams[:, -1, -1] + log_terms, -np.inf)
    k = int(np.argmax(scores))
    return in_words(throws[k], paths[k], sheet, terms), float(scores[k])
