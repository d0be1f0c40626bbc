"""What a finished discovery is worth: how well its models foretell, and what would tell more."""

from __future__ import annotations

from dataclasses import dataclass

from threadpoolctl import threadpool_limits

from curling_env.typing import Floats
from friction_estimation.discovery.discover import Discovery
from friction_estimation.discovery.evidence.loo_pit import LooPit, loo_pit
from friction_estimation.discovery.evidence.next_throws import NextThrow, next_throws
from friction_estimation.discovery.evidence.predictive_density import (
    PredictiveScore,
    compare_models,
    left_out_densities,
)
from friction_estimation.discovery.evidence.sought_place import densities_with_place_sought
from friction_estimation.discovery.model.fit import SessionFit, refit
from friction_estimation.discovery.model.model import Model
from friction_estimation.discovery.search.selection import SelectionRound, Trial

BASELINE, NAMED = "baseline", "named"
"""Names of the model that was given and of the one with all that was found."""

CLOSEST = 3
"""Candidates of the last round that are compared beside the improved model."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Assessment:
    """What a discovery is worth.

    Parameters
    ----------
    models : expected log predictive density of every model that was in question, the best first
    pit : whether the forecasts of the improved model err as often as they say
    next_throws : throws that would teach most beside these
    """

    models: list[PredictiveScore]
    pit: LooPit
    next_throws: list[NextThrow]


def assess(found: Discovery) -> Assessment:
    """Assess a discovery, on all its throws and with the noise of the improved model."""
    # As in `discover`: more threads of linear algebra only wait for each other.
    with threadpool_limits(limits=1, user_api="blas"):
        return Assessment(
            models=compare_models(_densities(models_in_question(found))),
            pit=loo_pit(found.seen),
            next_throws=next_throws(found.final),
        )


def models_in_question(found: Discovery) -> dict[str, SessionFit]:
    """Fits of all models that were in question, by name, of the same throws with the same noise.

    The baseline; the baseline with each candidate that was fitted beside it first; the improved
    model; that without each of the effects that it names; and that with each of the candidates that
    came closest to being taken too.
    """
    base, final = found.final_base, found.seen
    fits = {BASELINE: base}
    if _labels(final.model) != _labels(base.model):
        fits[NAMED] = final
    for effect in found.effects:
        without = final.model.without(effect.label)
        _add(fits, f"{NAMED} without {effect.label}", refit(final, without))
    rounds = found.selection.rounds
    for trial in rounds[0].trials if rounds else []:
        model = trial.fit.model
        _add(fits, f"{BASELINE} + {trial.term.label}", _beside(base, model, trial, rounds[0]))
    own = _labels(final.model)
    rivals = [trial for trial in rounds[-1].trials if trial.term.label not in own] if rounds else []
    for trial in rivals[:CLOSEST]:
        model = final.model.with_terms(trial.term)
        name = NAMED if NAMED in fits else BASELINE
        _add(fits, f"{name} + {trial.term.label}", _beside(final, model, trial, rounds[-1]))
    return fits


def _densities(fits: dict[str, SessionFit]) -> dict[str, Floats]:
    """Ln density of each throw under the fit of each model to all the others, (k,) by name.

    The place of a patch that is no more than a candidate is sought anew without the throw.
    """
    out: dict[str, Floats] = {}
    for name, fitted in fits.items():
        start, _, label = name.partition(" + ")
        sought = [
            term.name
            for term in fitted.model.terms
            if term.label == label and term.card.search.area is not None
        ]
        out[name] = (
            densities_with_place_sought(fits[start], sought[0])
            if sought
            else left_out_densities(fitted)
        )
    return out


def _beside(start: SessionFit, model: Model, trial: Trial, tried: SelectionRound) -> SessionFit:
    """The fit of a model that has one term more than a fitted one.

    Parameters
    ----------
    start : the fit without the term
    model : model with it, at the values of its trial
    trial, tried : the trial and its round
    """
    fitted = refit(start, model)
    if fitted.deviance > start.deviance:  # its trial had fewer throws, and went astray
        scores = {score.term.label: score.term for score in tried.scores}
        begin = scores.get(trial.term.label, trial.term)
        fitted = refit(start, start.model.with_terms(begin))
    return fitted


def _add(fits: dict[str, SessionFit], name: str, fitted: SessionFit) -> None:
    """Add a model, unless one with the same terms is there: it may be asked for in two ways."""
    if _labels(fitted.model) not in [_labels(each.model) for each in fits.values()]:
        fits[name] = fitted


def _labels(model: Model) -> set[str]:
    return {term.label for term in model.terms}
