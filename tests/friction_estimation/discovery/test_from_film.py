"""Tracks from films: their errors last for seconds and belong to places.

`films/wrong_lens.csv` is a session of `scripts/blind/filmed.py` (`curl-gantry-1`): twelve throws
with a hidden curl, filmed from above and tracked with a scene that knows half of the lens's
distortion; every second row, of which the test uses every fourth.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from curling_env.trajectory import read_tracks
from friction_estimation import discover, load_scene
from friction_estimation.discovery import (
    base_model,
    document,
    estimate_noise,
    open_session,
    sentence,
    standard_errors,
)
from friction_estimation.synthetic import named_camera

from .conftest import effect

FILMS = Path(__file__).parent / "films"
CURL = effect("curl", strength=0.005, speed_exponent=0.2)
OF_ROWS = ("t", "xy", "theta", "sigma_xy", "sigma_theta", "swept")


def test_what_lasts_for_seconds_is_learnt_as_noise(make_session, as_filmed):
    session = open_session(as_filmed(make_session(sigma=0.0), 1))
    assert session.smoothed
    rng = np.random.default_rng(2)
    residual = np.zeros((len(session.times), 3))
    for i in range(len(session)):
        rows = session.rows(i)
        t = session.times[rows]
        for channel, size in enumerate((0.0005, 0.0015, 0.03)):
            phase, number = rng.uniform(0, 2 * np.pi, 24), np.pi / rng.uniform(0.75, 6.0, 24)
            residual[rows, channel] = size / 12**0.5 * np.cos(t[:, None] * number + phase).sum(1)
    noise = estimate_noise(session, residual)
    ratio = noise.total / [0.0005, 0.0015, 0.03]  # carried on to what is slower, on the safe side
    assert (ratio > 0.7).all()
    assert (ratio < 2.0).all()
    assert min(noise.memory) > 0.3


def test_raw_tracks_are_not_taken_for_a_films(make_session):
    session = open_session(make_session())
    assert not session.smoothed
    assert base_model(None, session).systematic_error is None


def test_a_hidden_curl_is_named_alone_and_its_intervals_are_true(make_session, as_filmed):
    found = discover(as_filmed(make_session([CURL], throws=8, sigma=0.0), 11))
    assert [effect.label for effect in found.effects] == ["curl"]
    assert not found.unknown
    sigma = standard_errors(found.final)["curl", "strength"]
    error = found.final.model.term("curl").values["strength"] - CURL.parameters["strength"]
    # Errors of the film leave a thousandth of the curl unsure, not a ten-thousandth.
    assert abs(error) < 3 * sigma
    assert 1e-6 < sigma < 5e-5
    # Where nothing is missing the floor is where the forecast is.
    assert found.gaps["after"].rest_error < 2 * found.gaps["noise_floor"].rest_error


def test_nothing_hidden_nothing_named(make_session, as_filmed):
    found = discover(as_filmed(make_session(throws=8, sigma=0.0, seed=3), 13))
    assert document(found)["effects"] == []
    assert sentence(found).startswith("Nothing is missing")


def test_a_wrong_lens_is_named_as_the_lens_in_tracks_from_film():
    scene = load_scene(FILMS / "wrong_lens.scene.json")
    tracks = [
        replace(track, **{name: getattr(track, name)[::4] for name in OF_ROWS})
        for track in read_tracks(FILMS / "wrong_lens.csv")
    ]
    found = discover(tracks, scene=scene)
    assert sorted(effect.label for effect in found.effects) == ["curl", "lens_distortion"]
    assert not found.unknown
    missing = 0.5 * named_camera("gantry", (1280, 720)).lens.distortion
    values = found.final.model.term("lens_distortion").values
    assert values["lens_k1"] == pytest.approx(missing[0], rel=0.05)
    assert values["lens_k2"] == pytest.approx(missing[1], rel=0.15)
    assert found.final.model.term("curl").values["strength"] == pytest.approx(0.0097379, rel=0.01)
