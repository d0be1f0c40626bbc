"""How well a camera is known that was fitted to painted curves."""

from __future__ import annotations

import numpy as np
import pytest

from friction_estimation.camera.markings_fit import _placement_scale

CURVES, EACH, POINT_PX, CURVE_PX = 24, 30, 0.1, 0.2
"""Curves, points on each, how far each point is off [px], and how far curves usually are [px]."""


def seen_scale(rng, laid, free, curves=CURVES):
    """What a least-squares fit of so many free parameters shows of curves laid as well as that."""
    curve = np.repeat(np.arange(curves), EACH)
    errors = np.where(curve[:, None] == np.arange(curves), CURVE_PX, 0.0)
    jacobian = rng.normal(size=(curves, free))[curve] + 0.1 * rng.normal(size=(len(curve), free))
    off = errors @ rng.normal(0.0, laid, curves) + rng.normal(0.0, POINT_PX, len(curve))
    weight = np.full(len(curve), 4.0)
    covariance = np.linalg.inv((jacobian.T * weight) @ jacobian)
    off -= jacobian @ covariance @ (jacobian.T @ (weight * off))
    return _placement_scale(errors, off, weight, jacobian, covariance, POINT_PX**2)


@pytest.mark.parametrize("laid", [0.2, 0.5, 1.0, 4.0])
def test_what_a_fit_leaves_shows_how_well_curves_are_laid(laid):
    rng = np.random.default_rng(3)
    seen = np.array([seen_scale(rng, laid, free=8) for _ in range(40)])
    assert abs(np.log(np.median(seen) / laid)) < 0.2
    assert np.std(np.log(seen)) < 0.35


def test_curves_that_the_fit_follows_altogether_are_as_usual():
    """Their errors are in the fit, and not in what it leaves."""
    rng = np.random.default_rng(4)
    curve = np.repeat(np.arange(5), EACH)
    errors = np.where(curve[:, None] == np.arange(5), CURVE_PX, 0.0)
    weight = np.full(len(curve), 4.0)
    covariance = np.linalg.inv((errors.T * weight) @ errors)
    off = rng.normal(0.0, POINT_PX, len(curve))
    off -= errors @ covariance @ (errors.T @ (weight * off))
    scale = _placement_scale(errors, off, weight, errors, covariance, POINT_PX**2)
    assert scale == pytest.approx(1.0)


def test_few_curves_say_less_than_what_is_usual():
    rng = np.random.default_rng(5)
    few = [seen_scale(rng, 4.0, free=8, curves=10) for _ in range(40)]
    many = [seen_scale(rng, 4.0, free=8) for _ in range(40)]
    assert 1.0 < np.median(few) < np.median(many)
