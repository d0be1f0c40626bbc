from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from friction_estimation.discovery import (
    SessionNoise,
    estimate_noise,
    open_session,
    whiten_throw,
    without_outliers,
)
from friction_estimation.discovery.model import noise as noises
from friction_estimation.discovery.model.noise import Series, _rough_size, most_likely_noise
from friction_estimation.discovery.model.whitening import restricted_square, whiten_series

from ..conftest import plain_session


def coloured(t, sigma, memory, rng):
    out = rng.normal(size=len(t))
    for i in range(1, len(t)):
        keep = np.exp(-(t[i] - t[i - 1]) / memory)
        out[i] = keep * out[i - 1] + np.sqrt(1 - keep**2) * out[i]
    return sigma * out


def residuals_of(session, sigma, memory, rng):
    residual = np.empty((len(session.times), 3))
    for i in range(len(session)):
        rows = session.rows(i)
        for channel in range(3):
            residual[rows, channel] = coloured(session.times[rows], sigma, memory, rng)
    return residual


def test_size_and_memory_are_found(make_session, rng):
    session = open_session(make_session())
    noise = estimate_noise(session, residuals_of(session, 0.005, 0.25, rng))
    assert abs(noise.total[0] / 0.005 - 1) < 0.1
    assert 0.15 < noise.memory[0] < 0.4


def test_a_slow_misfit_is_not_taken_for_noise(make_session, rng):
    session = open_session(make_session())
    residual = rng.normal(0, 0.005, (len(session.times), 3))
    residual[:, 0] += 0.3 * np.sin(session.times / 4)
    assert abs(estimate_noise(session, residual).total[0] / 0.005 - 1) < 0.1


def test_whitened_noise_is_white_and_of_unit_size(make_session, rng):
    session = open_session(make_session())
    residual = residuals_of(session, 0.005, 0.3, rng)
    noise = SessionNoise(
        white=(1e-6, 1e-6, 1e-6), fading=(0.005, 0.005, 0.005), memory=(0.3, 0.3, 0.3)
    )
    work = residual[:, :, None].copy()
    for rows in map(session.rows, range(len(session))):
        own = session.times[rows], session.sigma[rows]
        whiten_throw(work[rows], *own, noise.table(), np.empty(1))
    white = work[session.rows(0), 0, 0]
    assert abs(work.std() - 1) < 0.03
    assert abs(np.corrcoef(white[1:], white[:-1])[0, 1]) < 0.15


def test_innovations_have_the_density_of_the_noise(rng):
    """At uneven times, with lost headings: that of a Gaussian with its covariance written out."""
    noise = SessionNoise(white=(2e-3, 3e-3, 0.01), fading=(4e-3, 0.0, 0.03), memory=(0.3, 0.1, 1.5))
    n = 12
    t, sigma = np.cumsum(rng.uniform(0.02, 0.4, n)), rng.uniform(0.5, 2.0, (n, 2))
    columns = rng.normal(0, 5e-3, (n, 3, 2))
    columns[[0, 5, 6], 2, -1] = np.nan
    expected, log_variance = np.zeros((2, 2)), 0.0
    for channel in range(3):
        seen = np.isfinite(columns[:, channel, -1])
        at, own = t[seen], sigma[seen, channel // 2]
        covariance = np.exp(-np.abs(at[:, None] - at) / noise.memory[channel])
        covariance *= noise.fading[channel] ** 2
        covariance += noise.white[channel] ** 2 * np.eye(len(at))
        covariance *= np.outer(own, own)
        values = columns[seen, channel]
        expected += values.T @ np.linalg.solve(covariance, values)
        log_variance += np.linalg.slogdet(covariance)[1]
    work = columns.copy()
    assert whiten_throw(work, t, sigma, noise.table(), np.empty(2)) == pytest.approx(log_variance)
    assert not work[[0, 5, 6], 2].any()
    flat = work.reshape(-1, 2)
    assert flat.T @ flat == pytest.approx(expected)
    assert noise.total == pytest.approx(np.sqrt([20e-6, 9e-6, 1e-3]))


def test_what_may_be_no_noise_is_projected_out(rng):
    curves, values = rng.normal(size=(20, 3)), rng.normal(size=20)
    whole = np.column_stack([curves, values])
    left = values - curves @ np.linalg.lstsq(curves, values)[0]
    log_determinant = np.linalg.slogdet(curves.T @ curves)[1]
    found = restricted_square(whole.T @ whole)
    assert found == pytest.approx(left @ left + log_determinant, rel=1e-6)


def test_rows_off_by_centimetres_leave_and_others_stay(make_session, rng):
    track = make_session()[3]
    wild = rng.choice(np.arange(5, len(track) - 5), 4, replace=False)
    track.xy[wild] += 0.05
    cleaned = without_outliers(track)
    assert not np.isin(track.t[wild], cleaned.t).any()
    assert len(cleaned) > 0.97 * len(track)


def test_rows_a_second_apart_show_their_noise(make_session, rng):
    tracks = [
        replace(t, t=t.t[::15], xy=t.xy[::15], theta=t.theta[::15], swept=t.swept[::15])
        for t in make_session()
    ]
    session = open_session(tracks)
    assert np.diff(session.starts).max() < 40
    residual = rng.normal(0, (0.005, 0.005, 0.03), (len(session.times), 3))
    noise = estimate_noise(session, residual)
    assert np.allclose(noise.total / (0.005, 0.005, 0.03), 1, atol=0.2)


def test_few_rows_of_a_film_err_by_what_they_claim(make_session, rng):
    """A ceiling camera sees six seconds of a throw: eighteen rows that differ."""
    smooth = [
        replace(
            track,
            t=track.t[-90:],
            xy=track.xy[-90:],
            theta=track.theta[-90:],
            swept=track.swept[-90:],
            sigma_xy=np.full(90, 0.05),
            sigma_theta=np.full(90, 0.1),
        )
        for track in make_session(throws=4)
    ]
    session = open_session(smooth)
    assert session.smoothed
    noise = estimate_noise(session, rng.normal(0, 1e-3, (len(session.times), 3)))
    assert (noise.total >= (0.05, 0.05, 0.1)).all()


# --- the likelihood of a noise -------------------------------------------------------------------


def a_series(rng, *, white, slow, memory, rows=400):
    t = 0.05 * np.arange(rows)
    values = coloured(t, slow, memory, rng) + rng.normal(0.0, white, rows)
    sigma = np.where(np.arange(rows) % 3 == 0, 2.0, 0.5)
    return Series(t, sigma, np.column_stack([np.ones(rows), t, sigma * values]))


def restricted_deviance(series, white, slow, memory):
    """−2 ln of the density of what columns leave open, with the covariance written out."""
    t, sigma, columns = series
    covariance = slow**2 * np.exp(-np.abs(t[:, None] - t) / memory) + white**2 * np.eye(len(t))
    covariance *= np.outer(sigma, sigma)
    whole = columns.T @ np.linalg.solve(covariance, columns)
    inner, cross = whole[:-1, :-1], whole[:-1, -1]
    left = whole[-1, -1] - cross @ np.linalg.solve(inner, cross)
    return left + np.linalg.slogdet(inner)[1] + np.linalg.slogdet(covariance)[1]


def test_no_noise_nearby_is_clearly_more_likely(rng):
    series = a_series(rng, white=0.002, slow=0.003, memory=0.3, rows=250)
    found = most_likely_noise([series], 0.004, memory=(0.05, 0.7))
    least = restricted_deviance(series, *found)
    for k in range(3):
        for factor in (0.6, 0.8, 1.25, 1.6):
            other = list(found)
            other[k] *= factor
            if k < 2 or 0.05 <= other[2] <= 0.7:
                assert restricted_deviance(series, *other) > least - 0.5
    assert restricted_deviance(series, 0.002, 0.003, 0.3) > least - 0.5
    # From near there fewer steps lead to the same.
    again = most_likely_noise([series], 1.0, memory=(0.05, 0.7), before=(0.0025, 0.0025, 0.35))
    assert restricted_deviance(series, *again) < least + 1.0
    both = most_likely_noise([series, series], 0.004, memory=(0.05, 0.7))
    assert 2 * restricted_deviance(series, *both) < 2 * least + 1.0


def test_noise_without_a_memory_has_none(rng):
    found = [
        most_likely_noise(
            [a_series(rng, white=0.003, slow=0.0, memory=0.3)], 0.01, memory=(0.05, 0.7)
        )
        for _ in range(3)
    ]
    for white, slow, _ in found:
        assert np.hypot(white, slow) == pytest.approx(0.003, rel=0.15)
        assert slow == 0.0 or slow > 0.05 * white
    slow_alone = a_series(rng, white=0.0, slow=0.003, memory=0.3)
    white, slow, memory = most_likely_noise([slow_alone], 0.01, memory=(0.05, 0.7))
    assert white < 0.3 * slow
    assert 0.1 < memory <= 0.7


def test_a_rough_size_is_of_the_fast_part_or_else_of_what_columns_leave():
    fast = np.array([[0.1, np.nan], [-0.3, np.nan], [0.2, np.nan]])
    assert _rough_size(fast, []) == pytest.approx(1.4826 * 0.2)
    rng = np.random.default_rng(2)
    series = [a_series(rng, white=w, slow=0.0, memory=0.1) for w in (0.01, 0.02, 0.04)]
    sizes = []
    for _, _, columns in series:
        rest = columns[:, 2] - columns[:, :2] @ np.linalg.lstsq(columns[:, :2], columns[:, 2])[0]
        sizes.append(np.sqrt(rest @ rest / (len(rest) - 2)))
    assert _rough_size(np.full((3, 1), np.nan), series) == pytest.approx(np.median(sizes))


def test_lost_rows_are_bridged_and_count_nothing(rng):
    """Also the first ones, before the filter has begun."""
    t, sigma = 0.1 * np.arange(20), np.full(20, 1.5)
    columns = rng.normal(size=(20, 2))
    columns[[0, 7, 8, 19], 1] = np.nan
    seen = np.isfinite(columns[:, 1])
    whole, part = columns.copy(), np.ascontiguousarray(columns[seen])
    value = whiten_series(whole, t, sigma, 0.3, 0.7, 0.4, np.empty(2))
    alone = whiten_series(part, t[seen], sigma[seen], 0.3, 0.7, 0.4, np.empty(2))
    assert value == pytest.approx(alone)
    assert whole[seen] == pytest.approx(part)
    assert not whole[~seen].any()


@pytest.fixture
def asked(monkeypatch):
    """Throws and channels of which a noise was asked for, which is then their number."""
    calls = []

    def channel(session, residuals, fast, chosen, channels, before, slow):
        calls.append((chosen.tolist(), channels, before, slow))
        return tuple(float(10 * k + channels[0]) for k in (1, 2, 3))

    monkeypatch.setattr(noises, "_estimate_channel", channel)
    return calls


def test_raw_tracks_err_alike_in_both_coordinates_and_films_do_not(asked):
    raw = plain_session(throws=3)
    residuals = np.zeros((len(raw.times), 3))
    found = estimate_noise(raw, residuals)
    assert [call[1] for call in asked] == [(0, 1), (2,)]
    assert found.white == (10.0, 10.0, 12.0)
    assert found.fading == (20.0, 20.0, 22.0)
    assert found.memory == (30.0, 30.0, 32.0)
    asked.clear()
    film = plain_session(throws=3, claimed=0.01)
    assert estimate_noise(film, residuals).white == (10.0, 11.0, 12.0)
    assert [call[1] for call in asked] == [(0,), (1,), (2,)]
    assert all(slow for *_, slow in asked)


def test_a_noise_is_estimated_from_throws_spread_over_the_session(asked):
    session = plain_session(throws=31, rows=2)
    residuals = np.zeros((62, 3))
    estimate_noise(session, residuals, throws=4)
    assert asked[0][0] == [0, 10, 20, 30]
    assert asked[0][2:] == (None, False)
    estimate_noise(session.only([0, 1, 2]), residuals[:6], throws=4)
    assert asked[-1][0] == [0, 1, 2]
    short = SessionNoise(white=(1.0, 2.0, 3.0), fading=(4.0, 5.0, 6.0), memory=(0.7, 0.3, 9.0))
    estimate_noise(session, residuals, start=short)
    assert asked[-2][2:] == ((1.0, 4.0, 0.7), False)
    assert asked[-1][2:] == ((3.0, 6.0, 9.0), False)
    estimate_noise(session, residuals, start=replace(short, memory=(0.71, 0.3, 0.1)))
    assert asked[-1][3]  # noise that lasted for seconds before may do so again
    estimate_noise(session, residuals, lasting=True)
    assert asked[-1][3]
