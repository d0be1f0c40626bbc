"""A standard error is the half-width of 95 % of the mixture over all spreads, over 1.96."""

from __future__ import annotations

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
