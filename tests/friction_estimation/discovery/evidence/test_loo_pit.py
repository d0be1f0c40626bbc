"""Forecasts of a true model err as often as they say; those of a wrong one do not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.stats import kstest

from friction_estimation.discovery import base_model, loo_pit, refit


def test_of_a_true_model_the_transforms_are_even(curl_fit):
    found = [loo_pit(curl_fit(throws=20, scatter=0.01, seed=seed)) for seed in (0, 1, 2)]
    for name in ("along", "across"):
        values = np.concatenate([getattr(each, name) for each in found])
        assert len(values) > 50
        assert kstest(values, "uniform").pvalue > 0.02, name
        assert 0.22 < values.std() < 0.36, name  # 0.289 of even ones


def test_without_its_curl_a_model_is_sure_of_the_wrong_side(curl_fit):
    fitted = curl_fit(throws=10)
    wrong = loo_pit(refit(fitted, base_model(None, fitted.session)))
    assert ((wrong.across < 0.01) | (wrong.across > 0.99)).all()
    # Left out of the model, curl takes a counter-clockwise stone to the left of its forecast.
    turning = fitted.states[np.isin(fitted.session.throws, wrong.throws), 5]
    assert np.array_equal(wrong.across < 0.5, turning > 0)


def test_a_forecast_that_is_too_short_lies_at_the_upper_end(curl_fit):
    fitted = curl_fit(throws=10, scatter=0.0, sigma=0.002)
    session = fitted.session
    farther = session.xy.copy()
    row, first = session.starts[4] - 1, session.starts[3]
    way = farther[row] - farther[first]
    farther[row] += 0.6 * way / np.hypot(*way)
    moved = replace(session, xy=farther)
    found = loo_pit(replace(fitted, session=moved))
    assert found.along[list(found.throws).index(session.throws[3])] > 0.99


def test_throws_seen_too_briefly_are_left_out(curl_fit):
    fitted = curl_fit(throws=8)
    session = fitted.session
    brief = session.without_rows((session.owner == 2) & (session.times > 3.0))
    short = refit(replace(fitted, session=brief), fitted.model)
    assert session.throws[2] not in loo_pit(short).throws
    assert len(loo_pit(short).throws) == 7
