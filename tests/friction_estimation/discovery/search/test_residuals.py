"""The slow shapes in which residuals show what a model lacks."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from friction_estimation.discovery import SessionNoise, base_model, fit, misfit_of, open_session
from friction_estimation.discovery.search.residuals import Misfit, slow_columns
from friction_estimation.discovery.tuning import SLOWEST_NOISE_PERIOD


def test_slow_shapes_are_cosines_down_to_the_slowest_noise():
    t = 3.0 + np.arange(0, 20.001, 1 / 15)
    shapes = slow_columns(t)
    assert shapes.shape == (len(t), int(2 * 20 / SLOWEST_NOISE_PERIOD))
    for k in (1, 5, shapes.shape[1]):
        assert shapes[:, k - 1] == pytest.approx(np.cos(np.pi * k * (t - 3.0) / (t[-1] - 3.0)))


@pytest.mark.parametrize(("rows", "count"), [(24, 4), (8, 2), (2, 2)])
def test_few_rows_show_few_shapes(rows, count):
    assert slow_columns(np.linspace(0, 30, rows)).shape == (rows, count)


def test_the_misfit_is_what_slow_shapes_take_from_the_residuals(make_session):
    """Beside release and friction, and without the heading where it was not seen."""
    session = open_session(make_session(throws=3))
    theta = session.theta.copy()
    theta[session.rows(1)] = np.nan
    session = replace(session, theta=theta)
    white = (0.004, 0.004, 0.02)
    noise = SessionNoise(white=white, fading=(0.0,) * 3, memory=(0.1,) * 3)
    fitted = fit(base_model(None, session), session, noise)
    found = misfit_of(fitted)
    for i, channels in enumerate((3, 2, 3)):
        rows = session.rows(i)
        scale = (np.array(white) * session.sigma[rows][:, [0, 0, 1]])[:, :channels]
        slow = slow_columns(session.times[rows])
        shapes = np.einsum("nk,cd->ncdk", slow, np.eye(channels)).reshape(*scale.shape, -1)
        own = fitted.columns[rows, :channels, :7]
        residual = (fitted.residuals[rows, :channels] / scale).ravel()

        def left(*columns, residual=residual, scale=scale):
            matrix = (np.concatenate(columns, axis=2) / scale[:, :, None]).reshape(scale.size, -1)
            matrix /= np.linalg.norm(matrix, axis=0) + 1e-300
            return residual - matrix @ np.linalg.lstsq(matrix, residual)[0]

        explained = (left(own) ** 2).sum() - (left(own, shapes) ** 2).sum()
        lost = channels * slow.shape[1] - found.dof[i]  # as good as projected out
        assert lost in (0, 1)
        assert -0.01 < explained - found.chi2[i] < 0.01 + 4.0 * lost
    assert found.throw_tolerance == 1.0
    assert found.tolerated == 1.25


def test_slow_shapes_of_a_throw_of_twenty_seconds_are_twenty_cosines():
    """Each is half a wave longer than the one before, down to two seconds."""
    t = 3.0 + np.linspace(0.0, 20.0, 400)
    assert slow_columns(t).shape[1] == 20
    assert slow_columns(t)[:, -1] == pytest.approx(np.cos(2 * np.pi * (t - 3.0) / 2.0))
    assert slow_columns(np.array([5.0, 5.0])) == pytest.approx(np.ones((2, 2)))


def test_misfit_without_any_shape_is_that_of_one_degree_of_freedom():
    misfit = Misfit(chi2=np.array([3.0]), dof=np.array([0.0]))
    assert misfit.ratio == 3.0
    assert misfit.chance == pytest.approx(np.sqrt(2.0))
    assert misfit.z == pytest.approx(3.0 / np.sqrt(2.0))
    assert misfit.surprise == pytest.approx([3.0 / np.sqrt(2.0)])
