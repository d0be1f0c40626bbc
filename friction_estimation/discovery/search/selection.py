"""The selection of effects: added one by one, refined, and dropped if they no longer pay.

All candidates are scored at once, linearised around the present fit: each is a few columns of
sensitivities. With releases, friction and the model's own parameters projected out, they give the
gain of each candidate and the smallest detectable effect.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from curling_env.typing import Progress, no_progress
from friction_estimation.discovery.data.session import Session
from friction_estimation.discovery.model.candidates import Term, candidates
from friction_estimation.discovery.model.fit import SessionFit, fit, refit, releases_near
from friction_estimation.discovery.model.minimum import projected
from friction_estimation.discovery.model.model import Model
from friction_estimation.discovery.model.noise import SessionNoise, estimate_noise, outlying_rows
from friction_estimation.discovery.model.sensitivity import friction_along
from friction_estimation.discovery.search.maps import find_map, renew_map
from friction_estimation.discovery.search.patches import find_patches, place_sides
from friction_estimation.discovery.search.residuals import Misfit, misfit_of
from friction_estimation.discovery.tuning import (
    CLEARLY_SEEN,
    GAIN_PER_PARAMETER,
    LEAST_GAIN,
    MOST_ADDITIONS,
    MOST_EFFECTS,
    MOST_TRIALS,
)


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
    """Return the scores of candidates around a fit, the most promising first."""
    if not terms:
        return []
    linear = fitted.linear_with(*terms)
    own = np.arange(len(fitted.model.vector))
    others = np.arange(len(own), len(linear.model.vector))
    base = linear.least(own)
    information = projected(linear.total(), others)
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


FIRST_NOISE = SessionNoise(
    white=(0.005, 0.005, 0.02), fading=(0.0, 0.0, 0.0), memory=(0.1, 0.1, 0.1)
)
"""Noise that is assumed until residuals show it."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Trial:
    """A candidate fitted beside the model.

    Parameters
    ----------
    term : candidate with its fitted values
    fit : fit of the model with it
    gain : fall of −2 ln likelihood
    cost : number of parameters that it added
    """

    term: Term
    fit: SessionFit
    gain: float
    cost: int

    @property
    def needed(self) -> float:
        """Required gain of its parameters."""
        return LEAST_GAIN + GAIN_PER_PARAMETER * (self.cost - 1)

    @property
    def net(self) -> float:
        """Gain minus the required gain of its further parameters."""
        return self.gain - GAIN_PER_PARAMETER * (self.cost - 1)


@dataclass(frozen=True, kw_only=True, eq=False)
class SelectionRound:
    """One round of the selection.

    Parameters
    ----------
    scores : scores of all candidates
    trials : candidates that were fitted, the best first
    chosen : label of the candidate that was taken; empty if none was
    """

    scores: list[CandidateScore]
    trials: list[Trial]
    chosen: str


@dataclass(frozen=True, kw_only=True, eq=False)
class Selection:
    """The outcome of the selection.

    Parameters
    ----------
    base, best : fits before and after it, of the same session and with the same noise
    before : slow misfit of the first
    rounds : rounds of the selection, one or more
    """

    base: SessionFit
    best: SessionFit
    before: Misfit
    rounds: list[SelectionRound]


def fit_with_noise(
    model: Model,
    session: Session,
    start: SessionNoise | None = None,
    *,
    near: Sequence[SessionFit] = (),
    iterations: int = 12,
) -> SessionFit:
    """Fit a model with the noise of its residuals, and without outlying rows.

    Parameters
    ----------
    model, session : what is fitted to what
    start : an earlier estimate of the noise
    near : fits of some of the throws to nearly the same model, from whose releases they begin; the
        later goes first
    iterations : most steps of the last fit
    """
    noise = start or FIRST_NOISE
    states, ln_factors = releases_near(session, *near)
    # For a model that was fitted before, the releases settle first.
    first = fit(model, session, noise, states=states, ln_factors=ln_factors, shared=not near)
    session = session.without_rows(outlying_rows(session, first.residuals))
    first = fit(first.model, session, noise, states=first.states, ln_factors=first.ln_factors)
    noise = estimate_noise(session, first.residuals, start=start)
    return refit(replace(first, noise=noise), first.model, iterations=iterations)


def try_term(fitted: SessionFit, term: Term) -> Trial:
    """Fit a candidate together with the model: its strength first, then its shape."""
    # Below this gain its shape is not fitted, and it is of no use.
    goal = fitted.deviance - GAIN_PER_PARAMETER
    trial = refit(fitted, fitted.model.with_terms(term), goal=goal)
    if term.wears_map:
        trial = _on_own_cells(trial)
    later = [n for n in term.card.shape if n not in term.free]
    # The sides of an area were searched for: they count as parameters even if they are not fitted.
    searched = len(term.card.search.area or ())
    cost = max(len(term.free), 1) + searched
    other = term.card.search.other_start
    if other is not None and fitted.deviance - trial.deviance < GAIN_PER_PARAMETER:
        begin = term.with_values(**other).freed(*later)
        again = refit(fitted, fitted.model.with_terms(begin), goal=trial.deviance)
        if again.deviance < trial.deviance:
            trial, cost = again, cost + len(later)
    elif later and fitted.deviance - trial.deviance > GAIN_PER_PARAMETER:
        own = trial.model.term(term.label).freed(*later)
        # The cost of searched sides is already counted: fitted, they have a standard error.
        needed = 0.0 if searched else GAIN_PER_PARAMETER * len(later) * 0.5
        goal = trial.deviance - needed
        shaped = refit(trial, trial.model.without(term.label).with_terms(own), goal=goal)
        if shaped.deviance < goal:
            trial = shaped
            cost += 0 if searched else len(later)
    gain = fitted.deviance - trial.deviance
    return Trial(term=trial.model.term(term.label), fit=trial, gain=gain, cost=cost)


def _on_own_cells(worn: SessionFit) -> SessionFit:
    """Return the fit with wear along paths in the map's own cells, if that is better.

    A stone wears a track as wide as its running band. In wider cells the ice beside it wears too,
    as it does on ice that was simulated with such cells.
    """
    model = replace(worn.model, own_cells_wear=not worn.model.own_cells_wear)
    other = refit(worn, model, goal=worn.deviance)
    return other if other.deviance < worn.deviance else worn


def best_trials(fitted: SessionFit, scores: Sequence[CandidateScore]) -> list[Trial]:
    """Return fits of the most promising candidates and of the best patch, best first.

    Parameters
    ----------
    fitted : fit of the present model
    scores : scores of the candidates around it
    """
    hopeful = [
        score
        for score in scores
        if score.gain > GAIN_PER_PARAMETER or score.term.card.search.other_start is not None
    ]
    terms = [score.term for score in hopeful[:MOST_TRIALS]] + find_patches(fitted)
    found = find_map(fitted)
    if found is not None and found[1] > GAIN_PER_PARAMETER:
        terms.append(found[0])
    return sorted((try_term(fitted, term) for term in terms), key=lambda trial: -trial.net)


def select(base: SessionFit, *, progress: Progress = no_progress) -> Selection:
    """Add effects while they increase the evidence; drop those that no longer do.

    Parameters
    ----------
    base : fit of the baseline
    progress : progress
    """
    present = base
    kept = {term.label for term in base.model.terms}
    rounds: list[SelectionRound] = []
    for number in range(MOST_ADDITIONS + 1):
        progress("comparing candidates", number, MOST_ADDITIONS + 1)
        scores = score_candidates(present, candidates(present.session, present.model.terms))
        unknown = number >= MOST_EFFECTS and not misfit_of(present).white
        full = unknown or number == MOST_ADDITIONS
        trials = [] if full else best_trials(present, scores)
        good = [t for t in trials if t.gain > t.needed]
        chosen = good[0].term.label if good else ""
        rounds.append(SelectionRound(scores=scores, trials=trials, chosen=chosen))
        if not good:
            break
        present = settled(prune(renew_map(refine(good[0].fit)), kept))
    base = refit(replace(base, noise=present.noise), base.model)
    return Selection(base=base, best=present, before=misfit_of(base), rounds=rounds)


def settled(fitted: SessionFit) -> SessionFit:
    """Return the fit with the noise of its residuals."""
    noise = estimate_noise(fitted.session, fitted.residuals, start=fitted.noise)
    return refit(replace(fitted, noise=noise), fitted.model)


def refine(fitted: SessionFit) -> SessionFit:
    """Fit the finer forms of the terms if that increases the evidence."""
    fitted = place_sides(fitted)
    for label in [term.label for term in fitted.model.terms]:
        term = fitted.model.term(label)
        best = fitted
        for begin in term.card.search.finer(term.values):
            later = [name for name in begin if name not in term.free]
            if not later:
                continue
            finer = term.with_values(**begin).freed(*later)
            model = _at_its_level(fitted, fitted.model.without(label).with_terms(finer))
            needed = LEAST_GAIN + GAIN_PER_PARAMETER * (len(finer.free) - len(term.free) - 1)
            goal = min(fitted.deviance - needed, best.deviance)
            trial = refit(fitted, model, iterations=20, goal=goal)
            best = trial if trial.deviance < goal else best
        fitted = best
    return fitted


def _at_its_level(fitted: SessionFit, model: Model) -> Model:
    """Return another model with the level of friction that gives the stones of a fit the same
    deceleration.
    """
    paths = fitted.paths
    other = friction_along(model, fitted.session, fitted.ln_factors, paths)
    mine, its = (float(np.hypot(*each[:, :2].T).sum()) for each in (paths.friction, other))
    return replace(model, ln_mu=model.ln_mu + float(np.log(mine / its)))


@lru_cache(maxsize=8)
def without_term(fitted: SessionFit, label: str) -> SessionFit:
    """Return the fit without a term. It is cached: proof and choice ask for the same."""
    return refit(fitted, fitted.model.without(label))


def prune(fitted: SessionFit, kept: set[str]) -> SessionFit:
    """Drop terms that no longer increase the evidence, the weakest first.

    Parameters
    ----------
    fitted : fit of the model
    kept : labels of terms that stay in any case
    """
    while True:
        poorest: tuple[float, SessionFit] | None = None
        for term in fitted.model.terms:
            if term.label in kept or len(fitted.model.terms) - len(kept) < 2:
                continue
            needed = LEAST_GAIN + GAIN_PER_PARAMETER * (len(term.free) - 1)
            without = _without(fitted, term, fitted.deviance + needed)
            loss = without.deviance - fitted.deviance
            if loss < needed and (poorest is None or loss < poorest[0]):
                poorest = (loss, without)
        if poorest is None:
            return fitted
        fitted = poorest[1]


def _without(fitted: SessionFit, term: Term, goal: float) -> SessionFit:
    """Return the fit without a term; it is useful only below a given deviance.

    A patch that was found beside a map is its residual: without the map it is searched for again.
    """
    bare = fitted.model.without(term.label)
    if term.map_field is None:
        return refit(fitted, bare, goal=goal)
    return with_patches_relocated(without_term(fitted, term.label))


def with_patches_relocated(fitted: SessionFit) -> SessionFit:
    """Return the fit with each of its patches at its best position, if that is better."""
    best = fitted
    for patch in [term for term in fitted.model.terms if term.card.search.area is not None]:
        bare = refit(best, best.model.without(patch.label))
        for sought in find_patches(bare):
            if sought.name == patch.name:
                again = refine(try_term(bare, sought).fit)
                best = min(best, again, key=lambda fit: fit.deviance)
    return best
