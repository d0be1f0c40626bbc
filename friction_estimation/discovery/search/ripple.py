"""Whether the throws of a session show a ripple of their camera along the sheet.

A ripple that was always fitted would now and then take up what noise or an unknown effect left. So
it is declined unless the evidence for it is clear beside the map and beside effects that bend
throws in a similar way, and unless each half of the throws, fitted on its own, finds the same one.
Where throws cannot tell a ripple from the ice, the result says so.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from curling_env.physics.effects import catalogue
from curling_env.physics.state import State
from curling_env.typing import Floats
from friction_estimation.discovery.model.camera_ripple import CameraRipple, ripple_over
from friction_estimation.discovery.model.candidates import Term, neutral_values
from friction_estimation.discovery.model.elimination import (
    eliminate_factor,
    eliminate_states,
    gram_matrices,
)
from friction_estimation.discovery.model.fit import SessionFit
from friction_estimation.discovery.model.model import Model
from friction_estimation.discovery.model.quadratic import (
    prior_gram,
    profile_amplitudes,
    projected,
    solve_shared,
)
from friction_estimation.discovery.model.sensitivity import sensitivities
from friction_estimation.discovery.search.score_test import least_deviance
from friction_estimation.discovery.tuning import (
    CLEAR_RIPPLE_GAIN,
    LEAST_LIKENESS_OF_HALVES,
    LEAST_THROWS_FOR_RIPPLE,
    LEAST_VARIETY,
    RIPPLE_LENGTHS,
)

RippleVerdict = Literal["found", "none", "inseparable"]

_LIKE_A_CAMERA = ("speed_dependent_friction", "air_drag", "slope")
"""Effects that change the deceleration with the speed or the direction, as a ripple does."""


@dataclass(frozen=True, kw_only=True, eq=False)
class RippleSearch:
    """The result of a search for a ripple of the camera.

    Parameters
    ----------
    outcome : ``found``; ``none``; or ``inseparable`` from the ice
    variety : variety of the signed v² at which throws passed the same places; see `variety`
    seen_from : amplitude from which a ripple of usual length would be clear [m]; infinite where
        none would
    gain : fall of −2 ln likelihood that the best ripple brings
    likeness : correlation of the ripples that two halves of the throws find; 0 where not computed
    ripple : the likeliest ripple, of zero; None where none was found
    """

    outcome: RippleVerdict
    variety: float
    seen_from: float = np.inf
    gain: float = 0.0
    likeness: float = 0.0
    ripple: CameraRipple | None = None


def find_ripple(fitted: SessionFit) -> RippleSearch:
    """Search the throws of a fit for a ripple of their camera.

    Parameters
    ----------
    fitted : fit without a ripple
    """
    squares, places = _signed_squares(fitted)
    varied = variety(places, squares)
    if len(fitted.session) < LEAST_THROWS_FOR_RIPPLE or varied < LEAST_VARIETY:
        return RippleSearch(outcome="inseparable", variety=varied)
    model = fitted.model.with_terms(*_camera_like_terms(fitted.model))
    beside = replace(fitted, model=model)
    _, columns = sensitivities(model, fitted.session, fitted.states, fitted.ln_factors)
    without = _reduced(beside, columns)
    least = least_deviance(beside, model, without)
    xy = [fitted.session.xy[fitted.session.rows(i)] for i in range(len(fitted.session))]
    best: tuple[float, CameraRipple, Floats] | None = None
    clear_from = np.inf
    for length in RIPPLE_LENGTHS:
        ripple = ripple_over(xy, length)
        reduced = _reduced(beside, columns, ripple)
        total = _pooled(beside, reduced)
        if length == RIPPLE_LENGTHS[1]:
            clear_from = _seen_from(model, ripple, total)
        rippled = replace(model, ripple=ripple)
        value = least_deviance(beside, rippled, reduced)
        if best is None or value < best[0]:
            best = (value, profile_amplitudes(rippled, total)[0].ripple or ripple, reduced)
    assert best is not None
    gain, ripple, reduced = least - best[0], best[1], best[2]
    likeness = 0.0
    if gain >= CLEAR_RIPPLE_GAIN:
        likeness = _likeness(replace(beside, model=replace(model, ripple=ripple)), reduced, squares)
    found = gain >= CLEAR_RIPPLE_GAIN and likeness >= LEAST_LIKENESS_OF_HALVES
    return RippleSearch(
        outcome="found" if found else "none",
        variety=varied,
        seen_from=clear_from,
        gain=float(gain),
        likeness=likeness,
        ripple=ripple if found else None,
    )


def _camera_like_terms(model: Model) -> list[Term]:
    """Effects that could pass for a ripple and that the model does not fit, at neutral values."""
    fitted = {term.name for term in model.terms if term.free}
    cards = [card for name, card in catalogue().items() if name in _LIKE_A_CAMERA]
    return [
        Term(card=card, values=neutral_values(card), free=card.first)
        for card in cards
        if card.name not in fitted
    ]


def _reduced(fitted: SessionFit, columns: Floats, ripple: CameraRipple | None = None) -> Floats:
    """Gram matrices of a fit with the releases projected out, with a ripple's columns among them.

    Parameters
    ----------
    fitted : fit around which all is linear
    columns : (rows, 3, 7 + P) sensitivities, as of `sensitivities`
    ripple : ripple whose columns are added
    """
    session, at = fitted.session, 7 + fitted.model.ripple_slice.start
    added = np.zeros((len(columns), 3, 0 if ripple is None else len(ripple)))
    if ripple is not None:
        added[:, :2] = ripple.columns(fitted.predicted[:, :2], fitted.predicted[:, State.THETA])
    stacked = np.concatenate(
        [columns[:, :, :at], added, columns[:, :, at:], fitted.residuals[:, :, None]], axis=2
    )
    return eliminate_states(gram_matrices(session, fitted.noise, stacked))


def _pooled(fitted: SessionFit, reduced: Floats, throws: Sequence[int] | None = None) -> Floats:
    """Gram matrix of some throws, all by default, with their own frictions integrated out."""
    grams, _ = eliminate_factor(reduced, fitted.ln_factors, fitted.model.spread)
    return grams.sum(axis=0) if throws is None else grams[list(throws)].sum(axis=0)


def _seen_from(model: Model, ripple: CameraRipple, total: Floats) -> float:
    """Amplitude from which a ripple is expected to bring a clear gain [m]."""
    information = np.maximum(np.linalg.eigvalsh(_information(model, ripple, total)), 0.0)
    amplitudes = np.geomspace(1e-5, 1.0, 121)
    signal = information[None] * amplitudes[:, None] ** 2
    gain = (signal - np.log1p(signal)).sum(axis=1)
    clear = np.flatnonzero(gain >= CLEAR_RIPPLE_GAIN)
    return float(amplitudes[clear[0]]) if len(clear) else np.inf


def _information(model: Model, ripple: CameraRipple, total: Floats) -> Floats:
    """Information of the throws about a ripple's coefficients beside all else, (n, n) [1/m²]."""
    with_ripple = replace(model, ripple=ripple)
    free = replace(ripple, amplitude=np.inf)
    whole = total + prior_gram(replace(with_ripple, ripple=free), len(total))
    own = np.arange(len(total))[with_ripple.ripple_slice]
    others = np.setdiff1d(np.arange(len(total) - 1), own)
    return projected(whole, own, others)[0]


def _likeness(fitted: SessionFit, reduced: Floats, squares: Sequence[Floats]) -> float:
    """Correlation of the ripples that two halves of the throws find, each on its own.

    The two are compared by what they would do to all throws, so that what no throw can see has no
    weight.

    Parameters
    ----------
    fitted : fit with a ripple in its model
    reduced : Gram matrices with the ripple's columns
    squares : signed v² along each throw, as of `variety`
    """
    model = fitted.model
    assert model.ripple is not None
    speeds = np.array([float(np.abs(v).max()) for v in squares])
    directions = np.array([float(np.sign(np.median(v))) for v in squares])
    found: list[Floats] = []
    for half in split_throws(speeds, directions):
        total = _pooled(fitted, reduced, half)
        step, _ = solve_shared(total + prior_gram(model, len(total)))
        found.append(step[model.ripple_slice])
    one, other = found
    inner = _information(replace(model, ripple=None), model.ripple, _pooled(fitted, reduced))
    size = float(np.sqrt(max(one @ inner @ one, 0.0) * max(other @ inner @ other, 0.0)))
    return float(one @ inner @ other) / size if size > 0.0 else 0.0


def _signed_squares(fitted: SessionFit) -> tuple[list[Floats], list[Floats]]:
    """For each throw v² along its path, negative towards home [m²/s²], and y there, growing [m]."""
    squares: list[Floats] = []
    places: list[Floats] = []
    for i in range(len(fitted.session)):
        state = fitted.predicted[fitted.session.rows(i)]
        order = np.argsort(state[:, State.Y])
        way = 1.0 if state[-1, State.Y] >= state[0, State.Y] else -1.0
        squares.append(way * (state[order, State.VX] ** 2 + state[order, State.VY] ** 2))
        places.append(state[order, State.Y])
    return squares, places


def variety(places: Sequence[Floats], squares: Sequence[Floats]) -> float:
    """How differently the throws passed the same places: spread of their signed v² over its size.

    Parameters
    ----------
    places : for each throw, increasing positions along the sheet [m]
    squares : for each throw, v² there, negative for throws towards negative y [m²/s²]

    Returns
    -------
    0 where all throws pass each place alike, 1 where half of them come the other way
    """
    low, high = min(y[0] for y in places), max(y[-1] for y in places)
    here = np.arange(low, high, 0.5)
    seen = np.array(
        [
            np.interp(here, y, v, left=np.nan, right=np.nan)
            for y, v in zip(places, squares, strict=True)
        ]
    )
    seen = seen[:, np.isfinite(seen).sum(axis=0) >= 2]
    if seen.size == 0:
        return 0.0
    return float(np.sqrt(np.nanmean(np.nanvar(seen, axis=0)) / np.nanmean(seen**2)))


def split_throws(speeds: Floats, directions: Floats) -> tuple[list[int], list[int]]:
    """Two halves of the throws that are alike in direction and speed.

    Parameters
    ----------
    speeds : (throws,) speeds at the start [m/s]
    directions : (throws,) sign of the travel along the sheet

    Returns
    -------
    numbers of the throws in each half
    """
    order = np.lexsort((speeds, directions)).tolist()
    # Dealt 0 1 1 0 ..., so that neither half gets the faster throw of every pair.
    first = [k for place, k in enumerate(order) if place % 4 in (0, 3)]
    return first, [k for place, k in enumerate(order) if place % 4 in (1, 2)]
