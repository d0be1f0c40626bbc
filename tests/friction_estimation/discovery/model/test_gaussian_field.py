"""A displacement along the sheet that all throws share."""

from __future__ import annotations

import numpy as np
import pytest

from friction_estimation.discovery import ripple_over


@pytest.fixture
def places() -> list[np.ndarray]:
    y = np.linspace(-15.0, 20.0, 300)
    return [np.column_stack([0.1 * y, y]), np.column_stack([0 * y, y[::-1]])]


def test_what_no_throw_can_tell_is_left_out(places):
    ripple = ripple_over(places, 1.5)
    for even in (np.ones_like(ripple.nodes), ripple.nodes / 10.0):
        assert np.abs(ripple.root.T @ even).max() < 1e-6
    assert np.sqrt(np.mean((ripple.root**2).sum(axis=1))) == pytest.approx(1.0, abs=0.15)


def test_it_displaces_along_the_sheet_by_place_alone(places, rng):
    ripple = ripple_over(places, 1.5)
    ripple = ripple.at(0.004 * rng.normal(size=len(ripple)))
    there, back = (ripple.displacement(xy, np.zeros(len(xy))) for xy in places)
    assert np.allclose(there, back[::-1], atol=1e-12)
    assert np.all(there[:, 0] == 0)
    columns = ripple.columns(places[0], np.ones(300))
    assert np.allclose(columns @ ripple.values, there, atol=1e-12)


def test_between_nodes_it_follows_waves_of_two_metres(places):
    ripple = ripple_over(places, 0.8)
    wave = np.sin(2 * np.pi * ripple.nodes / 2.5)
    fitted = ripple.at(np.linalg.lstsq(ripple.root, wave, rcond=1e-9)[0])
    y = np.linspace(-10.0, 15.0, 400)
    shown = fitted.displacement(np.column_stack([0 * y, y]), 0 * y)[:, 1]
    assert np.sqrt(np.mean((shown - np.sin(2 * np.pi * y / 2.5)) ** 2)) < 0.1


def test_beyond_the_last_node_it_stays(places, rng):
    ripple = ripple_over(places, 1.5)
    ripple = ripple.at(rng.normal(size=len(ripple)))
    ends = ripple.displacement(np.array([[0.0, 20.0], [0.5, 25.0]]), np.zeros(2))
    assert ends[0, 1] == ends[1, 1]


def test_a_larger_amplitude_is_less_likely_beforehand(places):
    ripple = ripple_over(places, 1.5)
    priors = [ripple.with_amplitude(a).hyperprior for a in (0.001, 0.003, 0.02)]
    assert np.all(np.diff(priors) > 0)
