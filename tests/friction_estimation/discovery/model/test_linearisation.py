"""The one linearisation of a session: what it says at a fit."""

from __future__ import annotations

import numpy as np
import pytest

from friction_estimation.discovery import (
    base_model,
    candidates,
    fit_with_noise,
    open_session,
)

from ..conftest import effect


@pytest.fixture
def fitted(make_session):
    session = open_session(make_session([effect("curl", strength=0.006)], throws=8, scatter=0.01))
    model = base_model(None, session)
    (curl,) = [term for term in candidates(session) if term.label == "curl"]
    return fit_with_noise(model.with_terms(curl), session)


def test_at_a_fit_nothing_is_left_to_gain(fitted):
    assert fitted.linear.least() == pytest.approx(fitted.deviance, abs=0.2)
    step = np.linalg.solve(fitted.linear.total()[:-1, :-1], fitted.linear.total()[:-1, -1])
    sigma = np.sqrt(np.diag(np.linalg.inv(fitted.linear.total()[:-1, :-1])))
    assert (np.abs(step) < 0.2 * sigma).all()


def test_columns_whitened_again_are_the_same(fitted):
    again = fitted.linear_in(fitted.model, fitted.columns, fitted.residuals)
    scale = np.sqrt(np.einsum("kii->ki", fitted.linear.reduced)).max(axis=0)
    difference = (again.reduced - fitted.linear.reduced) / np.outer(scale, scale)
    assert np.abs(difference).max() < 1e-3
