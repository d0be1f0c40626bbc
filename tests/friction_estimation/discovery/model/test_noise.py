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
from friction_estimation.discovery.model.whitening import restricted_square


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
