"""A throw to which something happened once is set aside; an effect is not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from friction_estimation.discovery import (
    base_model,
    exceptional_throws,
    fit_with_noise,
    open_session,
)

from ..conftest import effect


def found_in(tracks):
    session = open_session(tracks)
    fitted = fit_with_noise(base_model(None, session), session)
    return [int(session.throws[k]) for k in exceptional_throws(fitted, session)]


def touched(track):
    """A track bent to the left from its sixth second on."""
    after = np.maximum(track.t - 6.0, 0.0)[:, None]
    way = track.xy[-1] - track.xy[0]
    across = np.array([-way[1], way[0]]) / np.hypot(*way)
    return replace(track, xy=track.xy + 0.05 * across * after)


@pytest.mark.parametrize(
    ("those", "found"), [([4], [4]), ([2, 9], [2, 9]), ([2, 5, 9], [])], ids=["one", "two", "many"]
)
def test_few_throws_that_were_touched_are_found(make_session, those, found):
    tracks = make_session(throws=14)
    tracks = [touched(track) if k in those else track for k, track in enumerate(tracks)]
    assert found_in(tracks) == found


def test_no_throw_is_an_event_where_nothing_happened(make_session):
    assert found_in(make_session(throws=10)) == []


def test_an_effect_in_every_throw_is_no_event(make_session):
    assert found_in(make_session([effect("slope", x=4e-4, y=0.0)], throws=10)) == []
