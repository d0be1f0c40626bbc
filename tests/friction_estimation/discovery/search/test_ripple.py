"""Conditions under which throws show a ripple of their camera."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from curling_env.physics import catalogue
from friction_estimation.discovery import Term, neutral_values
from friction_estimation.discovery.search import ripple
from friction_estimation.discovery.search.ripple import (
    _camera_like_terms,
    _likeness,
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
