"""Search for a ripple of the camera along the sheet in the throws of a session.

If it were always fitted, a ripple would occasionally absorb noise or an unknown effect. It is
accepted only if its evidence is clear beside the map and similar effects, and if both halves of the
throws give the same ripple. If throws cannot distinguish a ripple from the ice, the result states
that.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from curling_env.physics.effects import catalogue
from curling_env.physics.state import State
from curling_env.typing import Floats
from friction_estimation.discovery.model.candidates import Term, neutral_values
from friction_estimation.discovery.model.fit import SessionFit
from friction_estimation.discovery.model.gaussian_field import CameraRipple, ripple_over
from friction_estimation.discovery.model.linearisation import Linearisation
from friction_estimation.discovery.model.minimum import minimum_of, projected
from friction_estimation.discovery.model.model import Model
from friction_estimation.discovery.model.quadratic import profile_amplitudes
from friction_estimation.discovery.model.sensitivity import sensitivities
from friction_estimation.discovery.tuning import (
    LEAST_GAIN,
    LEAST_LIKENESS_OF_HALVES,
    LEAST_THROWS,
    LEAST_VARIETY,
    RIPPLE_LENGTHS,
)

CLEAR_GAIN = 2.0 * LEAST_GAIN
"""Minimum fall of −2 ln likelihood for a clear ripple. Real ones of 2 mm bring hundreds; waves of 1
mm in smoothed tracks bring up to 20."""
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
    ripple : the most likely ripple, of zero; None where none was found
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
    if len(fitted.session) < LEAST_THROWS or varied < LEAST_VARIETY:
        return RippleSearch(outcome="inseparable", variety=varied)
    model = fitted.model.with_terms(*_camera_like_terms(fitted.model))
    session = fitted.session
    _, columns = sensitivities(model, session, fitted.states, fitted.ln_factors)
    least = fitted.linear_in(model, columns, fitted.residuals).least()
    tried: list[tuple[float, Linearisation]] = []
    for length in RIPPLE_LENGTHS:
        linear = _rippled(fitted, model, columns, ripple_over(session.paths, length))
        tried.append((linear.least(), linear))
    clear_from = _seen_from(tried[1][1])
    value, linear = min(tried, key=lambda each: each[0])
    grams, _ = linear.each()
    sized = profile_amplitudes(linear.model, grams.sum(axis=0))[0]
    ripple = sized.ripple
    gain, likeness = least - value, 0.0
    if gain >= CLEAR_GAIN:
        likeness = _likeness(replace(linear, model=sized), squares)
    found = gain >= CLEAR_GAIN and likeness >= LEAST_LIKENESS_OF_HALVES
    return RippleSearch(
        outcome="found" if found else "none",
        variety=varied,
        seen_from=clear_from,
        gain=float(gain),
        likeness=likeness,
        ripple=ripple if found else None,
    )


def _camera_like_terms(model: Model) -> list[Term]:
    """Effects similar to a ripple that the model does not fit, at neutral values."""
    fitted = {term.name for term in model.terms if term.free}
    cards = [card for name, card in catalogue().items() if name in _LIKE_A_CAMERA]
    return [
        Term(card=card, values=neutral_values(card), free=card.first)
        for card in cards
        if card.name not in fitted
    ]


def _rippled(
    fitted: SessionFit, model: Model, columns: Floats, ripple: CameraRipple
) -> Linearisation:
    """Return a fit, linear in the parameters of a model and in those of a ripple.

    Parameters
    ----------
    fitted, model : fit around which all is linear, and the model without the ripple
    columns : (rows, 3, 7 + P) sensitivities of that model, as of `sensitivities`
    """
    at = 7 + model.ripple_slice.start
    added = np.zeros((len(columns), 3, len(ripple)))
    added[:, :2] = ripple.columns(fitted.predicted[:, :2], fitted.predicted[:, State.THETA])
    whole = np.concatenate([columns[:, :, :at], added, columns[:, :, at:]], axis=2)
    return fitted.linear_in(replace(model, ripple=ripple), whole, fitted.residuals)


def _seen_from(linear: Linearisation) -> float:
    """Minimum amplitude of a ripple with an expected clear gain [m]."""
    information = np.maximum(np.linalg.eigvalsh(_information(linear)), 0.0)
    amplitudes = np.geomspace(1e-5, 1.0, 121)
    signal = information[None] * amplitudes[:, None] ** 2
    gain = (signal - np.log1p(signal)).sum(axis=1)
    clear = np.flatnonzero(gain >= CLEAR_GAIN)
    return float(amplitudes[clear[0]]) if len(clear) else np.inf


def _information(linear: Linearisation) -> Floats:
    """Information of the throws on a ripple's coefficients beside all other parameters, (n, n)
    [1/m²].
    """
    model = linear.model
    assert model.ripple is not None
    free = replace(model, ripple=model.ripple.with_amplitude(np.inf))
    whole = replace(linear, model=free).total()
    own = np.arange(len(whole))[model.ripple_slice]
    return projected(whole, own)[:-1, :-1]


def _likeness(linear: Linearisation, squares: Sequence[Floats]) -> float:
    """Correlation of the ripples from two halves of the throws.

    They are compared by their effect on all throws, so that invisible parts have no weight.

    Parameters
    ----------
    linear : the session, linear in the parameters of a model with a ripple
    squares : signed v² along each throw, as of `variety`
    """
    speeds = np.array([float(np.abs(v).max()) for v in squares])
    directions = np.array([float(np.sign(np.median(v))) for v in squares])
    grams, _ = linear.each()
    one, other = (
        minimum_of(grams[half].sum(axis=0) + linear.prior).step[linear.model.ripple_slice]
        for half in split_throws(speeds, directions)
    )
    inner = _information(linear)
    size = float(np.sqrt(max(one @ inner @ one, 0.0) * max(other @ inner @ other, 0.0)))
    return float(one @ inner @ other) / size if size > 0.0 else 0.0


def _signed_squares(fitted: SessionFit) -> tuple[list[Floats], list[Floats]]:
    """For each throw v² along its path, negative towards home [m²/s²], and increasing y [m]."""
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
    """Return the variety of throws at the same places: spread of signed v² over its size.

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
    """Return two halves of the throws, similar in direction and speed.

    Parameters
    ----------
    speeds : (throws,) speeds at the start [m/s]
    directions : (throws,) sign of the travel along the sheet

    Returns
    -------
    numbers of the throws in each half
    """
    order = np.lexsort((speeds, directions)).tolist()
    # In the order 0 1 1 0 ..., so that neither half gets the faster throw of every pair.
    first = [k for place, k in enumerate(order) if place % 4 in (0, 3)]
    return first, [k for place, k in enumerate(order) if place % 4 in (1, 2)]
