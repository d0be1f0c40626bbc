"""A standard error is the half-width of 95 % of the mixture over all spreads, over 1.96."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import norm

from friction_estimation.discovery import ice_of, mixture
from friction_estimation.discovery.evidence.intervals import _half_widths, common_errors
from friction_estimation.discovery.model.candidates import candidates
from friction_estimation.discovery.search.selection import refit

from ..conftest import effect


def test_one_gaussian_has_its_own_standard_deviation():
    widths = _half_widths(np.ones(1), np.zeros((1, 2)), np.array([[0.3, 2.0]]))
    assert widths == pytest.approx([0.3, 2.0], rel=1e-9)


def test_a_mixture_holds_95_per_cent():
    weights = np.array([0.5, 0.3, 0.2])
    steps, deviations = np.array([[0.0], [0.4], [-1.0]]), np.array([[0.5], [1.0], [0.2]])
    half = 1.959964 * _half_widths(weights, steps, deviations)[0]
    inside = norm.cdf((half - steps) / deviations) - norm.cdf((-half - steps) / deviations)
    assert float(weights @ inside[:, 0]) == pytest.approx(0.95, abs=1e-6)


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
