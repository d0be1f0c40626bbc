"""Choice of the effects that are named, and test for an unknown effect."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from curling_env.typing import Progress
from friction_estimation.discovery.data.session import Session
from friction_estimation.discovery.evidence.significance import (
    EffectEvidence,
    friction_structure,
    weigh_evidence,
)
from friction_estimation.discovery.evidence.unknown.explanation import (
    Dependence,
    Explanation,
    explain,
    find_dependences,
)
from friction_estimation.discovery.evidence.unknown.nearby import Following
from friction_estimation.discovery.model.fit import SessionFit, fit_to, refit
from friction_estimation.discovery.model.friction_field import CARD as MAP_CARD
from friction_estimation.discovery.model.model import predict
from friction_estimation.discovery.model.noise import estimate_noise
from friction_estimation.discovery.search.residuals import Misfit
from friction_estimation.discovery.search.selection import (
    Selection,
    misfit_of,
    prune,
    without_term,
)
from friction_estimation.discovery.tuning import (
    LARGEST_P,
    LARGEST_P_BETWEEN_THROWS,
    LARGEST_SPREAD,
    MOST_VARIABLES,
)

Structure = tuple[str, float]
"""The circumstance that the throws' own frictions follow most, and its p."""
OF_FRICTION = {MAP_CARD.name, "friction_patch"}
"""Effects by which friction differs from place to place."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Named:
    """Effects of a selection that may be named, with their residuals.

    Parameters
    ----------
    fit : fit of the training throws with the effects that are named, and with the unknown acting on
        them
    effects : evidence for these effects
    unproved : labels that were selected but not proved: proxies of something else
    after : slow misfit that the effects leave
    structure : circumstance that the throws' own frictions still follow, and p that it is chance
    unknown : whether something is missing that no effect explains
    dependences : variables that the unknown follows; empty where nothing is unknown
    pushes : pushes of the unknown that act on the throws of the fit
    """

    fit: SessionFit
    effects: list[EffectEvidence] = field(default_factory=list[EffectEvidence])
    unproved: list[str] = field(default_factory=list[str])
    after: Misfit
    structure: Structure = ("", 1.0)
    unknown: bool = False
    dependences: list[Dependence] = field(default_factory=list[Dependence])
    pushes: tuple[Following, ...] = ()


def name_effects(
    selection: Selection,
    unseen: Session,
    whole: Session,
    progress: Progress,
) -> Named:
    """Return the effects that may be named: proved throw by throw, and not proxies of an unknown
    effect.
    """
    own = {term.label for term in selection.base.model.terms}
    named, effects, unproved = _proved(selection.best, own, unseen, whole)
    after = misfit_of(named)
    if not after.white:
        named, after = _with_correlated_noise(named, after)
    # The own frictions of all throws: those of training alone are few.
    structure = friction_structure(fit_to(named, whole))
    scatters = named.model.spread > LARGEST_SPREAD
    follows = structure[1] < LARGEST_P_BETWEEN_THROWS
    found = Named(
        fit=named,
        effects=effects,
        unproved=unproved,
        after=after,
        structure=structure,
        unknown=not after.white or scatters or follows,
    )
    if not found.unknown:
        return found
    progress("asking what the unknown follows", 0.8)
    return _beside_unknown(found, explain(selection.best, own), selection)


def _beside_unknown(found: Named, explanation: Explanation, selection: Selection) -> Named:
    """Return the effects that may be named beside an unknown one.

    Parameters
    ----------
    found : what was proved, as if there were nothing else
    explanation : effects and an unknown that together explain the throws
    selection : how the effects were chosen
    """
    own = {term.label for term in selection.base.model.terms}
    training = selection.base.session
    named, effects, left, after = found.fit, found.effects, found.after, found.after
    explains = False
    if explanation.pushes:
        calm, beside, _ = _proved(explanation.fit, own, None, explanation.fit.session)
        remains = misfit_of(calm)
        # An unknown with which the throws fit worse than without has absorbed a known effect.
        explains = remains.excess < found.after.excess
        if explains:
            named, effects, left = calm, beside, remains
    if explains:
        after = misfit_of(_without_pushes(named, training))
        structure = friction_structure(named)
        doubtful = [e.label for e in effects if not left.white and e.gain < left.excess]
    else:
        structure = found.structure
        explained = {term.label for term in explanation.fit.model.terms}
        if misfit_of(explanation.fit).excess > selection.before.excess:
            # It explains nothing. Friction may still copy the unknown through the place; other
            # effects do not.
            explained = {e.label for e in effects if e.label.partition("[")[0] not in OF_FRICTION}
        doubtful = [e.label for e in effects if e.label not in explained or e.gain < left.excess]
    blind = not training.turns.any()
    doubtful += [
        term.label
        for term in named.model.terms
        # Without headings the unknown may be curl, which pushes sideways too.
        if term.at_a_limit or (blind and set(term.card.pushes) - {"along"})
    ]
    if doubtful:
        # A proxy of the unknown must not be named: the rest is fitted without it.
        effects = [effect for effect in effects if effect.label not in doubtful]
        model = replace(
            named.model,
            terms=tuple(t for t in named.model.terms if t.label in own or t.label not in doubtful),
        )
        named = refit(named, model)
        after = misfit_of(_without_pushes(named, training))
    chosen = [t.label for t in selection.best.model.terms if t.label not in own]
    labels = {effect.label for effect in effects}
    return Named(
        fit=named,
        effects=effects,
        unproved=[label for label in chosen if label not in labels],
        after=after,
        structure=structure,
        unknown=True,
        dependences=_with_structure(explanation.dependences, structure),
        pushes=explanation.pushes if explains else (),
    )


def _without_pushes(fitted: SessionFit, session: Session) -> SessionFit:
    """Return a fit beside pushes, with its prediction of the session without them."""
    predicted = predict(fitted.model, session, fitted.states, fitted.ln_factors)
    return replace(fitted, session=session, predicted=predicted)


def _with_structure(dependences: list[Dependence], structure: Structure) -> list[Dependence]:
    """Return the variables that the unknown follows within throws, and the one between them: three
    at most.
    """
    variable, p = structure[0].partition(" ")[0].replace("direction", "y"), structure[1]
    between = [Dependence(variable=variable, share=0.0, p=p, push="along")]
    if p > LARGEST_P_BETWEEN_THROWS or variable in {d.variable for d in dependences}:
        between = []
    return [*dependences, *between][:MOST_VARIABLES]


def _with_correlated_noise(named: SessionFit, after: Misfit) -> tuple[SessionFit, Misfit]:
    """Return the fit and its misfit with noise that lasts for seconds, if that explains all
    residuals.

    Noise differs from throw to throw; a part that all throws share is not noise, however slow.
    """
    if named.session.smoothed:
        return named, after
    noise = estimate_noise(named.session, named.residuals, lasting=True)
    calm = refit(replace(named, noise=noise), named.model)
    left = misfit_of(calm)
    if left.white and not find_dependences(calm):
        return calm, left
    return named, after


def _proved(
    fitted: SessionFit,
    own: set[str],
    unseen: Session | None,
    whole: Session,
) -> tuple[SessionFit, list[EffectEvidence], list[str]]:
    """Return the fit with only the proved effects, and the labels of the others.

    Parameters
    ----------
    fitted : fit with all of them
    own : labels of terms that are not in question
    unseen, whole : as of `weigh_evidence`
    """
    unproved: list[str] = []
    while True:
        labels = [t.label for t in fitted.model.terms if t.label not in own]
        effects = weigh_evidence(fitted, labels, unseen, whole)
        failed = [e for e in effects if len(effects) * e.p > LARGEST_P]
        if not failed:
            return fitted, effects, unproved
        worst = max(failed, key=lambda e: (e.p, -e.gain))
        unproved.append(worst.label)
        fitted = prune(without_term(fitted, worst.label), own)
