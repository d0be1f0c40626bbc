"""A standard error is the half-width of 95 % of the mixture over all spreads, over 1.96."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.stats import norm

from friction_estimation.discovery import (
    candidates,
    common_errors,
    ice_of,
    mixture,
    refit,
    standard_errors,
)
from friction_estimation.discovery.evidence import intervals
from friction_estimation.discovery.evidence.intervals import (
    Mixture,
    _half_widths,
    map_errors,
    with_sides,
)
from friction_estimation.discovery.search.patches import SideScan

from ..conftest import effect


def test_the_interval_of_a_parameter_holds_95_per_cent_of_its_mixture(fitted_to):
    fitted = fitted_to(throws=8, scatter=0.01)
    found, sigma = mixture(fitted), standard_errors(fitted)
    assert (found.weights > 0.02).sum() > 3  # of several spreads, so that it is no Gaussian
    for k, name in enumerate(fitted.model.names):
        half = norm.ppf(0.975) * sigma[name]
        step, deviation = found.steps[:, k], np.sqrt(found.covariances[:, k, k])
        inside = norm.cdf((half - step) / deviation) - norm.cdf((-half - step) / deviation)
        assert float(found.weights @ inside) == pytest.approx(0.95, abs=1e-6), name


def test_an_ice_file_keeps_how_the_errors_of_effects_and_friction_go_together(fitted_to):
    bare = fitted_to(effect("speed_dependent_friction", exponent=0.15), throws=8)
    terms = {term.label: term for term in candidates(bare.session)}
    names = ("speed_dependent_friction", "air_drag", "tracking_offset")
    fitted = refit(bare, bare.model.with_terms(*(terms[name] for name in names)))
    level, common = common_errors(fitted)
    found = mixture(fitted)
    covariance = np.einsum("s,sij->ij", found.weights, found.covariances)
    covariance += np.einsum("s,si,sj->ij", found.weights, found.steps, found.steps)
    own = [fitted.model.names.index(name) for name in common]
    places = [*own, fitted.model.names.index(("", "ln_mu"))]
    deviations = np.sqrt(np.diag(covariance)[places])
    expected = covariance[np.ix_(places, places)] / np.outer(deviations, deviations)
    rows = np.zeros((len(places), len(places)))
    for row, parts in zip(rows, [*common.values(), level.common], strict=True):
        row[: len(parts)] = parts
    rows[-1, -1] = np.sqrt(1.0 - rows[-1] @ rows[-1])
    assert rows @ rows.T == pytest.approx(expected, abs=1e-4)
    assert abs(expected[0, 1]) > 0.5  # the throws know a sum of the two better than each
    assert level.sigma == pytest.approx(deviations[-1])
    # A camera's error moves no stone.
    assert all(label != "tracking_offset" for label, _ in common)
    ice = ice_of(fitted)
    assert ice.friction.level == level
    assert ice.effect("air_drag").common == {"coefficient": common["air_drag", "coefficient"]}
    assert not ice.effect("tracking_offset").common


def test_the_error_of_a_gaussian_is_its_deviation_and_of_two_it_holds_their_95_per_cent():
    one = np.ones((1, 3))
    sigma = _half_widths(np.ones(1), 0.0 * one, np.array([[2.0, 1e-4, 1e6]]))
    assert sigma == pytest.approx([2.0, 1e-4, 1e6], rel=1e-9)
    # An offset counts as error: 95 % of a normal distribution that is off by three deviations.
    (shifted,) = _half_widths(np.ones(1), np.array([[3.0]]), np.array([[1.0]]))
    assert norm.cdf(norm.ppf(0.975) * shifted, 3.0) == pytest.approx(0.95, abs=1e-6)
    weights, deviations = np.array([0.9, 0.1]), np.array([[1.0], [30.0]])
    (wide,) = _half_widths(weights, np.zeros((2, 1)), deviations) * norm.ppf(0.975)
    inside = weights @ (2.0 * norm.cdf(wide / deviations[:, 0]) - 1.0)
    assert inside == pytest.approx(0.95, abs=1e-9)


def test_the_covariance_of_a_mixture_is_that_of_its_draws(rng):
    roots = rng.normal(size=(2, 2, 2))
    found = Mixture(
        spreads=np.array([0.01, 0.02]),
        weights=np.array([0.25, 0.75]),
        steps=np.array([[1.0, 0.0], [0.0, -2.0]]),
        covariances=roots @ np.swapaxes(roots, 1, 2),
    )
    which = rng.choice(2, size=200_000, p=found.weights)
    noise = np.einsum("nij,nj->ni", roots[which], rng.normal(size=(len(which), 2)))
    draws = found.steps[which] + noise
    assert found.covariance == pytest.approx(draws.T @ draws / len(draws), rel=0.05, abs=0.05)


def test_the_error_of_a_side_is_that_of_all_places_that_fit(monkeypatch):
    """Three places of equal likelihood, half a metre apart, and one that is excluded."""
    names = [("", "ln_mu"), ("patch", "factor"), ("curl", "strength")]
    steps = np.array([[9.0, 0.3, 9.0], [9.0, 0.0, 9.0], [9.0, -0.3, 9.0], [9.0, 9.0, 9.0]])
    scan = SideScan(np.array([-0.5, 0.0, 0.5, 1.0]), np.array([7.0, 7.0, 7.0, 900.0]), steps)
    monkeypatch.setattr(intervals, "sides_along", lambda _: [("patch", "x_min")])
    monkeypatch.setattr(intervals, "scan_side", lambda *_: scan)
    fitted: Any = SimpleNamespace(model=SimpleNamespace(names=names))
    sigma = {names[0]: 0.1, names[1]: 0.4, names[2]: 0.2}
    found = with_sides(fitted, sigma)
    assert found["patch", "x_min"] == pytest.approx(np.sqrt(0.5 / 3))
    assert found["patch", "factor"] == pytest.approx(np.sqrt(0.16 + 0.18 / 3))
    assert found["", "ln_mu"] == 0.1
    assert found["curl", "strength"] == 0.2
    assert len(sigma) == 3  # what was given stays as it was
    # One place alone is known to the distance between the tried ones.
    sharp = scan._replace(deviances=np.array([900.0, 7.0, 900.0, 900.0]))
    monkeypatch.setattr(intervals, "scan_side", lambda *_: sharp)
    assert with_sides(fitted, sigma)["patch", "x_min"] == pytest.approx(0.05)


def test_the_error_of_a_cell_has_the_level_the_patterns_and_what_they_omit(monkeypatch):
    patterns = np.array([[1.0, 0.0], [0.5, 2.0], [0.0, 0.0], [3.0, 1.0]])
    field = SimpleNamespace(
        patterns=patterns, amplitude=0.1, sheet=SimpleNamespace(shape=(2, 2)),
        unresolved=lambda: np.array([0.0, 0.5, 1.0, 0.0]),
    )  # fmt: skip
    root = np.random.default_rng(1).normal(size=(4, 4))
    covariance = root @ root.T
    monkeypatch.setattr(intervals, "mixture", lambda _: SimpleNamespace(covariance=covariance))
    model = SimpleNamespace(map_field=field, map_slice=slice(2, 4))
    fitted: Any = SimpleNamespace(model=model)
    found = map_errors(fitted)
    assert found is not None
    for cell, sigma in enumerate(found.ravel()):
        way = np.array([1.0, 0.0, *patterns[cell]])  # the coupling is no friction
        expected = way @ covariance @ way + 0.01 * field.unresolved()[cell]
        assert sigma == pytest.approx(np.sqrt(expected))
    model.map_field = None
    assert map_errors(fitted) is None


def test_the_level_of_a_map_is_its_mean_where_stones_ran(monkeypatch):
    """Errors that rounding has lost are in no combination of others."""
    patterns = np.array([[1.0, 0.0], [3.0, 2.0], [9.0, 9.0]])
    field = SimpleNamespace(patterns=patterns, crossed=np.array([0, 1]))
    names = [("", "ln_mu"), ("", "ln_coupling"), ("", "map_0"), ("", "map_1"),
             ("curl", "strength"), ("lens", "k1"), ("slope", "x")]  # fmt: skip
    cards = {"curl": True, "lens": False, "slope": True}
    model: Any = SimpleNamespace(
        names=names, map_field=field, map_slice=slice(2, 4),
        term=lambda label: SimpleNamespace(card=SimpleNamespace(is_physical=cards[label])),
    )  # fmt: skip
    root = np.random.default_rng(1).normal(size=(7, 7))
    root[6] = 0.0
    covariance = root @ root.T
    monkeypatch.setattr(intervals, "mixture", lambda _: SimpleNamespace(covariance=covariance))
    fitted: Any = SimpleNamespace(model=model)
    level, common = common_errors(fitted)
    assert list(common) == [("curl", "strength"), ("slope", "x")]
    to_level = np.array([1.0, 0.0, 2.0, 1.0, 0.0, 0.0, 0.0])
    variance = to_level @ covariance @ to_level
    assert level.sigma == pytest.approx(np.sqrt(variance))
    correlation = to_level @ covariance[:, 4] / np.sqrt(variance * covariance[4, 4])
    assert level.common == pytest.approx((correlation, 0.0), abs=1e-6)
    assert common["curl", "strength"] == (1.0,)
    assert common["slope", "x"] == pytest.approx((0.0, 1.0), abs=1e-6)
