"""Held-out throws: which they are, and how far from their forecast they run."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from friction_estimation.discovery import (
    SessionNoise,
    base_model,
    choose_held_out,
    fit_with_noise,
    forecast,
    noise_floor,
    open_session,
)
from friction_estimation.discovery.evidence import hold_out
from friction_estimation.discovery.evidence.hold_out import _gap
from friction_estimation.discovery.model.model import Model

from ..conftest import effect, plain_session


def test_a_quarter_is_held_out_that_is_like_the_rest(make_session, rng):
    session = open_session(make_session(throws=16))
    chosen = choose_held_out(session, rng)
    assert len(chosen) == 4
    assert (np.diff(chosen) > 0).all()
    directions = np.sign(session.first_states[chosen, 3])
    assert abs(directions.sum()) <= 1
    rest = np.setdiff1d(np.arange(16), chosen)
    assert set(session.stones[rest]) == set(session.stones)
    again = choose_held_out(session, np.random.default_rng(3))
    assert again.tolist() == choose_held_out(session, np.random.default_rng(3)).tolist()


def test_some_swept_throws_stay_among_the_others(make_session):
    session = open_session(make_session(throws=16))
    first = choose_held_out(session, np.random.default_rng(3))
    swept = np.isin(session.owner, first).astype(np.float64)
    chosen = choose_held_out(replace(session, swept=swept), np.random.default_rng(3))
    assert len(chosen) == len(first)
    assert set(first) - set(chosen)


def test_few_throws_are_all_needed(make_session, rng):
    assert choose_held_out(open_session(make_session(throws=7)), rng).tolist() == []
    assert len(choose_held_out(open_session(make_session(throws=8)), rng)) == 2


def test_a_true_model_forecasts_to_the_noise_floor_and_a_wrong_one_does_not(make_session):
    session = open_session(make_session(throws=10, scatter=0.0, sigma=0.002))
    fitted = fit_with_noise(base_model(None, session), session)
    gap, floor = forecast(fitted.model, session, fitted.noise), noise_floor(fitted, session)
    assert gap.rest_error < 2 * floor.rest_error < 0.4
    assert gap.path_rms < gap.rest_error
    late = session.times > 4.0  # a forecast begins there
    miss = np.hypot(*(session.xy - gap.predicted).T)
    assert gap.path_rms == pytest.approx(float(np.sqrt((miss[late] ** 2).mean())))
    assert gap.numbers() == {
        "path_rms_m": float(f"{gap.path_rms:.4g}"),
        "rest_error_m": float(f"{gap.rest_error:.4g}"),
    }
    heavier = replace(fitted.model, ln_mu=fitted.model.ln_mu + 0.05)
    worse = forecast(heavier, session, fitted.noise)
    assert worse.rest_error > 3 * gap.rest_error


def test_the_floor_is_what_throws_of_other_friction_miss_by(make_session):
    session = open_session(make_session(throws=12, scatter=0.02, sigma=0.001))
    fitted = fit_with_noise(base_model(None, session), session)
    gap, floor = forecast(fitted.model, session, fitted.noise), noise_floor(fitted, session)
    assert floor.rest_error == pytest.approx(gap.rest_error, rel=0.4)


def test_a_spin_that_was_not_seen_hardly_raises_the_floor(make_session):
    """It is known beforehand to half a turn, and moves the end by less than the friction does."""
    tracks = make_session(throws=8, scatter=0.01)
    blind = [replace(track, theta=np.full(len(track), np.nan)) for track in tracks]
    session = open_session(blind)
    fitted = fit_with_noise(base_model(None, session), session)
    gap, floor = forecast(fitted.model, session, fitted.noise), noise_floor(fitted, session)
    assert floor.rest_error == pytest.approx(gap.rest_error, rel=0.4)


def test_the_floor_rises_with_noise_and_with_the_spread_of_friction(make_session):
    def floor(**options):
        session = open_session(make_session(throws=8, **options))
        return noise_floor(fit_with_noise(base_model(None, session), session), session).rest_error

    quiet = floor(scatter=0.0, sigma=0.001)
    assert floor(scatter=0.0, sigma=0.006) > 2 * quiet
    assert floor(scatter=0.02, sigma=0.001) > 2 * quiet


def test_a_missing_effect_widens_the_gap(make_session):
    session = open_session(make_session([effect("curl", strength=0.01)], throws=8))
    fitted = fit_with_noise(base_model(None, session), session)
    assert forecast(fitted.model, session, fitted.noise).rest_error > 0.3


def test_throws_held_out_resemble_all_and_leave_every_stone_and_some_swept_throws():
    """Of eight throws two: of each direction, spin, half of the speeds and half of the session."""
    speeds = [1.0, 1.1, 1.2, 1.3, 2.0, 2.1, 2.2, 2.3]
    session = plain_session(throws=8, stones=np.array([1, 2, 2, 2, 2, 2, 2, 3]))
    t = session.times
    turned = np.where(session.owner % 4 < 2, 1.0, -1.0) * 1.2 * t
    ways = np.where(session.owner % 2 == 0, 1.0, -1.0)
    y = ways * (-10.0 + np.array(speeds)[session.owner] * t)
    swept = (session.owner == 3).astype(float)
    session = replace(session, xy=np.column_stack([0 * t, y]), theta=turned, swept=swept)
    for seed in range(3):
        chosen = choose_held_out(session, np.random.default_rng(seed)).tolist()
        assert len(chosen) == 2
        assert not set(chosen) & {0, 3, 7}  # the only throws of two stones, and the only swept one
        assert {k % 2 for k in chosen} == {0, 1}
        assert {k % 4 < 2 for k in chosen} == {True, False}
        assert {k < 4 for k in chosen} == {True, False}
    assert len(list(combinations(range(8), 2))) < 300  # all of them are tried


def test_a_gap_is_over_the_rows_after_the_first_seconds_and_at_the_last_ones():
    session = plain_session(throws=2, rows=3)
    squared = np.array([100.0, 1.0, 9.0, 100.0, 4.0, 16.0])
    late = np.array([False, True, True] * 2)
    found = _gap(session, squared, late, session.xy)
    assert found.path_rms == pytest.approx(np.sqrt(30.0 / 4))
    assert found.rest_error == pytest.approx(np.sqrt(25.0 / 2))
    # Throws that ended in their first seconds count with all rows.
    early = _gap(session, squared, np.zeros(6, dtype=bool), session.xy)
    assert early.path_rms == pytest.approx(np.sqrt(230.0 / 6))


def test_the_floor_of_one_throw_is_the_variance_of_a_forecast(monkeypatch, rng):
    """From least squares on the first rows, with the friction of the throw unknown."""
    session = plain_session(throws=2, rows=12, spacing=0.8)
    columns = rng.normal(size=(24, 3, 9)) * np.linspace(1.0, 3.0, 24)[:, None, None]
    noise = SessionNoise(white=(0.004, 0.004, 0.02), fading=(0.0,) * 3, memory=(0.1,) * 3)
    model = SimpleNamespace(spread=0.03)
    whole = SimpleNamespace(predicted=np.zeros((24, 6)), columns=columns)
    monkeypatch.setattr(hold_out, "fit", lambda *_, **__: whole)
    fitted: Any = SimpleNamespace(model=model, noise=noise)
    floor = noise_floor(fitted, session)
    errors = np.array([0.004, 0.004, 0.02])
    late, last = [], []
    for i in range(2):
        rows = session.rows(i)
        own = columns[rows][:, :, :7]
        early = session.times[rows] <= 4.0
        known = (own[early] / errors[:, None]).reshape(-1, 7)
        weak = np.diag(1.0 / np.array([100.0, 100.0, 20.0, 20.0, 1e3, 50.0]))
        release = np.vstack([known[:, :6], weak])
        covariance = np.linalg.inv(release.T @ release)
        taken = np.linalg.lstsq(release, np.append(known[:, 6], np.zeros(6)))[0]
        for k, row in enumerate(own):
            reach, by_friction = row[:2, :6], row[:2, 6] - row[:2, :6] @ taken
            variance = np.trace(reach @ covariance @ reach.T)
            variance += (0.03 * by_friction) @ (0.03 * by_friction) + 2 * 0.004**2
            if not early[k]:
                late.append(variance)
        last.append(late[-1])
    assert floor.path_rms == pytest.approx(np.sqrt(np.mean(late)), rel=1e-6)
    assert floor.rest_error == pytest.approx(np.sqrt(np.mean(last)), rel=1e-6)


def test_a_forecast_begins_with_the_first_seconds_and_knows_no_friction_of_its_throw(monkeypatch):
    """Rows that were not seen along one axis count by the other one alone."""
    session = plain_session(throws=2, rows=12, spacing=0.8)
    xy = session.xy.copy()
    xy[8, 0] = np.nan
    session = replace(session, xy=xy)
    asked = []

    def fitted(model, short, noise, *, shared):
        asked.append((model.spread, short.times.max(), len(short.times), noise, shared))
        return SimpleNamespace(states="states")

    def predicted(model, given, states, ln_factors):
        assert given is session
        assert states == "states"
        assert ln_factors.tolist() == [0.0, 0.0]
        return np.column_stack([np.nan_to_num(xy) + np.array([0.3, 0.4]), np.zeros((24, 4))])

    monkeypatch.setattr(hold_out, "fit", fitted)
    monkeypatch.setattr(hold_out, "predict", predicted)
    ice: Any = SimpleNamespace()
    noise: Any = "noise"
    found = forecast(Model(ice=ice, spread=0.02), session, noise)
    assert asked == [(0.0, 4.0, 12, "noise", False)]
    late = 2 * 6  # from 4.8 s on
    assert found.path_rms == pytest.approx(np.sqrt(((late - 1) * 0.25 + 0.16) / late))
    assert found.rest_error == pytest.approx(0.5)
    assert found.predicted.shape == (24, 2)
