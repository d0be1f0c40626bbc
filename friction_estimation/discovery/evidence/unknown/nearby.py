"""Comparison of all models near a fit: with or without each effect, candidates, and unknown pushes.

Around a fit everything is linear. The Gram matrices of the fit's parameters, of candidates and of
pushes that follow a variable therefore give the misfit of any combination without a fit. Pushes
have a Gaussian prior, and are integrated over like the friction map. The residual discrepancy
exceeds the noise while an effect is missing, or if a push is not an exact copy. It is treated as
noise enlarged by a factor, the dispersion; each term must still increase the evidence.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from curling_env.physics.effects.card import Push
from curling_env.typing import Floats, Indices
from friction_estimation.discovery.data.session import Session
from friction_estimation.discovery.evidence.unknown.pushes import (
    PUSHES,
    pushes_over_time,
    response_to,
    responses,
    variables,
)
from friction_estimation.discovery.model.candidates import Term, neutral_values
from friction_estimation.discovery.model.fit import SessionFit
from friction_estimation.discovery.model.friction_field import CARD
from friction_estimation.discovery.model.linearisation import Linearisation
from friction_estimation.discovery.model.minimum import minimum_of, project_out
from friction_estimation.discovery.model.model import Model
from friction_estimation.discovery.model.response import LinearisedPaths
from friction_estimation.discovery.model.sensitivity import sensitivities
from friction_estimation.discovery.search.residuals import slow_columns
from friction_estimation.discovery.tuning import (
    GAIN_PER_PARAMETER,
    LEAST_GAIN,
    RELATIVE_AMPLITUDES,
    SPREADS,
    THE_SAME,
    USUAL_PUSHES,
    USUAL_SPREAD,
)


class Following(NamedTuple):
    """A push that follows a variable, with the functions of `variables`; constant without any."""

    variable: str
    push: Push


@dataclass(frozen=True, kw_only=True)
class Combination:
    """One of the models near a fit.

    Parameters
    ----------
    effects : labels of those terms that it has, beside the ones that all models have; never that of
        a friction map, which would absorb pushes that depend on the place
    pushes : pushes of the unknown that it has, and for each its prior standard deviation over the
        usual one
    spread : standard deviation of ln μ from throw to throw
    """

    effects: frozenset[str] = frozenset()
    pushes: Mapping[Following, float] = field(default_factory=dict[Following, float])
    spread: float = USUAL_SPREAD

    def toggled(self, label: str) -> Combination:
        """With an effect, or without it if it is there."""
        return replace(self, effects=self.effects ^ {label})

    def following(self, push: Following, scale: float = 1.0) -> Combination:
        """With a push at some scale; pushes are in order, so that rounding does not depend on how
        they were found.
        """
        return replace(self, pushes=dict(sorted({**self.pushes, push: scale}.items())))

    def without(self, *pushes: Following) -> Combination:
        """Without some pushes."""
        return replace(self, pushes={p: s for p, s in self.pushes.items() if p not in pushes})


class Quadratic(NamedTuple):
    """−2 ln likelihood of a combination as a function of its parameters, priors included.

    Parameters
    ----------
    gram : (n + 1, n + 1) Gram matrix of the parameters and the residual
    places : (n + 1,) where they are among all columns
    always : number of parameters that all combinations have, and of their effects; they come first
    sizes : prior standard deviations of the others
    """

    gram: Floats
    places: Indices
    always: int
    sizes: Floats


@dataclass(frozen=True, kw_only=True, eq=False)
class Nearby:
    """All models near a fit.

    Parameters
    ----------
    fitted : the fit
    model : its model with the candidates at their neutral values
    paths, functions : how paths respond, and the functions of each variable at their instants
    linear : the session by the m parameters of the model and of the pushes
    optional : labels of terms that a combination may have or lack
    pushes : places of the pushes among the m parameters
    """

    fitted: SessionFit
    model: Model
    paths: LinearisedPaths
    functions: dict[str, Floats]
    linear: Linearisation
    optional: tuple[str, ...]
    pushes: dict[Following, Indices]
    _totals: dict[float, tuple[Floats, float]] = field(default_factory=dict, repr=False)

    @property
    def size(self) -> int:
        """Number of parameters, and one for the residual."""
        return len(self.linear.prior)

    @cached_property
    def places(self) -> dict[str, Indices]:
        """Indices of the parameters of each optional term."""
        found = {
            label: np.array([k for k, (own, _) in enumerate(self.model.names) if own == label])
            for label in self.optional
        }
        for term in self.model.terms:
            if term.map_field and term.label in found:
                found[term.label] = np.arange(len(self.model.vector))[self.model.map_slice]
        return {label: places.astype(np.intp) for label, places in found.items()}

    @cached_property
    def always(self) -> Indices:
        """Places of the parameters that all combinations have."""
        optional = np.concatenate([np.empty(0, dtype=np.intp), *self.places.values()])
        return np.setdiff1d(np.arange(len(self.model.vector)), optional)

    @cached_property
    def offsets(self) -> dict[str, tuple[Indices, Floats]]:
        """For each optional term its strengths, as places and how far they are from nothing."""
        vector, found = self.model.vector, dict[str, tuple[Indices, Floats]]()
        for label, places in self.places.items():
            term = self.model.term(label)
            if term.map_field:
                found[label] = places, vector[places]
                continue
            idle, card = neutral_values(term.card), term.card
            strong = [
                k
                for k, name in enumerate(term.free)
                if term.variant or card.parameter(name).neutral is not None
            ]
            off = np.array([vector[places[k]] - idle[term.free[k]] for k in strong])
            found[label] = places[strong], off
        return found

    def repeats(self, made: Combination) -> bool:
        """Return whether pushes of a combination can replace one of its effects completely.

        Their numerical difference would otherwise be fitted with large sizes of both that cancel.
        """
        none = [np.empty(0, dtype=np.intp)]
        strengths = [self.offsets[label][0] for label in made.effects]
        effects = np.concatenate(none + strengths)
        pushed = np.concatenate(none + [self.pushes[push] for push in made.pushes])
        if not len(effects) or not len(pushed):
            return False
        at = np.concatenate([pushed, effects])
        both = self._total(made.spread)[0][at[:, None], at]
        left = project_out(both, len(pushed)).diagonal()
        return bool((left < (1.0 - THE_SAME) * both.diagonal()[len(pushed) :]).any())

    @cached_property
    def values(self) -> float:
        """Number of measured values: the expected deviance of noise alone."""
        return float(np.isfinite(self.fitted.session.observed).sum())

    @cached_property
    def slow(self) -> float:
        """Number of slow shapes of residuals, as in `Misfit`."""
        session = self.fitted.session
        counts = [
            slow_columns(session.times[session.rows(i)]).shape[1] * (3 if session.turns[i] else 2)
            for i in range(len(session))
        ]
        return float(sum(counts))

    def quadratic(self, made: Combination, dispersion: float = 1.0) -> Quadratic:
        """Return the quadratic of a combination, with noise scaled by the dispersion."""
        return self._quadratic(made, self._total(made.spread)[0], dispersion)

    def _total(self, spread: float) -> tuple[Floats, float]:
        if spread not in self._totals:
            grams, log_terms = self.linear.each(spread)
            self._totals[spread] = grams.sum(axis=0), float(log_terms.sum())
        return self._totals[spread]

    def _quadratic(
        self, made: Combination, total: Floats, dispersion: float = 1.0, *, priors: bool = True
    ) -> Quadratic:
        effects = [self.places[label] for label in sorted(made.effects)]
        first = np.concatenate([self.always, *effects])
        pushed = [self.pushes[push] for push in made.pushes]
        places = np.concatenate([first, *pushed, [self.size - 1]]).astype(np.intp)
        block = places[:, None], places
        gram = total[block] / dispersion
        # Without an effect the residual includes its contribution.
        away = np.zeros(self.size)
        for label, (at, off) in self.offsets.items():
            if label not in made.effects:
                away[at] = off
        if away.any():
            larger = total @ away / dispersion
            gram[:, -1] += larger[places]
            gram[-1, :] += larger[places]
            gram[-1, -1] += away @ larger
        sizes = np.concatenate(
            [
                np.empty(0),
                *(
                    np.full(len(self.pushes[push]), scale * USUAL_PUSHES[PUSHES.index(push.push)])
                    for push, scale in made.pushes.items()
                ),
            ]
        )
        if priors:
            gram += self.linear.prior[block]
            field = self.model.map_field
            if field and CARD.name in self.optional:
                gram[-1, -1] -= float(((field.values / field.deviations) ** 2).sum())
            last = np.arange(len(first), len(places) - 1)
            gram[last, last] += sizes**-2
        return Quadratic(gram=gram, places=places, always=len(first), sizes=sizes)

    def minimum_cost(self, made: Combination, dispersion: float = 1.0) -> float:
        """Minimum −2 ln likelihood of a combination, including its priors."""
        return float(minimum_of(self.quadratic(made, dispersion).gram).value)

    def value(self, made: Combination, dispersion: float) -> float:
        """−2 ln of the evidence of a combination, with the required gain of its terms."""
        quadratic = self.quadratic(made, dispersion)
        least = minimum_of(quadratic.gram)
        integrated = 2.0 * float(np.log(least.pivots[quadratic.always :] * quadratic.sizes).sum())
        needed = LEAST_GAIN * (len(made.pushes) + len(made.effects))
        for label in made.effects:
            needed += GAIN_PER_PARAMETER * (len(self.places[label]) - 1)
        return float(least.value) + integrated + self._total(made.spread)[1] + needed

    def dispersion(self, made: Combination) -> float:
        """Return the ratio of a combination's residuals to the noise; at least one."""
        left = self.minimum_cost(made) - self.values
        return max(1.0, 1.0 + left / self.slow)

    def at_best(self, made: Combination, dispersion: float) -> tuple[float, Combination]:
        """Return the value of a combination at its best spread and scales, and that combination."""
        best = self.value(made, dispersion), made
        for _ in range(3):
            before = best[0]
            tried = [replace(best[1], spread=float(spread)) for spread in SPREADS[11::8]]
            best = self._better(best, tried, dispersion)
            for push in made.pushes:
                tried = [
                    best[1].following(push, scale) for scale in RELATIVE_AMPLITUDES[1:11:3].tolist()
                ]
                best = self._better(best, tried, dispersion)
            if before - best[0] < 0.5:
                break
        return best

    def _better(
        self, best: tuple[float, Combination], tried: Sequence[Combination], dispersion: float
    ) -> tuple[float, Combination]:
        values = [(self.value(made, dispersion), made) for made in tried]
        return min([best, *values], key=lambda each: each[0])

    def scores(self, made: Combination, dispersion: float) -> Floats:
        """Deviance of every throw under the best fit of a combination to all the others, (k,)."""
        grams, _ = self.linear.each(made.spread)
        whole = self.quadratic(made, dispersion).gram
        scores = np.empty(len(grams))
        for i, one in enumerate(grams):
            gram = self._quadratic(made, one, priors=False).gram
            step = minimum_of(whole - gram / dispersion).step
            own = gram[-1, -1] - 2 * gram[:-1, -1] @ step + step @ gram[:-1, :-1] @ step
            scores[i] = own / dispersion
        return scores

    def pushed(self, made: Combination, dispersion: float) -> Session:
        """Return the session with the pushes of a combination acting on its stones."""
        if not made.pushes:
            return replace(self.fitted.session, pushes=None)
        quadratic = self.quadratic(made, dispersion)
        coefficients = np.zeros(self.size)
        coefficients[quadratic.places[:-1]] = minimum_of(quadratic.gram).step
        sizes: dict[Push, Floats] = {}
        for push in made.pushes:
            own = self.functions[push.variable] @ coefficients[self.pushes[push]]
            sizes[push.push] = sizes.get(push.push, 0.0) + own
        return replace(self.fitted.session, pushes=pushes_over_time(self.paths, sizes))

    def absorbed_information(self, made: Combination) -> Floats:
        """Information on the fit's parameters that pushes can absorb, (P, P).

        Parameters
        ----------
        made : combination with all the parameters of the fit
        """
        quadratic = self.quadratic(made)
        count, own = len(quadratic.sizes), len(self.fitted.model.vector)
        if not made.pushes:
            return np.zeros((own, own))
        at = np.r_[len(quadratic.gram) - 1 - count : len(quadratic.gram) - 1, :own]
        both = quadratic.gram[at[:, None], at]
        return both[count:, count:] - project_out(both, count)


def nearby(
    fitted: SessionFit,
    optional: Sequence[str],
    candidates: Sequence[Term] = (),
    *,
    followed: Collection[str] | None = None,
) -> Nearby:
    """All models near a fit.

    Parameters
    ----------
    fitted : the fit
    optional : labels of its terms that a model may lack
    candidates : terms at their neutral values that a model may have
    followed : variables that pushes may follow, empty for constant ones; all by default
    """
    session = fitted.session
    model = fitted.model.with_terms(*candidates)
    columns = fitted.columns
    if candidates:
        _, columns = sensitivities(model, session, fitted.states, fitted.ln_factors)
    paths = fitted.paths
    residuals = fitted.residuals
    variable = variables(paths, paths.at_instants(np.nan_to_num(residuals)))
    functions = {"": np.ones((len(paths.path), 1)), **variable}
    if followed is not None:
        functions = {name: each for name, each in functions.items() if name in followed}
    if session.pushes is not None:
        # Pushes start from zero, not from those that the fit already has.
        residuals = residuals + response_to(paths, session.pushes)
    stacked = [columns]
    position = columns.shape[2] - 7
    pushes: dict[Following, Indices] = {}
    for name, columns_of in functions.items():
        width = columns_of.shape[1]
        stacked.append(responses(paths, columns_of))
        for k, push in enumerate(PUSHES):
            if name or push != "along":  # the friction of the map is always fitted
                begin = position + k * width
                pushes[Following(name, push)] = np.arange(begin, begin + width)
        position += len(PUSHES) * width
    return Nearby(
        fitted=fitted,
        model=model,
        paths=paths,
        functions=functions,
        linear=fitted.linear_in(model, np.concatenate(stacked, axis=2), residuals),
        optional=(*optional, *(term.label for term in candidates)),
        pushes=pushes,
    )
