"""A throw to which something happened once is set aside; an effect is not."""

from __future__ import annotations

from dataclasses import replace
from importlib import import_module
from types import SimpleNamespace

import numpy as np
import pytest

from friction_estimation.discovery import (
    base_model,
    exceptional_throws,
    fit_with_noise,
    misfit_of,
    open_session,
)
from friction_estimation.discovery.discover import Discovery, search_session

from .conftest import effect


def found_in(tracks):
    session = open_session(tracks)
    fitted = fit_with_noise(base_model(None, session), session)
    return [int(session.throws[k]) for k in exceptional_throws(fitted, session)]


def test_a_throw_that_was_touched_is_found(make_session):
    tracks = make_session(throws=12)
    touched = tracks[4]
    after = np.maximum(touched.t - 6.0, 0.0)[:, None]
    way = touched.xy[-1] - touched.xy[0]
    across = np.array([-way[1], way[0]]) / np.hypot(*way)
    tracks[4] = replace(touched, xy=touched.xy + 0.05 * across * after)
    assert found_in(tracks) == [4]


def test_no_throw_is_an_event_where_nothing_happened(make_session):
    assert found_in(make_session(throws=10)) == []


def test_an_effect_in_every_throw_is_no_event(make_session):
    assert found_in(make_session([effect("slope", x=4e-4, y=0.0)], throws=10)) == []


@pytest.mark.parametrize(("calm", "odd"), [(True, True), (True, False), (False, True)])
def test_an_event_is_reported_if_the_others_are_explained_and_it_is_not(
    make_session, monkeypatch, calm, odd
):
    session = open_session(make_session(throws=9, fps=5))
    fitted = fit_with_noise(base_model(None, session), session)
    module = import_module("friction_estimation.discovery.discover")

    def searched(everything, *_):
        selection = SimpleNamespace(best=everything)
        return Discovery(
            fit=everything,
            after=misfit_of(everything),
            session=everything.session,
            selection=selection,
            final_base=everything,
            seen=everything,
            final=everything,
        )

    def misfit(fitted):
        one = len(fitted.session) == 1
        return SimpleNamespace(white=calm, surprise=np.full(1, 9.0 if odd and one else 1.0))

    monkeypatch.setattr(module, "_search", searched)
    monkeypatch.setattr(module, "exceptional_throws", lambda *_: np.array([4]))
    monkeypatch.setattr(module, "misfit_of", misfit)
    found = search_session(fitted, np.random.default_rng(0))
    assert found.events == ([4] if calm and odd else [])
    assert len(found.session) == (8 if calm and odd else 9)
