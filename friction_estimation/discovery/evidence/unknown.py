"""The variables that an unexplained discrepancy follows, when no candidate explains it.

Pushes along the travel, to its left, of the rotation and fixed in the sheet, each a smooth function
of one variable, are added to the model by their linear response. The variable that improves most
the throws that the fit has not seen is taken, then the next one beside it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from curling_env.physics.effects.card import Push
from curling_env.physics.state import State
from curling_env.typing import Floats, Indices
from friction_estimation.discovery.model.elimination import (
    eliminate_factor,
    eliminate_states,
    gram_matrices,
)
from friction_estimation.discovery.model.fit import SessionFit, prior_gram, solve_shared
from friction_estimation.discovery.model.model import sensitivities
from friction_estimation.discovery.search.score_test import sign_flip_p
from friction_estimation.discovery.tuning import (
    FURTHER_VARIABLE_GAIN,
    LARGEST_P,
    LEAST_VARIABLE_GAIN,
    MOST_VARIABLES,
    PUSH_SCALES,
    USUAL_PUSHES,
)

PUSHES: tuple[Push, ...] = ("along", "left", "turn", "along the sheet", "across the sheet")


@dataclass(frozen=True, kw_only=True, eq=False)
class Dependence:
    """A variable that the discrepancy follows.

    Parameters
    ----------
    variable : name of the variable, as in the `depends_on` of a report
    share : part of the deviance of throws not seen that it removes beside those before it
    p : probability that chance does as well, by flipping the signs of throws
    push : push by which it acts most
    """

    variable: str
    share: float
    p: float
    push: Push


def variables(fitted: SessionFit) -> dict[str, Floats]:
    """Centred functions of each variable at every row, (rows, b) each, by name."""
    session, path = fitted.session, fitted.predicted
    owner = session.owner
    speed = np.hypot(path[:, 2], path[:, 3])
    spin = path[:, State.OMEGA]
    functions: dict[str, Floats] = {
        "speed": _tents(speed, 5),
        "t": _tents(session.times, 5),
        "y": _tents(path[:, State.Y], 21),
        "x": _powers(path[:, State.X], 3),
        "spin": np.column_stack([np.tanh(spin / 0.1), _powers(spin, 2), _powers(np.abs(spin), 1)]),
        "theta": np.column_stack([np.sin(path[:, State.THETA]), np.cos(path[:, State.THETA])]),
        "clock": _powers((session.clocks[owner]), 2),
        "order": _powers(session.orders[owner].astype(float), 2),
        "swept": session.swept[:, None] - session.swept.mean(),
    }
    stones = np.unique(session.stones)
    if len(stones) > 1:
        functions["stone"] = (session.stones[owner][:, None] == stones[:-1]).astype(float)
    if not session.turns.any():
        functions.pop("theta")
        functions.pop("spin")
    return {k: v - v.mean(axis=0) for k, v in functions.items() if np.ptp(v, axis=0).max() > 1e-9}


def _powers(values: Floats, degree: int) -> Floats:
    scaled = (values - values.mean()) / max(float(values.std()), 1e-9)
    return np.column_stack([scaled**k for k in range(1, degree + 1)])


def _tents(values: Floats, count: int) -> Floats:
    """Piecewise linear functions on evenly spaced knots."""
    place = (values - values.min()) / max(float(np.ptp(values)), 1e-9) * (count - 1)
    return np.maximum(1.0 - np.abs(place[:, None] - np.arange(count)), 0.0)


def responses(fitted: SessionFit, functions: Floats) -> Floats:
    """Change of x, y, theta for pushes that follow functions (rows, b), (rows, 3, 5 b).

    A sideways push turns the travel at the rate a/v, and friction acts along the new travel: the
    sideways speed is v ∫ a/v dt.
    """
    session, path = fitted.session, fitted.predicted
    b = functions.shape[1]
    out = np.zeros((len(path), 3, 5 * b))
    for i in range(len(session)):
        rows = session.rows(i)
        steps = np.diff(session.times[rows], prepend=session.times[rows][0])[:, None]
        speed = np.maximum(np.hypot(path[rows, 2], path[rows, 3]), 0.02)[:, None]
        moving = (speed > 0.03).astype(float)
        travel = path[rows, 2:4] / speed
        f = functions[rows] * moving
        along = np.cumsum(np.cumsum(f * steps, axis=0) * steps * moving, axis=0)
        turned = np.cumsum(f / speed * steps, axis=0)
        left = np.cumsum(speed * turned * steps * moving, axis=0)
        spun = np.cumsum(np.cumsum(f * steps, axis=0) * steps * moving, axis=0)
        direction = 1.0 if travel[0, 1] >= 0 else -1.0
        for push, (sideways, size) in enumerate(
            ((False, 1.0), (True, 1.0), (None, 1.0), (False, direction), (True, direction))
        ):
            columns = slice(push * b, (push + 1) * b)
            if sideways is None:
                out[rows, 2, columns] = spun
            elif sideways:
                out[rows, 0, columns] = -travel[:, 1:] * left * size
                out[rows, 1, columns] = travel[:, :1] * left * size
            else:
                out[rows, 0, columns] = travel[:, :1] * along * size
                out[rows, 1, columns] = travel[:, 1:] * along * size
    return out


def find_dependences(fitted: SessionFit, rng: np.random.Generator) -> list[Dependence]:
    """The variables that the discrepancy follows, at most three, the strongest first.

    Constant pushes follow nothing; they count as no variable and are always in the model.

    Parameters
    ----------
    fitted : fit that leaves the discrepancy
    rng : source of the flipped signs
    """
    functions = {"": np.ones((len(fitted.predicted), 1)), **variables(fitted)}
    _, own = sensitivities(fitted.model, fitted.session, fitted.states, fitted.ln_factors)
    columns, places = [own], dict[tuple[str, Push], Indices]()
    position = own.shape[2] - 7
    for name, f in functions.items():
        b = f.shape[1]
        columns.append(responses(fitted, f))
        for k, push in enumerate(PUSHES):
            places[name, push] = np.arange(position + k * b, position + (k + 1) * b)
        position += len(PUSHES) * b
    stacked = np.concatenate([*columns, fitted.residuals[:, :, None]], axis=2)
    reduced = eliminate_states(gram_matrices(fitted.session, fitted.noise, stacked))
    grams, _ = eliminate_factor(reduced, fitted.ln_factors, fitted.model.spread)
    own_places = np.arange(own.shape[2] - 7)
    plain = _scores(fitted, grams, own_places, np.empty(0))
    chosen: list[tuple[str, Push]] = [("", push) for push in PUSHES]
    present = _best_scores(fitted, grams, places, chosen)
    found: list[Dependence] = []
    first = 0.0
    while len({f.variable for f in found}) < MOST_VARIABLES:
        tried = {
            pair: _best_scores(fitted, grams, places, [*chosen, pair])
            for pair in places
            if pair not in chosen and pair[0]
        }
        if not tried:
            break
        # By logarithms no single throw decides, and those that gain more still count for more.
        best = min(tried, key=lambda pair: float(np.log1p(_excess(fitted, tried[pair])).sum()))
        improvements = present - tried[best]
        p = sign_flip_p(improvements, rng)
        gain = float(improvements.sum())
        first = first or gain
        if p > LARGEST_P or gain < max(FURTHER_VARIABLE_GAIN * first, LEAST_VARIABLE_GAIN):
            break
        share = gain / max(float(plain.sum() - _dof(fitted).sum()), gain)
        found.append(Dependence(variable=best[0], share=share, p=p, push=best[1]))
        chosen.append(best)
        present = tried[best]
    return found


def _dof(fitted: SessionFit) -> Floats:
    """Number of measured values of each throw: the deviance that noise alone would leave, (k,)."""
    values = np.isfinite(fitted.session.observed).sum(axis=1)
    return np.add.reduceat(values, fitted.session.starts[:-1]).astype(np.float64)


def _excess(fitted: SessionFit, scores: Floats) -> Floats:
    """Deviance of each throw beyond that of noise, in standard deviations, (k,)."""
    dof = _dof(fitted)
    return np.maximum(scores - dof, 0.0) / np.sqrt(2.0 * dof)


def _best_scores(
    fitted: SessionFit,
    grams: Floats,
    places: dict[tuple[str, Push], Indices],
    chosen: list[tuple[str, Push]],
) -> Floats:
    """Left-out deviance per throw with the chosen pushes, at the best of their scales, (k,)."""
    own = np.arange(len(fitted.model.vector))
    kept = np.concatenate([own, *(places[pair] for pair in chosen)])
    sizes = np.concatenate(
        [np.full(len(places[pair]), USUAL_PUSHES[PUSHES.index(pair[1])]) for pair in chosen]
    )
    tried = [_scores(fitted, grams, kept, scale * sizes) for scale in PUSH_SCALES]
    return min(tried, key=lambda scores: float(scores.sum()))


def _scores(fitted: SessionFit, grams: Floats, kept: Indices, sizes: Floats) -> Floats:
    """Left-out deviance per throw with some of the columns, (k,).

    Parameters
    ----------
    fitted : fit of the model
    grams : (k, m, m) Gram matrices of all columns
    kept : columns that are used, those of the model first
    sizes : prior standard deviations of the others
    """
    columns = np.concatenate([kept, [grams.shape[1] - 1]])
    part = grams[:, columns[:, None], columns]
    size = len(columns)
    prior = prior_gram(fitted.model, size)
    extra = np.arange(size - 1 - len(sizes), size - 1)
    prior[extra, extra] += sizes**-2
    total = part.sum(axis=0) + prior
    scores = np.empty(len(part))
    for i, gram in enumerate(part):
        move, _ = solve_shared(total - gram)
        scores[i] = gram[-1, -1] - 2 * gram[:-1, -1] @ move + move @ gram[:-1, :-1] @ move
    return scores
