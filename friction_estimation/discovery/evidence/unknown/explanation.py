"""Search for an unknown effect: its variables, and the known effects beside it.

An unknown effect biases every fit without it, and known effects are then chosen in its place. It is
therefore a term of the model as well: pushes, each a smooth function of one variable. Effects and
pushes are added and dropped together, as long as they pay for themselves.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from curling_env.physics.effects.card import Push
from friction_estimation.discovery.evidence.intervals import has_few_throws
from friction_estimation.discovery.evidence.significance import p_of_mean
from friction_estimation.discovery.evidence.unknown.nearby import (
    Combination,
    Following,
    Nearby,
    nearby,
)
from friction_estimation.discovery.model.candidates import Term, candidates
from friction_estimation.discovery.model.fit import SessionFit, fit
from friction_estimation.discovery.model.friction_field import CARD as MAP_CARD
from friction_estimation.discovery.search.selection import (
    refine,
    settled,
    try_term,
    with_patches_relocated,
)
from friction_estimation.discovery.tuning import (
    COPY_ERROR,
    FURTHER_VARIABLE_GAIN,
    LARGEST_P,
    LARGEST_REST,
    LEAST_SURVIVING,
    MOST_VARIABLES,
    USUAL_SPREAD,
)

SHORTLIST = 5
"""Number of promising moves of a search whose spread and scales are optimised."""
ALIKE: dict[Push, Push] = {
    "along": "along the sheet",
    "along the sheet": "along",
    "left": "across the sheet",
    "across the sheet": "left",
}
"""Pushes of one kind: on the friction, and sideways."""
MOST_ROUNDS = 3
"""Maximum number of rounds of linearisation, after other effects were chosen or paths have
moved."""
SETTLED = 1e-3
"""Movement of paths from one such round to the next below which they have converged [m]."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Dependence:
    """Variable that the discrepancy follows.

    Parameters
    ----------
    variable : name of the variable, as in the `depends_on` of a report
    share : part of the discrepancy that is left without it and not with it
    p : probability that chance does as well, by Student's t over throws
    push : push by which it acts most
    """

    variable: str
    share: float
    p: float
    push: Push

    @property
    def followed(self) -> str:
        """The variable, or the direction of play: whole throws follow no place along the sheet."""
        return "direction" if self.variable == "y" and self.share == 0.0 else self.variable


def search(
    around: Nearby, start: Iterable[str], *, held: bool = False
) -> tuple[Combination, float]:
    """Return the combination of effects and pushes with the highest evidence.

    Parameters
    ----------
    around : all models near a fit
    start : effects with which the search begins
    held : whether these effects stay, and no others are added

    Returns
    -------
    the combination, and the dispersion beside it
    """
    made = Combination(effects=frozenset(start))
    dispersion = around.dispersion(made)
    while True:
        present, made = around.at_best(made, dispersion)
        moves = _moves(around, made, held=held)
        moves.sort(key=lambda move: around.value(move, dispersion))
        tried = [around.at_best(move, dispersion) for move in moves[:SHORTLIST]]
        better = [each for each in tried if each[0] < present - 1.0]
        sound = [each for each in better if not may_correct_pushes(around, made, each[1])]
        if not sound:
            return made, dispersion
        made = min(sound, key=lambda each: each[0])[1]
        dispersion = min(dispersion, around.dispersion(made))


def may_correct_pushes(around: Nearby, before: Combination, after: Combination) -> bool:
    """Return whether a further term may merely correct inexact pushes.

    The response of paths to pushes is only partly linear. A term that corrects for this explains
    little compared with the pushes, and leaves much of the rest.
    """
    terms = [len(made.effects) + len(made.pushes) for made in (before, after)]
    if terms[1] <= terms[0]:
        return False
    had, has = (around.minimum_cost(made) for made in (before, after))
    pushed = around.minimum_cost(after.without(*after.pushes)) - has
    rest = has - around.values
    return had - has < COPY_ERROR * pushed and rest > LARGEST_REST * (had - around.values)


def _moves(around: Nearby, made: Combination, *, held: bool) -> list[Combination]:
    """Yield combinations with one term more or less."""
    # A map would absorb pushes that depend on the place.
    names = [] if held else [label for label in around.optional if label != MAP_CARD.name]
    effects = [made.toggled(label) for label in names]
    fewer = [made.without(push) for push in made.pushes]
    further = [push for push in around.pushes if push not in made.pushes]
    further = further if len(made.pushes) < MOST_VARIABLES else []
    more = [made.following(push, scale) for push in further for scale in (0.3, 1.0)]
    return [move for move in effects + fewer + more if not around.repeats(move)]


def surviving(around: Nearby, made: Combination, dispersion: float) -> Combination:
    """Return a combination with only those effects that are needed beside any form of the unknown.

    An unknown that follows a variable with one push may do so with another of the same kind: higher
    friction in one direction and lower in the other need not be symmetric. An effect that such a
    push makes superfluous may be only that.

    Parameters
    ----------
    around, made, dispersion : as of `search`
    """
    for push in made.pushes:
        other = push._replace(push=ALIKE.get(push.push, push.push))
        if not push.variable or other not in around.pushes or other in made.pushes:
            continue
        whole = around.at_best(made.following(other), dispersion)[1]
        left = {
            label: _explained(around, whole, label) / max(_explained(around, made, label), 1.0)
            for label in made.effects
        }
        needless = [label for label, share in left.items() if share < LEAST_SURVIVING]
        if needless:
            made = replace(whole, effects=whole.effects - {min(needless, key=left.__getitem__)})
            return surviving(around, made, dispersion)
    return made


def _explained(around: Nearby, made: Combination, label: str) -> float:
    """Return the rise of −2 ln likelihood when an effect is taken from a combination."""
    return around.minimum_cost(made.toggled(label)) - around.minimum_cost(made)


def dependences(around: Nearby, made: Combination, dispersion: float) -> list[Dependence]:
    """Return the variables that the pushes of a combination follow, strongest first.

    Parameters
    ----------
    around, made, dispersion : as of `search`
    """
    scores = around.scores(made, dispersion)
    bare = around.minimum_cost(made.without(*made.pushes))
    lacking = max(bare - around.values, bare - around.minimum_cost(made), 1.0)
    found: list[Dependence] = []
    for variable in dict.fromkeys(
        push.variable.split()[0] for push in made.pushes if push.variable
    ):
        own = [p for p in made.pushes if p.variable and p.variable.split()[0] == variable]
        others = [push for push in made.pushes if push not in own]
        alone, without = made.without(*others), made.without(*own)
        improvements = around.scores(without, dispersion) - scores
        found.append(
            Dependence(
                variable=variable,
                share=min((bare - around.minimum_cost(alone)) / lacking, 1.0),
                p=p_of_mean(improvements),
                push=max(own, key=lambda push: around.minimum_cost(made.without(push))).push,
            )
        )
    found.sort(key=lambda dependence: -dependence.share)
    return [
        each
        for each in found
        if each.share > FURTHER_VARIABLE_GAIN * found[0].share and each.p < LARGEST_P
    ]


def find_dependences(fitted: SessionFit) -> list[Dependence]:
    """Return the variables that the discrepancy of a fit follows, strongest first.

    Parameters
    ----------
    fitted : fit that leaves the discrepancy
    """
    around = nearby(fitted, ())
    made, dispersion = search(around, (), held=True)
    return dependences(around, made, dispersion)


@dataclass(frozen=True, kw_only=True, eq=False)
class Explanation:
    """Effects and an unknown that together explain a session; a friction map is never among them.

    Parameters
    ----------
    fit : fit of the effects to the session in which the unknown acts
    pushes : pushes of the unknown
    dependences : variables that these follow
    """

    fit: SessionFit
    pushes: tuple[Following, ...]
    dependences: list[Dependence]


def explain(
    fitted: SessionFit,
    given: Iterable[str],
) -> Explanation:
    """Effects and an unknown that together explain a session.

    Parameters
    ----------
    fitted : fit with effects that were selected without the unknown
    given : labels of terms that stay in any case
    """
    session, kept = fitted.session, set(given)
    tried: list[frozenset[str]] = []
    while True:
        optional = [term.label for term in fitted.model.terms if term.label not in kept]
        own = [label for label in optional if label != MAP_CARD.name]
        others = candidates(session, fitted.model.terms)
        around = nearby(fitted, optional, others)
        made, dispersion = search(around, own)
        made = surviving(around, made, dispersion)
        calm = _fit_beside(around, made, dispersion, others, shaped=True)
        if len(tried) == MOST_ROUNDS or (tried and made.effects in tried):
            break
        tried.append(made.effects)
        fitted = calm
    # A patch was placed, and shaped, while the unknown was missing.
    calm = with_patches_relocated(calm)
    return Explanation(
        fit=calm,
        pushes=tuple(made.pushes),
        dependences=dependences(around, made, dispersion),
    )


def _fit_beside(
    around: Nearby,
    made: Combination,
    dispersion: float,
    others: Sequence[Term] = (),
    *,
    shaped: bool = False,
) -> SessionFit:
    """Return the fit of the effects of a combination to a session in which its pushes act.

    Parameters
    ----------
    around, made, dispersion : as of `search`
    others : candidates of which the combination may have some
    shaped : whether finer forms of the effects are tried too
    """
    start = around.fitted
    dropped = {label for label in around.optional if label not in made.effects}
    model = replace(
        start.model, terms=tuple(t for t in start.model.terms if t.label not in dropped)
    )
    calm = around.pushed(made, dispersion)
    fitted = fit(model, calm, start.noise, states=start.states, ln_factors=start.ln_factors)
    for term in others:
        if term.label in made.effects:
            fitted = try_term(fitted, term).fit
    return settled(refine(fitted) if shaped else fitted)


def fit_beside(fitted: SessionFit, pushes: Sequence[Following]) -> SessionFit:
    """Fit the same effects to a session in which pushes of an unknown act on the stones.

    The pushes are found again on the new paths, until these no longer move. Anything that the
    pushes could do in place of an effect is no information on that effect; this depends on the
    spread between throws, so the fit holds for one spread.

    Parameters
    ----------
    fitted : fit to the session as it is
    pushes : the pushes
    """
    calm, made = fitted, Combination()
    followed = {push.variable for push in pushes}
    for _ in range(MOST_ROUNDS):
        around, before = nearby(calm, (), followed=followed), calm.predicted
        made = Combination()
        for push in pushes:
            if push in around.pushes:
                made = made.following(push)
        dispersion = around.dispersion(made)
        made = around.at_best(made, dispersion)[1]
        calm = _fit_beside(around, made, around.dispersion(made))
        if not made.pushes:
            return calm
        if np.abs(calm.predicted - before)[:, :2].max() < SETTLED:
            break
    if has_few_throws(fitted):
        made = replace(made, spread=USUAL_SPREAD)
    again = nearby(calm, (), followed=followed)
    own = 7 + len(calm.model.vector)
    linear = calm.linear_in(calm.model, calm.columns, calm.residuals)
    grams = linear.grams.copy()
    grams[:, 7:own, 7:own] -= again.absorbed_information(made) / len(grams)
    # The unexplained rest counts as additional noise.
    grams /= again.dispersion(made)
    return replace(calm, linear=replace(linear, grams=grams), only_spread=made.spread)
