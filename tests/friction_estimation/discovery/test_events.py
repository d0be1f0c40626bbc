"""A throw to which something happened once is set aside; an effect is not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from friction_estimation.discovery import (
    base_model,
    exceptional_throws,
    fit_with_noise,
    open_session,
)

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
