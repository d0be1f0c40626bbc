"""Conditions under which throws show a ripple of their camera."""

from __future__ import annotations

from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from curling_env.physics import catalogue
from friction_estimation.discovery import Term, neutral_values, ripple_over
from friction_estimation.discovery.model.gaussian_field import CameraRipple
from friction_estimation.discovery.model.linearisation import Linearisation, eliminate_factor
from friction_estimation.discovery.model.model import Model
from friction_estimation.discovery.search import ripple
from friction_estimation.discovery.search.ripple import (
    _camera_like_terms,
    _information,
    _likeness,
    _rippled,
    _seen_from,
    _signed_squares,
    find_ripple,
    split_throws,
    variety,
)

from ..conftest import plain_session


def test_variety_is_of_speed_and_direction():
    y = np.linspace(-10.0, 10.0, 50)
    square = np.linspace(4.0, 1.0, 50)
    assert variety([y, y], [square, square]) == pytest.approx(0.0, abs=1e-12)
    assert variety([y, y], [square, -square]) == pytest.approx(1.0)
    assert variety([y, y + 40], [square, 2 * square]) == 0.0  # nowhere do two meet
    assert variety([y, y], [square, 2 * square]) == pytest.approx(0.5 / np.sqrt(2.5))


def test_halves_are_alike(rng):
    speeds, directions = rng.uniform(1.3, 2.4, 16), np.repeat([1.0, -1.0], 8)
    one, other = split_throws(speeds, directions)
    assert sorted(one + other) == list(range(16))
    assert directions[one].sum() == directions[other].sum() == 0.0
    assert abs(speeds[one].mean() - speeds[other].mean()) < 0.15


def test_variety_counts_the_places_that_two_throws_pass():
    """A place that only one of three throws passes is ignored."""
    near, far = np.linspace(0.0, 4.0, 9), np.linspace(2.0, 9.0, 15)
    one, two = np.full(9, 1.0), np.full(15, 3.0)
    assert variety([near, far], [one, two]) == pytest.approx(1.0 / np.sqrt(5.0))
    # Beside two throws alike over the first four metres.
    both = [near, near, far], [one, one, two]
    here = np.arange(0.0, 9.0, 0.5)
    spread = [0.0 if y < 2.0 else 8.0 / 9.0 for y in here if y <= 4.0]
    size = [1.0] * 2 * 4 + [1.0, 1.0, 9.0] * 5
    assert variety(*both) == pytest.approx(np.sqrt(np.mean(spread) / np.mean(size)))


def test_halves_share_out_throws_in_the_order_of_direction_and_speed():
    speeds = np.array([2.0, 1.0, 4.0, 3.0, 1.5, 2.5])
    directions = np.array([1.0, 1.0, 1.0, 1.0, -1.0, -1.0])
    # In order: 4, 5 that come back, then 1, 0, 3, 2.
    assert split_throws(speeds, directions) == ([4, 0, 3], [5, 1, 2])


def test_squares_of_speeds_have_the_sign_of_the_direction():
    predicted = np.zeros((24, 6))
    predicted[:12, 1], predicted[12:, 1] = np.arange(12), -np.arange(12)
    predicted[:12, 2:4], predicted[12:, 2:4] = [0.3, 0.4], [0.0, -2.0]
    predicted[12, 3] = -3.0
    fitted: Any = SimpleNamespace(session=plain_session(), predicted=predicted)
    (away, home), (there, back) = _signed_squares(fitted)
    assert there.tolist() == list(range(12))
    assert back.tolist() == list(range(-11, 1))
    assert away == pytest.approx(np.full(12, 0.25))
    assert home == pytest.approx([*[-4.0] * 11, -9.0])  # the fast row was the first


def test_a_ripple_is_searched_beside_all_effects_that_look_like_one():
    def fitted(*free):
        terms = [
            Term(card=catalogue()[name], values=neutral_values(catalogue()[name]), free=names)
            for name, names in free
        ]
        model: Any = SimpleNamespace(terms=terms)
        return {term.name: term.free for term in _camera_like_terms(model)}

    every = {
        name: catalogue()[name].first for name in ("speed_dependent_friction", "air_drag", "slope")
    }
    assert fitted() == every
    assert fitted(("curl", ("strength",)), ("slope", ())) == every
    assert fitted(("slope", ("x",)), ("air_drag", ("coefficient",))) == {
        "speed_dependent_friction": every["speed_dependent_friction"]
    }


def test_a_ripple_is_clear_from_where_it_gains_twice_what_an_effect_needs(monkeypatch):
    """Expected are s - ln(1 + s) for each coefficient, s the information by the amplitude²."""
    linear: Any = SimpleNamespace()
    for information in ([1e6], [1e6, 1e6, 0.0], [1e4, 3e5]):
        monkeypatch.setattr(ripple, "_information", lambda _, h=information: np.diag(h))
        found = _seen_from(linear)

        def gain(amplitude, h=information):
            s = np.array(h) * amplitude**2
            return float((s - np.log(1.0 + s)).sum())

        assert gain(found) >= 32.0
        assert gain(found / 1.12) < 32.0
    monkeypatch.setattr(ripple, "_information", lambda _: np.diag([1e-3, 0.0]))
    assert _seen_from(linear) == np.inf


@pytest.mark.parametrize(
    ("other", "likeness"),
    [([2.0, 4.0], 1.0), ([-1.0, -2.0], -1.0), ([2.0, -1.0], 0.0), ([0.0, 0.0], 0.0)],
)
def test_ripples_of_two_halves_are_alike_by_what_they_do(monkeypatch, other, likeness):
    """Of four throws, the first and the last of a direction and speed are one half."""
    squares = [np.array([v]) for v in (1.0, 2.0, 3.0, 4.0)]
    ripples = [[1.0, 2.0], other, other, [1.0, 2.0]]
    grams = np.zeros((4, 4, 4))
    for gram, values in zip(grams, ripples, strict=True):
        gram[:3, :3] = np.eye(3)
        gram[1:3, 3] = gram[3, 1:3] = values
        gram[3, 3] = 100.0
    linear: Any = SimpleNamespace(
        each=lambda: (grams, np.zeros(4)),
        prior=np.zeros((4, 4)),
        model=SimpleNamespace(ripple_slice=slice(1, 3)),
    )
    monkeypatch.setattr(ripple, "_information", lambda _: np.eye(2))
    assert _likeness(linear, squares) == pytest.approx(likeness, abs=1e-9)
    # What throws do not see has no weight.
    monkeypatch.setattr(ripple, "_information", lambda _: np.diag([1.0, 0.0]))
    alike = np.sign(other[0])
    assert _likeness(linear, squares) == pytest.approx(alike, abs=1e-9)


@pytest.mark.parametrize(("throws", "ways"), [(7, (1, -1)), (12, (1, 1))])
def test_few_throws_or_throws_all_alike_cannot_show_a_ripple(monkeypatch, throws, ways):
    y = np.linspace(-10.0, 10.0, 20)
    squares = [ways[k % 2] * np.linspace(4.0, 1.0, 20) for k in range(throws)]
    monkeypatch.setattr(ripple, "_signed_squares", lambda _: (squares, [y] * throws))
    fitted: Any = SimpleNamespace(session=range(throws))
    found = find_ripple(fitted)
    assert found.outcome == "inseparable"
    assert found.variety == pytest.approx(0.0 if ways == (1, 1) else 1.0, abs=0.02)
    assert (found.gain, found.likeness, found.seen_from) == (0.0, 0.0, np.inf)
    assert found.ripple is None


@dataclass(frozen=True)
class Tried:
    """A linearisation with a ripple of some length, and the least F with it."""

    model: Any
    value: float

    def least(self) -> float:
        return self.value

    def each(self):
        return np.zeros((1, 2, 2)), np.zeros(1)


@pytest.fixture
def search(monkeypatch):
    """The search among ripples of given least F, from 1000 without one."""

    def run(values, likeness):
        asked = []
        y = np.linspace(-10.0, 10.0, 20)
        way = np.linspace(4.0, 1.0, 20)
        squares = [(-1.0) ** k * way for k in range(12)]
        monkeypatch.setattr(ripple, "_signed_squares", lambda _: (squares, [y] * 12))
        monkeypatch.setattr(ripple, "_camera_like_terms", lambda _: ["term"])
        monkeypatch.setattr(ripple, "sensitivities", lambda *_: (None, "columns"))

        def rippled(_, model, columns, found):
            assert (model, columns) == (("term",), "columns")
            return Tried(SimpleNamespace(ripple=found), values[found.length])

        monkeypatch.setattr(ripple, "_rippled", rippled)
        monkeypatch.setattr(ripple, "_seen_from", lambda linear: linear.model.ripple.length / 100)
        monkeypatch.setattr(ripple, "profile_amplitudes", lambda model, _: (model, 0.0))

        def alike(linear, given):
            asked.append(linear.model.ripple.length)
            assert given is squares
            return likeness

        monkeypatch.setattr(ripple, "_likeness", alike)
        session = plain_session(throws=12)
        fitted: Any = SimpleNamespace(
            session=session,
            model=SimpleNamespace(with_terms=lambda *terms: terms),
            states=None,
            ln_factors=None,
            residuals=None,
            linear_in=lambda *_: SimpleNamespace(least=lambda: 1000.0),
        )
        return find_ripple(fitted), asked

    return run


@pytest.mark.parametrize(
    ("best", "likeness", "outcome"),
    [(967.0, 0.61, "found"), (967.0, 0.59, "none"), (969.0, 0.9, "none"), (967.0, -0.9, "none")],
)
def test_a_ripple_is_found_if_its_gain_is_clear_and_both_halves_show_it(
    search, best, likeness, outcome
):
    """Clear is twice what an effect needs; the usual length decides what would have been seen."""
    found, asked = search({0.8: 990.0, 1.5: 980.0, 3.0: best}, likeness)
    assert found.outcome == outcome
    assert found.gain == pytest.approx(1000.0 - best)
    assert found.seen_from == pytest.approx(0.015)
    assert asked == ([3.0] if best < 968.5 else [])
    assert found.likeness == (likeness if asked else 0.0)
    assert (found.ripple is not None) == (outcome == "found")
    if found.ripple is not None:
        assert found.ripple.length == 3.0
    assert found.variety == pytest.approx(1.0)


def test_a_short_ripple_is_found_as_well(search):
    found, asked = search({0.8: 900.0, 1.5: 980.0, 3.0: 960.0}, 0.9)
    assert asked == [0.8]
    assert found.ripple is not None
    assert found.ripple.length == 0.8


def small_ripple(**given: Any) -> CameraRipple:
    nodes = np.linspace(-6.0, 6.0, 3)
    return CameraRipple(**{"nodes": nodes, "length": 1.5, "values": np.zeros(3), **given})


def test_information_on_a_ripple_is_that_beside_all_else_and_without_its_prior(rng):
    ice: Any = SimpleNamespace()
    model = Model(ice=ice, ripple=small_ripple(), spread=0.02)
    columns = rng.normal(size=(4, 40, 6 + 1 + 5 + 1))
    grams = np.einsum("kni,knj->kij", columns, columns)
    linear = Linearisation(model=model, ln_factors=np.zeros(4), grams=grams)
    whole = eliminate_factor(linear.reduced, np.zeros(4), 0.02)[0].sum(axis=0)
    whole[1, 1] += 0.15**-2
    inner = np.linalg.inv(np.linalg.inv(whole[:5, :5])[2:, 2:])
    assert _information(linear) == pytest.approx(inner)


def test_columns_of_a_ripple_stand_before_those_of_the_terms(rng):
    session = plain_session(throws=2, rows=4)
    card = catalogue()["slope"]
    term = Term(card=card, values={"x": 0.0, "y": 0.0}, free=("x",))
    ice: Any = SimpleNamespace()
    model = Model(ice=ice, terms=(term,))
    predicted = np.zeros((8, 6))
    predicted[:, 1] = np.linspace(-5.0, 5.0, 8)
    columns = rng.normal(size=(8, 3, 7 + 3))
    seen = []

    def linear_in(other, whole, residual):
        seen.append((other, whole, residual))
        return "linear"

    fitted: Any = SimpleNamespace(
        session=session, predicted=predicted, residuals="left", linear_in=linear_in
    )
    wave = small_ripple()
    assert _rippled(fitted, model, columns, wave) == "linear"
    ((other, whole, left),) = seen
    assert other.ripple is wave
    assert left == "left"
    assert whole.shape == (8, 3, 13)
    assert whole[:, :, :9] == pytest.approx(columns[:, :, :9])  # release, factor and globals
    assert whole[:, :, 12] == pytest.approx(columns[:, :, 9])
    assert whole[:, :2, 9:12] == pytest.approx(wave.columns(predicted[:, :2], predicted[:, 4]))
    assert not whole[:, 2, 9:12].any()
    assert len(other.vector) == 6
    assert replace(other, ripple=None).names == model.names
    assert ripple_over([predicted[:, :2]], 0.8).nodes[-1] == 5.0
