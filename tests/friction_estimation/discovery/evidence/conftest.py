"""Fits to sessions: of uniform friction, and of the model with curl on ice that curls."""

from __future__ import annotations

import pytest

from friction_estimation.discovery import base_model, candidates, fit_with_noise, open_session

from ..conftest import effect


@pytest.fixture
def fitted_to(make_session):
    """Fits of uniform friction to sessions with effects: options as of `make_session`."""

    def make(*effects, **options):
        session = open_session(make_session(effects, **options))
        return fit_with_noise(base_model(None, session), session)

    return make


@pytest.fixture
def curl_fit(make_session):
    """Fits of a model with curl to sessions on ice that curls: options as of `make_session`."""

    def make(**options):
        session = open_session(make_session([effect("curl", strength=0.006)], **options))
        model = base_model(None, session)
        curl = next(t for t in candidates(session, model.terms) if t.label == "curl")
        return fit_with_noise(model.with_terms(curl), session)

    return make
