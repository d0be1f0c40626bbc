"""Whether an effect is proved throw by throw, and whether what is left between throws is chance.

Frames of a throw are not independent, throws are. Every throw is scored under a fit that has not
seen it, with and without the effect; the signs of the differences are then flipped at random.
An effect between throws (wear, drift, a stone) is tested by dealing the throws' own frictions out
anew: chance must rarely do as well as the best of all such effects.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import t as student_t

from curling_env.typing import Floats
from friction_estimation.discovery.data.session import Session
from friction_estimation.discovery.model.candidates import Term, candidates
from friction_estimation.discovery.model.fit import Fit, eliminate_states, fit
from friction_estimation.discovery.search.score_test import left_out_scores, screen, sign_flip_p
from friction_estimation.discovery.search.selection import WORTH_TRYING, refit, try_term

PERMUTATIONS = 4000
"""Deals of the throws' frictions: p down to 1/4000."""
BETWEEN = 0.004
"""p below which an effect between throws is taken up. There are few throws and many such effects,
and a wrong name is worse than none."""
STRUCTURE = 0.004
"""p below which the throws' frictions follow something: they are not chance."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Proof:
    """What speaks for one effect of a model.

    Parameters
    ----------
    label : of the term
    gain : loss of −2 ln likelihood without it
    p : probability of as much by chance
    corrected : the same with Holm's correction, once that is known
    improvements : (k,) of the throws' scores, in order of play
    """

    label: str
    gain: float
    p: float
    improvements: Floats
    corrected: float = 1.0


def score_unseen(fitted: Fit, session: Session) -> Floats:
    """Deviance of throws that a fit has not seen: only their releases and factors are free."""
    seen = fit(fitted.model, session, fitted.noise, shared=False)
    scores = left_out_scores(seen, shared=False)
    return scores


def prove(
    fitted: Fit, label: str, held_out: Session, whole: Session, rng: np.random.Generator
) -> Proof:
    """Take an effect out again and see which throws miss it.

    Parameters
    ----------
    fitted : with the effect
    label : of its term
    held_out : throws that no fit has seen, which count as well
    whole : all throws, for effects that are seen only between throws
    """
    model = fitted.model.without(label)
    if model.misplacement and fitted.model.term(label).form.kind == "measurement":
        # Errors of places would stand in for it in every throw; selection has weighed the two.
        model = replace(model, misplacement=replace(model.misplacement, held=True))
    without = refit(fitted, model)
    improvements = left_out_scores(without) - left_out_scores(fitted)
    throws = fitted.session.throws
    if len(held_out):
        more = score_unseen(without, held_out) - score_unseen(fitted, held_out)
        improvements = np.concatenate([improvements, more])
        throws = np.concatenate([throws, held_out.throws])
    p = sign_flip_p(improvements, rng)
    if fitted.model.term(label).between_throws:
        p = _permutation_p(fit(without.model, whole, fitted.noise), rng)
        p = p if p < BETWEEN else 1.0
    return Proof(
        label=label,
        gain=without.deviance - fitted.deviance,
        p=p,
        improvements=improvements[np.argsort(throws)],
    )


def between_throws(fitted: Fit, whole: Session, rng: np.random.Generator) -> Fit:
    """Add effects that are seen only between throws, looking at all of them.

    Such an effect shows once per throw, and the training throws alone are few. It is chosen and
    proved on the throws' own frictions; its size still comes from the training throws.
    """
    while True:
        everything = fit(fitted.model, whole, fitted.noise)
        terms = [
            t
            for t in candidates(whole, fitted.model.terms)
            if t.between_throws and _tells(fitted.session, t)
        ]
        looks = [look for look in screen(everything, terms) if look.gain > WORTH_TRYING]
        trials = [try_term(everything, look.term) for look in looks[:3]]
        good = [t for t in trials if t.gain > t.needed]
        if not good or _permutation_p(everything, rng) > BETWEEN:
            return fitted
        best = max(good, key=lambda trial: trial.net)
        fitted = refit(fitted, fitted.model.with_terms(best.term))


def _tells(session: Session, term: Term) -> bool:
    """Whether the training throws can size the effect at all."""
    stone = term.values.get("stone")
    return stone is None or bool((session.stones == stone).any())


def own_frictions(fitted: Fit) -> tuple[Floats, Floats]:
    """Each throw's ln μ beyond the model's, and its standard error, from that throw alone."""
    reduced = eliminate_states(fitted.grams)
    h = np.maximum(reduced[:, 0, 0], 1e-12)
    return fitted.ln_factors + reduced[:, 0, -1] / h, 1.0 / np.sqrt(h)


def throw_covariates(session: Session, states: Floats) -> dict[str, Floats]:
    """What throws differ in, as standardised columns; names are those of `depends_on`."""
    speed = np.hypot(states[:, 2], states[:, 3])
    swept = np.add.reduceat(session.swept, session.starts[:-1]) / np.diff(session.starts)
    columns: dict[str, Floats] = {
        "order": session.orders.astype(float),
        "clock": session.clocks,
        "speed": speed,
        "spin": np.abs(states[:, 5]),
        "spin side": np.sign(states[:, 5]),
        "direction": np.sign(states[:, 3]),
        "x": states[:, 0],
        "swept": swept,
    }
    for stone in np.unique(session.stones):
        columns[f"stone {stone}"] = (session.stones == stone).astype(float)
    spread = {k: float(np.std(v)) for k, v in columns.items()}
    return {k: (v - v.mean()) / spread[k] for k, v in columns.items() if spread[k] > 1e-9}


def _correlations(columns: Floats, values: Floats) -> Floats:
    """|correlation| of columns (k, m) with values (..., k) → (..., m)."""
    centred = values - values.mean(axis=-1, keepdims=True)
    size = np.sqrt((centred**2).sum(axis=-1, keepdims=True)) + 1e-12
    return np.abs(centred @ columns) / (size * np.sqrt(len(columns)))


def _permutation_p(fitted: Fit, rng: np.random.Generator) -> float:
    """Probability that chance lets the throws' frictions follow order, clock or a stone so.

    By dealing the frictions out anew, or by Student's t with Bonferroni's correction where that
    is smaller: two throws of sixteen can be dealt in 120 ways only, however far off they are.
    """
    columns = throw_covariates(fitted.session, fitted.states)
    chosen = [v for k, v in columns.items() if k in ("order", "clock") or k.startswith("stone")]
    stacked, own = np.column_stack(chosen), own_frictions(fitted)[0]
    r = float(_correlations(stacked, own).max())
    n = len(own)
    t = r * np.sqrt((n - 2) / max(1.0 - r * r, 1e-12))
    student = len(chosen) * 2.0 * float(student_t.sf(t, n - 2))
    return min(student, _best_of(stacked, own, rng)[1])


def _best_of(columns: Floats, values: Floats, rng: np.random.Generator) -> tuple[int, float]:
    """Which column correlates most, and the probability that chance's best does as well."""
    found = _correlations(columns, values)
    dealt = np.array([rng.permutation(values) for _ in range(PERMUTATIONS)])
    chance = _correlations(columns, dealt).max(axis=1)
    return int(np.argmax(found)), float(((chance >= found.max()).sum() + 1) / (PERMUTATIONS + 1))


def friction_structure(fitted: Fit, rng: np.random.Generator) -> tuple[str, float]:
    """What the throws' left-over frictions follow most, and the p that it is chance."""
    if fitted.model.spread <= 0.0 or len(fitted.session) < 8:
        return "", 1.0
    columns = throw_covariates(fitted.session, fitted.states)
    which, p = _best_of(np.column_stack(list(columns.values())), own_frictions(fitted)[0], rng)
    return list(columns)[which], p
