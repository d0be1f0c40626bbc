"""Significance: whether throws prove an effect, and whether their own frictions differ by chance.

Frames of a throw are not independent, throws are. Every throw is scored under a fit that has not
seen it, with and without the effect: by its density, in which all that is uncertain in the fit is
integrated out. The signs of the differences are then flipped at random.
An effect between throws (wear, drift, a stone) is tested by permuting the throws' own frictions:
chance must rarely do as well as the best of all such effects. What one stone does within its throws
shows in these few alone; it is tested in the same way, by what every throw shows of it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import t as student_t

from curling_env.physics.state import State
from curling_env.typing import Floats
from friction_estimation.discovery.data.session import Session
from friction_estimation.discovery.evidence.predictive_density import (
    left_out_scores,
    unseen_scores,
)
from friction_estimation.discovery.model.candidates import Term, candidates, neutral_values
from friction_estimation.discovery.model.elimination import eliminate_factor, eliminate_states
from friction_estimation.discovery.model.fit import SessionFit, fit_to, linearise
from friction_estimation.discovery.search.score_test import (
    score_candidates,
    sign_flip_p,
)
from friction_estimation.discovery.search.selection import refit, try_term
from friction_estimation.discovery.tuning import (
    LARGEST_P_BETWEEN_THROWS,
    LEAST_LINEAR_GAIN,
    LEAST_SPREAD,
    PERMUTATIONS,
)


@dataclass(frozen=True, kw_only=True, eq=False)
class EffectEvidence:
    """The evidence for one effect of a model.

    Parameters
    ----------
    label : label of its term
    gain : rise of −2 ln likelihood without it
    p : probability that chance gains as much
    improvements : (k,) improvement of each throw's score, in order of play
    corrected : p with Holm's correction, once that is known
    """

    label: str
    gain: float
    p: float
    improvements: Floats
    corrected: float = 1.0


def weigh_evidence(
    fitted: SessionFit,
    label: str,
    held_out: Session | None,
    whole: Session,
    rng: np.random.Generator,
) -> EffectEvidence:
    """Take an effect out again and see which throws fit worse without it.

    Parameters
    ----------
    fitted : fit with the effect
    label : label of its term
    held_out : throws that no fit has seen, which count too, if there are some
    whole : all throws, for effects between throws and of one stone
    rng : source of the permutations
    """
    term = fitted.model.term(label)
    model = fitted.model.without(label)
    if model.systematic_error and not term.card.is_physical:
        # The systematic error would replace it in every throw; selection has weighed the two.
        model = replace(model, systematic_error=replace(model.systematic_error, held=True))
    without = refit(fitted, model)
    improvements = left_out_scores(without) - left_out_scores(fitted)
    throws = fitted.session.throws
    if held_out is not None and len(held_out):
        more = unseen_scores(without, held_out) - unseen_scores(fitted, held_out)
        improvements = np.concatenate([improvements, more])
        throws = np.concatenate([throws, held_out.throws])
    p = sign_flip_p(improvements, rng)
    if term.between_throws or term.stone is not None:
        everything = fit_to(without, whole)
        p = (
            _permutation_p(everything, rng)
            if term.between_throws
            else _stone_p(everything, term, rng)
        )
        p = p if p < LARGEST_P_BETWEEN_THROWS else 1.0
    return EffectEvidence(
        label=label,
        gain=without.deviance - fitted.deviance,
        p=p,
        improvements=improvements[np.argsort(throws)],
    )


def add_effects_between_throws(
    fitted: SessionFit, whole: Session, rng: np.random.Generator
) -> SessionFit:
    """Add effects that show only between throws, as all throws show them.

    Such an effect shows once per throw, and the training throws alone are few. It is chosen and
    tested on the frictions of all throws; its size still comes from the training throws.

    Parameters
    ----------
    fitted : fit of the training throws
    whole : all throws
    rng : source of the permutations
    """
    while True:
        everything = fit_to(fitted, whole)
        terms = [
            t
            for t in candidates(whole, fitted.model.terms)
            if t.between_throws and _can_size(fitted.session, t)
        ]
        scores = [s for s in score_candidates(everything, terms) if s.gain > LEAST_LINEAR_GAIN]
        trials = [try_term(everything, score.term) for score in scores[:3]]
        good = [t for t in trials if t.gain > t.needed]
        if not good or _permutation_p(everything, rng) > LARGEST_P_BETWEEN_THROWS:
            return fitted
        best = max(good, key=lambda trial: trial.net)
        fitted = refit(fitted, fitted.model.with_terms(best.term))


def _can_size(session: Session, term: Term) -> bool:
    """Whether the training throws can show the size of the effect."""
    return term.stone is None or bool((session.stones == term.stone).any())


def own_frictions(fitted: SessionFit) -> tuple[Floats, Floats]:
    """For each throw its ln μ less that of the model, and the standard error, (k,) each."""
    reduced = eliminate_states(fitted.grams)
    h = np.maximum(reduced[:, 0, 0], 1e-12)
    return fitted.ln_factors + reduced[:, 0, -1] / h, 1.0 / np.sqrt(h)


def throw_covariates(session: Session, states: Floats) -> dict[str, Floats]:
    """Circumstances in which throws differ, by name, each as a standardised column (k,)."""
    speed = np.hypot(states[:, 2], states[:, 3])
    swept = np.add.reduceat(session.swept, session.starts[:-1]) / np.diff(session.starts)
    columns: dict[str, Floats] = {
        "order": session.orders.astype(float),
        "clock": session.clocks,
        "speed": speed,
        "spin": np.abs(states[:, State.OMEGA]),
        "spin side": np.sign(states[:, State.OMEGA]),
        "direction": np.sign(states[:, State.VY]),
        "x": states[:, State.X],
        "swept": swept,
    }
    if not session.turns.any():
        # A spin that was not measured follows the friction, which it eases.
        del columns["spin"], columns["spin side"]
    for stone in np.unique(session.stones):
        columns[f"stone {stone}"] = (session.stones == stone).astype(float)
    spread = {k: float(np.std(v)) for k, v in columns.items()}
    return {k: (v - v.mean()) / spread[k] for k, v in columns.items() if spread[k] > 1e-9}


def _correlations(columns: Floats, values: Floats, weights: Floats | None = None) -> Floats:
    """|correlation| of columns (..., k, m) with values (k,) or (..., k), weighted, (..., m)."""
    w = np.ones(values.shape[-1]) if weights is None else weights
    w = w / w.sum()
    centred = values - (values @ w)[..., None]
    columns = columns - np.einsum("k,...km->...m", w, columns)[..., None, :]
    size = np.einsum("k,...km->...m", w, columns**2) * (centred**2 @ w)[..., None]
    return np.abs(np.einsum("...k,...km->...m", w * centred, columns)) / (np.sqrt(size) + 1e-12)


def _permutation_p(fitted: SessionFit, rng: np.random.Generator) -> float:
    """Probability that by chance the throws' frictions follow order, clock or a stone so well."""
    columns = throw_covariates(fitted.session, fitted.states)
    chosen = [v for k, v in columns.items() if k in ("order", "clock") or k.startswith("stone")]
    return _p_of_best(np.column_stack(chosen), own_frictions(fitted)[0], rng)


def _stone_p(fitted: SessionFit, term: Term, rng: np.random.Generator) -> float:
    """Probability that by chance what the throws show of a parameter differs so between stones.

    Parameters
    ----------
    fitted : fit without the effect
    term : effect of one stone, with the parameter
    """
    own, sigma = own_values(fitted, term)
    stones = fitted.session.stones
    columns = (stones[:, None] == np.unique(stones)).astype(np.float64)
    # What a throw shows may vary by more than its noise: none counts above twice a usual one.
    return _p_of_best(columns, own, rng, 1.0 / (sigma**2 + np.median(sigma) ** 2))


def own_values(fitted: SessionFit, term: Term) -> tuple[Floats, Floats]:
    """What each throw shows of a parameter of its stone, and the standard error, (k,) each.

    Parameters
    ----------
    fitted : fit around which it is linear
    term : effect of one stone; its first free parameter is asked for
    """
    session, name = fitted.session, term.card.search.stone
    assert name is not None
    stones, which = np.unique(session.stones, return_inverse=True)
    terms = [
        replace(term, values=neutral_values(term.card, **{name: float(s)}), free=term.free[:1])
        for s in stones
    ]
    model = fitted.model.with_terms(*terms)
    _, _, reduced = linearise(model, session, fitted.noise, fitted.states, fitted.ln_factors)
    grams, _ = eliminate_factor(reduced, fitted.ln_factors, fitted.model.spread)
    rows, place = np.arange(len(session)), len(fitted.model.vector) + which
    h = np.maximum(grams[rows, place, place], 1e-12)
    return grams[rows, place, -1] / h, 1.0 / np.sqrt(h)


def _p_of_best(
    columns: Floats, own: Floats, rng: np.random.Generator, weights: Floats | None = None
) -> float:
    """Probability that chance does as well as the column that the throws' own values follow most.

    By permutations, or by Student's t with Bonferroni's correction where that is smaller: there are
    only 120 ways to choose two throws of sixteen, however far off these two are.
    """
    r = float(_correlations(columns, own, weights).max())
    n = len(own)
    t = r * np.sqrt((n - 2) / max(1.0 - r * r, 1e-12))
    student = columns.shape[1] * 2.0 * float(student_t.sf(t, n - 2))
    return min(student, _best_of(columns, own, rng, weights)[1])


def _best_of(
    columns: Floats, values: Floats, rng: np.random.Generator, weights: Floats | None = None
) -> tuple[int, float]:
    """The column that correlates most, and the probability that chance's best does as well."""
    found = _correlations(columns, values, weights)
    # The rows of the columns change places, so that a throw keeps its value and its weight.
    orders = np.array([rng.permutation(len(values)) for _ in range(PERMUTATIONS)])
    chance = _correlations(columns[orders], values, weights).max(axis=1)
    return int(np.argmax(found)), float(((chance >= found.max()).sum() + 1) / (PERMUTATIONS + 1))


def friction_structure(fitted: SessionFit, rng: np.random.Generator) -> tuple[str, float]:
    """The circumstance that the throws' own frictions follow most, and p that it is chance.

    Beside a friction map it is not asked whether they follow the line: throws on a line share what
    is inexact in the map, and chance would not do as well.
    """
    if fitted.model.spread <= 1.01 * LEAST_SPREAD or len(fitted.session) < 8:
        return "", 1.0
    columns = throw_covariates(fitted.session, fitted.states)
    if fitted.model.map_field is not None:
        columns.pop("x", None)
    which, p = _best_of(np.column_stack(list(columns.values())), own_frictions(fitted)[0], rng)
    return list(columns)[which], p
