"""Significance: the proof of an effect by throws, and of differences between their frictions.

Frames of a throw are not independent, throws are. Every throw is scored under a fit that has not
seen it, with and without the effect: by its density, in which the throw's release and friction and
all shared parameters are integrated out. Around a fit everything is quadratic, so that a throw is
excluded by subtracting its Gram matrix. Student's t gives the probability that the differences are
above zero by chance. An effect between throws (wear, drift, a stone) shows once per throw, in the
throw's own friction. It is tested by Student's t of the correlation with the variable that the
frictions follow most. An effect of one stone within its throws is tested in the same way, on each
throw's estimate of it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import t as student_t

from curling_env.physics.state import State
from curling_env.typing import Floats
from friction_estimation.discovery.data.session import Session
from friction_estimation.discovery.model.candidates import Term, neutral_values
from friction_estimation.discovery.model.fit import SessionFit, fit, fit_to, refit
from friction_estimation.discovery.model.minimum import minimum_of
from friction_estimation.discovery.model.model import Model
from friction_estimation.discovery.search.selection import without_term
from friction_estimation.discovery.tuning import (
    LARGEST_IMPROVEMENT,
    LEAST_SPREAD,
)

WIDEST = 1e3
"""Standard deviation of that prior for a parameter without bounds, in its unit."""


def broad_prior(model: Model) -> Floats:
    """Gram matrix of a broad prior around the fitted values, (P + 1, P + 1).

    Its standard deviations are those of a uniform distribution between a parameter's bounds;
    without bounds it is nearly flat.
    """
    low, high = model.bounds
    deviations = np.minimum((high - low) / np.sqrt(12.0), WIDEST)
    return np.diag(np.append(deviations**-2.0, 0.0))


def left_out_scores(fitted: SessionFit) -> Floats:
    """−2 ln of the density of every throw under the fit to all others, (k,), up to a constant per
    throw.


    """
    grams, log_terms = fitted.linear.each()
    whole = grams.sum(axis=0) + fitted.linear.prior + broad_prior(fitted.model)
    return minimum_of(whole).level - minimum_of(whole - grams).level + log_terms


def unseen_scores(fitted: SessionFit, session: Session) -> Floats:
    """Return the same for throws that a fit has not seen, each separately, (k,)."""
    seen = fit(fitted.model, session, fitted.noise, shared=False)
    grams, log_terms = seen.linear.each(fitted.model.spread)
    whole = fitted.linear.total() + broad_prior(fitted.model)
    return minimum_of(whole + grams).level - minimum_of(whole).level + log_terms


@dataclass(frozen=True, kw_only=True, eq=False)
class EffectEvidence:
    """The evidence for one effect of a model.

    Parameters
    ----------
    label : label of its term
    gain : rise of −2 ln likelihood without it
    p : probability that chance gains as much
    improvements : (k,) improvement of each throw's score, in order of play
    """

    label: str
    gain: float
    p: float
    improvements: Floats


def weigh_evidence(
    fitted: SessionFit,
    labels: Sequence[str],
    held_out: Session | None,
    whole: Session,
) -> list[EffectEvidence]:
    """Remove each of some effects and compare the throws' scores without it.

    Parameters
    ----------
    fitted : fit with the effects
    labels : labels of their terms
    held_out : throws that no fit has seen, which count too, if there are some
    whole : all throws, for effects between throws and of one stone
    """
    throws = fitted.session.throws
    if held_out is not None:
        throws = np.concatenate([throws, held_out.throws])
    order, scores = np.argsort(throws), _scores(fitted, held_out)
    found: list[EffectEvidence] = []
    for label in labels:
        without = _fit_without(fitted, label)
        improvements = (_scores(without, held_out) - scores)[order]
        term = fitted.model.term(label)
        if term.between_throws:
            p = _p_between_throws(fit_to(without, whole))
        elif term.stone is not None:
            p = _p_of_stones(fit_to(without, whole), term)
        else:
            p = p_of_mean(improvements)
        gain = without.deviance - fitted.deviance
        found.append(EffectEvidence(label=label, gain=gain, p=p, improvements=improvements))
    return found


def _scores(fitted: SessionFit, held_out: Session | None) -> Floats:
    """−2 ln of the density of every throw under the fit to all others, then of throws held out."""
    own = left_out_scores(fitted)
    return own if held_out is None else np.append(own, unseen_scores(fitted, held_out))


def _fit_without(fitted: SessionFit, label: str) -> SessionFit:
    """Return the fit without an effect."""
    error = fitted.model.systematic_error
    if error is None or fitted.model.term(label).card.is_physical:
        return without_term(fitted, label)
    # The systematic error would replace it in every throw; selection has weighed the two.
    model = replace(fitted.model.without(label), systematic_error=replace(error, held=True))
    return refit(fitted, model)


def p_of_mean(improvements: Floats) -> float:
    """Probability that chance alone gives such a mean improvement of throws (k,), by Student's t.

    No single throw decides, even if it gains a thousand times more than the others.
    """
    capped = np.clip(improvements, -LARGEST_IMPROVEMENT, LARGEST_IMPROVEMENT)
    if len(capped) < 2 or capped.sum() <= 0.0:
        return 1.0
    error = float(capped.std(ddof=1)) / np.sqrt(len(capped))
    return float(student_t.sf(float(capped.mean()) / max(error, 1e-12), len(capped) - 1))


def own_frictions(fitted: SessionFit) -> tuple[Floats, Floats]:
    """For each throw its ln μ minus that of the model, and the standard error, (k,) each."""
    reduced = fitted.linear.reduced
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
        # An unmeasured spin is correlated with the friction.
        del columns["spin"], columns["spin side"]
    for stone, count in zip(*np.unique(session.stones, return_counts=True), strict=True):
        if count > 1:
            columns[f"stone {stone}"] = (session.stones == stone).astype(float)
    spread = {k: float(np.std(v)) for k, v in columns.items()}
    return {k: (v - v.mean()) / spread[k] for k, v in columns.items() if spread[k] > 1e-9}


def strongest_correlation(
    columns: Floats, values: Floats, weights: Floats | None = None
) -> tuple[int, float]:
    """Return the column with the strongest correlation.

    Parameters
    ----------
    columns : (k, m) columns
    values : (k,) values
    weights : (k,) weights of the rows; all alike by default

    Returns
    -------
    the column, and the probability that chance does as well in the best of all columns: by
    Student's t, with Bonferroni's correction
    """
    w = np.ones(len(values)) if weights is None else weights
    w = w / w.sum()
    columns, values = columns - w @ columns, values - w @ values
    size = (w @ columns**2) * (w @ values**2)
    correlations = np.abs((w * values) @ columns) / (np.sqrt(size) + 1e-12)
    best, degrees = int(np.argmax(correlations)), len(values) - 2
    r = float(correlations[best])
    t = r * np.sqrt(degrees / max(1.0 - r * r, 1e-12))
    return best, min(1.0, len(correlations) * 2.0 * float(student_t.sf(t, degrees)))


def _p_between_throws(fitted: SessionFit) -> float:
    """Probability of such a correlation of the throws' frictions with order, clock or a stone by
    chance.
    """
    columns = throw_covariates(fitted.session, fitted.states)
    chosen = [v for k, v in columns.items() if k in ("order", "clock") or k.startswith("stone")]
    return strongest_correlation(np.column_stack(chosen), own_frictions(fitted)[0])[1]


def _p_of_stones(fitted: SessionFit, term: Term) -> float:
    """Probability of such a difference of a parameter between stones by chance.

    Parameters
    ----------
    fitted : fit without the effect
    term : effect of one stone, with the parameter
    """
    own, sigma = own_values(fitted, term)
    stones, counts = np.unique(fitted.session.stones, return_counts=True)
    columns = (fitted.session.stones[:, None] == stones[counts > 1]).astype(np.float64)
    # Estimates of throws may vary by more than their noise: no weight exceeds twice the usual one.
    return strongest_correlation(columns, own, 1.0 / (sigma**2 + np.median(sigma) ** 2))[1]


def own_values(fitted: SessionFit, term: Term) -> tuple[Floats, Floats]:
    """Return each throw's value of a parameter of its stone, and the standard error, (k,) each.

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
    grams, _ = fitted.linear_with(*terms).each()
    rows, place = np.arange(len(session)), len(fitted.model.vector) + which
    h = np.maximum(grams[rows, place, place], 1e-12)
    return grams[rows, place, -1] / h, 1.0 / np.sqrt(h)


def friction_structure(fitted: SessionFit) -> tuple[str, float]:
    """Return the circumstance that the throws' own frictions follow most, and its p.

    With a friction map the line is not tested: throws on one line share the errors of the map.
    """
    if fitted.model.spread <= 1.01 * LEAST_SPREAD or len(fitted.session) < 8:
        return "", 1.0
    columns = throw_covariates(fitted.session, fitted.states)
    if fitted.model.map_field is not None:
        columns.pop("x", None)
    which, p = strongest_correlation(
        np.column_stack(list(columns.values())), own_frictions(fitted)[0]
    )
    return list(columns)[which], p
