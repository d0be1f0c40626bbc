"""Which effects the data ask for: added one by one, pruned, and tested throw by throw."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from friction_estimation.discovery.data.session import Session
from friction_estimation.discovery.model.candidates import (
    ALONG_PATH,
    OTHER_STARTS,
    SHAPES,
    Term,
    candidates,
    finer_starts,
)
from friction_estimation.discovery.model.fit import Fit, fit
from friction_estimation.discovery.model.model import Model, sensitivities
from friction_estimation.discovery.model.noise import Noise, estimate_noise, wild_rows
from friction_estimation.discovery.search.patches import find_patch
from friction_estimation.discovery.search.residuals import Misfit, misfit
from friction_estimation.discovery.search.score_test import Look, screen

LEAST_GAIN = 16.0
"""Fall of −2 ln likelihood that a parameter must bring. Of effects between throws, of which a
dozen throws tell, chance brings as much once in three thousand."""
GAIN_PER_PARAMETER = 4.0
"""More of it for every further parameter."""
WORTH_TRYING = 6.0
"""Linear gain below which a candidate is not fitted."""
MOST_TRIALS = 9
"""Candidates fitted in a step, the most promising of the screening. Generous: an effect whose
usual shape is wrong looks poor until its shape is fitted."""
MOST_BETWEEN_THROWS = 2
"""Of these, effects that act on whole throws: they all look alike where something else is missing.
"""
MOST_EFFECTS = 4
"""Effects that are named at most."""
RULED_OUT = 12.0
"""A candidate whose fit is worse than the chosen one's by this is ruled out (a likelihood ratio
of 400)."""

SIDE_SHIFTS = (-0.8, -0.5, -0.3, -0.2, -0.12, -0.06, 0.06, 0.12, 0.2, 0.3, 0.5, 0.8)
"""How far a side of a patch is moved from the search's grid to see whether it fits better [m]."""
NARROWEST = 0.15
"""Narrowest patch [m]: a stone's running band."""

FIRST_NOISE = Noise(white=(0.005, 0.005, 0.02), fading=(0.0, 0.0, 0.0), memory=(0.1, 0.1, 0.1))
"""Taken until the residuals tell better."""

Progress = Callable[[str, float], None]


def silent(_what: str, _share: float) -> None:
    """No progress is shown."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Trial:
    """A candidate fitted beside the model.

    Parameters
    ----------
    term : with its fitted values
    fit : of the model with it
    gain : fall of −2 ln likelihood
    cost : parameters it added
    """

    term: Term
    fit: Fit
    gain: float
    cost: int

    @property
    def needed(self) -> float:
        """Gain that its parameters must bring."""
        return LEAST_GAIN + GAIN_PER_PARAMETER * (self.cost - 1)

    @property
    def net(self) -> float:
        return self.gain - GAIN_PER_PARAMETER * (self.cost - 1)


@dataclass(frozen=True, kw_only=True, eq=False)
class Step:
    """One round of the selection.

    Parameters
    ----------
    looks : the screening
    trials : candidates fitted, the best first
    chosen : label of the one taken, empty if none was
    """

    looks: list[Look]
    trials: list[Trial]
    chosen: str


@dataclass(frozen=True, kw_only=True, eq=False)
class Selection:
    """What was selected.

    Parameters
    ----------
    base, best : fits before and after, of the same session and noise
    before, after : their slow misfit
    steps : how it came about
    """

    base: Fit
    best: Fit
    before: Misfit
    after: Misfit
    steps: list[Step]

    @property
    def closure(self) -> float:
        """Part of the slow misfit that the selected effects close."""
        return closure(self.before, self.after)


def closure(before: Misfit, after: Misfit) -> float:
    """Part of the slow misfit that was closed; one where there was none to close."""
    return 1.0 if before.white else 1.0 - after.excess / before.excess


def falls_short(before: Misfit, after: Misfit, share: float) -> bool:
    """Whether less than this share of the misfit was closed, and not by chance alone.

    Where little was amiss, noise alone leaves a tenth of it.
    """
    surely_left = after.excess - 2.0 * after.uncertainty
    return not before.white and surely_left > (1.0 - share) * before.excess


def misfit_of(fitted: Fit) -> Misfit:
    """Slow misfit of a fit."""
    _, columns = sensitivities(fitted.model, fitted.session, fitted.states, fitted.ln_factors)
    return misfit(fitted, columns)


def refit(fitted: Fit, model: Model, **others: object) -> Fit:
    """Fit another model to the same session, beginning from where this one arrived."""
    return fit(
        model,
        fitted.session,
        fitted.noise,
        states=fitted.states,
        ln_factors=fitted.ln_factors,
        **others,  # pyright: ignore[reportArgumentType]
    )


def fit_with_noise(
    model: Model, session: Session, start: Noise | None = None, begin: Fit | None = None
) -> Fit:
    """Fit with the noise learnt from what is left, and wild rows left out."""
    noise = start or FIRST_NOISE
    states = begin.states if begin is not None else None
    factors = begin.ln_factors if begin is not None else None
    first = fit(model, session, noise, states=states, ln_factors=factors)
    session = session.without_rows(wild_rows(session, first.residuals))
    first = fit(first.model, session, noise, states=first.states, ln_factors=first.ln_factors)
    noise = estimate_noise(session, first.residuals, start=start)
    return fit(first.model, session, noise, states=first.states, ln_factors=first.ln_factors)


def try_term(fitted: Fit, term: Term) -> Trial:
    """Fit a candidate beside the model: its strength first, then its shape."""
    trial = refit(fitted, fitted.model.with_terms(term))
    if term.free == (ALONG_PATH,):
        trial = _on_own_cells(trial)
    shapes = [n for n in SHAPES.get(term.name, ()) if n in term.values] or _own_shapes(term)
    if term.name == "friction_patch":
        shapes = ("y_min", "y_max")
    later = [n for n in shapes if n not in term.free]
    cost = len(term.free) + (4 if term.name == "friction_patch" else 0)  # its sides were sought
    other = OTHER_STARTS.get(term.name)
    if other is not None and fitted.deviance - trial.deviance < WORTH_TRYING:
        begin = term.with_values(**other).freed(*later)
        again = refit(fitted, fitted.model.with_terms(begin))
        if again.deviance < trial.deviance:
            trial, cost = again, cost + len(later)
    elif later and fitted.deviance - trial.deviance > WORTH_TRYING:
        own = trial.model.term(term.label).freed(*later)
        shaped = refit(trial, trial.model.without(term.label).with_terms(own))
        if trial.deviance - shaped.deviance > GAIN_PER_PARAMETER * len(later) * 0.5:
            trial = shaped
            cost += 0 if term.name == "friction_patch" else len(later)
    gain = fitted.deviance - trial.deviance
    return Trial(term=trial.model.term(term.label), fit=trial, gain=gain, cost=cost)


def _on_own_cells(worn: Fit) -> Fit:
    """Wear along paths on the map's own cells, where these throws ask for that.

    A stone wears a lane as wide as its running band. Wider cells wear the ice beside it too: so
    does an ice that was simulated on them.
    """
    other = refit(worn, replace(worn.model, own_cells_wear=not worn.model.own_cells_wear))
    return other if other.deviance < worn.deviance else worn


def _own_shapes(term: Term) -> tuple[str, ...]:
    """Shapes of an effect that a user registered: whatever its card gives a default for."""
    from friction_estimation.discovery.model.candidates import KNOWN

    if term.name in KNOWN:
        return ()
    return tuple(
        p.name for p in term.form.parameters if p.neutral is None and p.default is not None
    )


def best_trials(fitted: Fit, looks: Sequence[Look]) -> list[Trial]:
    """Fits of the most promising candidates and of the best patch, the best first."""
    hopeful = [k for k in looks if k.gain > WORTH_TRYING or k.term.name in OTHER_STARTS]
    if not hopeful:
        hopeful = list(looks[:1])
    between = [look for look in hopeful if look.term.between_throws][:MOST_BETWEEN_THROWS]
    chosen = [k for k in hopeful if not k.term.between_throws or k in between][:MOST_TRIALS]
    trials = [try_term(fitted, look.term) for look in chosen]
    if not any(term.name == "friction_patch" for term in fitted.model.terms):
        patch = find_patch(fitted)
        if patch is not None:
            trials.append(try_term(fitted, patch))
    return sorted(trials, key=lambda trial: -trial.net)


def select(base: Fit, *, most: int = MOST_EFFECTS, progress: Progress = silent) -> Selection:
    """Add effects as long as they pay for themselves; drop those that no longer do."""
    present = base
    steps: list[Step] = []
    whole = base.session
    for round_ in range(most + 1):
        progress("comparing candidates", round_ / (most + 1))
        looks = screen(present, candidates(present.session, present.model.terms))
        trials = best_trials(present, looks)
        good = [t for t in trials if t.gain > t.needed]
        if not good or round_ == most:
            steps.append(Step(looks=looks, trials=trials, chosen=""))
            break
        steps.append(Step(looks=looks, trials=trials, chosen=good[0].term.label))
        present = refine(good[0].fit)
        present = prune(present, {t.label for t in base.model.terms})
        noise = estimate_noise(present.session, present.residuals, start=present.noise)
        present = replace(present, noise=noise)
        present = refit(present, present.model)
    base = fit(
        base.model,
        whole,
        present.noise,
        states=base.states,
        ln_factors=base.ln_factors,
    )
    return Selection(
        base=base, best=present, before=misfit_of(base), after=misfit_of(present), steps=steps
    )


def refine(fitted: Fit) -> Fit:
    """Free the finer shapes of the terms where that pays."""
    for label in [term.label for term in fitted.model.terms]:
        if label == "friction_patch":
            fitted = place_sides(fitted)
        term = fitted.model.term(label)
        best = fitted
        for begin in finer_starts(term):
            later = [name for name in begin if name not in term.free]
            if not later:
                continue
            finer = term.with_values(**begin).freed(*later)
            if term.name == "friction_patch":
                finer = finer.freed("x_min", "x_max", "y_min", "y_max")
            model = fitted.model.without(term.label).with_terms(finer)
            trial = refit(fitted, model, iterations=20)
            needed = LEAST_GAIN + GAIN_PER_PARAMETER * (len(finer.free) - len(term.free) - 1)
            if fitted.deviance - trial.deviance > needed and trial.deviance < best.deviance:
                best = trial
        fitted = best
    return fitted


def place_sides(fitted: Fit) -> Fit:
    """Move the sides of a patch that run along the sheet to where they fit best, if there is one.

    What a side does changes only when it passes a stone's path, so that it cannot be found by
    slopes; the search for the patch left it on a grid.
    """
    if not any(term.label == "friction_patch" for term in fitted.model.terms):
        return fitted
    for side in ("x_min", "x_max"):
        place = fitted.model.term("friction_patch").values[side]
        for shift in SIDE_SHIFTS:
            model = with_side(fitted.model, side, place + shift)
            if model is None:
                continue
            trial = refit(fitted, model, iterations=5)
            if trial.deviance < fitted.deviance - 1.0:
                fitted = trial
    return fitted


def with_side(model: Model, side: str, place: float) -> Model | None:
    """The model with one side of its patch elsewhere; None if the patch would be too narrow."""
    moved = model.term("friction_patch").with_values(**{side: place})
    if moved.values["x_max"] - moved.values["x_min"] < NARROWEST:
        return None
    return model.without("friction_patch").with_terms(moved)


def prune(fitted: Fit, kept: set[str]) -> Fit:
    """Drop terms that no longer pay for themselves, the poorest first."""
    while True:
        poorest: tuple[float, Fit] | None = None
        for term in fitted.model.terms:
            if term.label in kept or len(fitted.model.terms) - len(kept) < 2:
                continue
            without = refit(fitted, fitted.model.without(term.label))
            loss = without.deviance - fitted.deviance
            needed = LEAST_GAIN + GAIN_PER_PARAMETER * (len(term.free) - 1)
            if loss < needed and (poorest is None or loss < poorest[0]):
                poorest = (loss, without)
        if poorest is None:
            return fitted
        fitted = poorest[1]
