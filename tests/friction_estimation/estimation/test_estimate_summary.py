"""Numbers in the summary of an estimate."""

from __future__ import annotations

import json
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from curling_env.ice import ActiveEffect, FrictionMap, Ice
from curling_env.sheet import PAPER_SHEET
from curling_env.trajectory import Trajectory
from friction_estimation import Estimate
from friction_estimation.discovery import CoordinateNoise, SessionNoise
from friction_estimation.estimation import camera_bias
from friction_estimation.estimation.camera_bias import CameraBias, camera_bias_of
from friction_estimation.tracks import FreeSlide


def slide(throw: int, rows: int) -> FreeSlide:
    t = 1.5 + np.arange(rows) / 10
    return FreeSlide(
        track=Trajectory(t=t, xy=np.column_stack([0 * t, t]), throw=throw),
        rows=np.arange(rows),
        stretch=(0, rows),
        rests=throw == 4,
        wild=3,
        noise=0.002,
    )


def fitted(smoothness: float, field: bool = True) -> Any:
    """Fit reduced to the parts that a summary needs."""
    found = SimpleNamespace(
        amplitude=0.05, length=3.0, smoothness=smoothness, values=0.05 * np.ones(5)
    )
    noise = SessionNoise(
        white=(0.002, 0.002, 0.01), fading=(0.001, 0.001, 0.0), memory=(0.4, 0.4, 0.1)
    )
    none = np.empty(0, dtype=int)
    return SimpleNamespace(
        model=SimpleNamespace(spread=0.003, map_field=found if field else None),
        noise=noise,
        session=SimpleNamespace(throws=none, stones=none, clocks=none),
    )


@pytest.fixture
def estimate() -> Estimate:
    observed = np.zeros(PAPER_SHEET.shape, dtype=bool)
    observed[20:30, 4:6] = True
    mu = np.full(PAPER_SHEET.shape, 0.009)
    mu[20, 4], mu[21, 5], mu[0, 0] = 0.008, 0.011, 0.5
    sigma = np.where(observed, 2e-4, 1.0)
    effects = (ActiveEffect(name="slope", parameters={"x": 1e-4, "y": 0.0}, sigma={"x": 1e-5}),)
    return Estimate(
        ice=Ice(friction=FrictionMap(mu=mu, sigma=sigma, observed=observed), effects=effects),
        method="trajectory",
        uniform=False,
        mu=0.009,
        sigma=0.0002,
        slides=(slide(3, 40), slide(4, 60)),
        skipped=("throw 9: too short",),
        fit=fitted(smoothness=2.5),
    )


def test_the_interval_holds_95_per_cent_in_ln_mu_or_for_the_paper_in_mu(estimate):
    factor = np.exp(1.959964 * 0.0002 / 0.009)
    assert estimate.interval == pytest.approx((0.009 / factor, 0.009 * factor), rel=1e-6)
    paper = replace(estimate, method="paper")
    assert paper.interval == pytest.approx(
        (0.009 - 1.959964 * 0.0002, 0.009 + 1.959964 * 0.0002), rel=1e-6
    )


def test_the_resolution_is_the_side_of_the_patch_that_one_number_describes(estimate):
    assert estimate.resolution == pytest.approx(np.sqrt(20 * 0.25 / 5.0))
    even = fitted(2.5)
    even.model.map_field.values = np.zeros(5)
    assert replace(estimate, fit=even).resolution == pytest.approx(np.sqrt(5.0))
    assert replace(estimate, fit=fitted(2.5, field=False)).resolution is None


def test_the_summary_of_a_map(estimate):
    found = estimate.summary()
    assert (found["mu"], found["sigma"], found["throws"], found["samples"]) == (0.009, 2e-4, 2, 100)
    assert (found["low"], found["high"]) == estimate.interval
    assert found["method"] == "trajectory"
    assert found["scatter"] == 0.003
    assert found["noise_m"] == pytest.approx({"white": 0.002, "slow": 0.001, "slow_time_s": 0.4})
    assert found["map"] == {
        "observed_cells": 20,
        "cells": PAPER_SHEET.shape[0] * PAPER_SHEET.shape[1],
        "mu_keenest": 0.008,
        "mu_heaviest": 0.011,
        "sigma_median": 2e-4,
        "resolution_m": estimate.resolution,
        "spread": 0.05,
        "length_m": 3.0,
        "smoothness": 2.5,
    }
    assert found["effects"] == [
        {"name": "slope", "parameters": {"x": 1e-4, "y": 0.0}, "sigma": {"x": 1e-5}}
    ]
    assert found["skipped"] == ["throw 9: too short"]
    assert found["each"][1] == {
        "throw": 4,
        "released_at_s": 1.5,
        "seconds": pytest.approx(5.9),
        "rests": True,
        "wild_rows": 3,
    }
    assert "camera_bias" not in found


def test_what_there_is_not_is_left_out(estimate):
    assert "skipped" not in replace(estimate, skipped=()).summary()
    gaussian = replace(estimate, fit=fitted(np.inf))
    assert gaussian.summary()["map"]["smoothness"] == "gaussian"
    one = replace(estimate, ice=Ice.uniform(0.009), uniform=True, fit=None).summary()
    assert not {"map", "noise_m", "effects"} & set(one)


def test_an_error_lost_to_rounding_is_null_and_the_rest_is_reported(estimate):
    found = replace(estimate, sigma=float("nan")).summary()
    assert (found["sigma"], found["low"], found["high"]) == (None, None, None)
    json.dumps(found, allow_nan=False)


def test_the_size_of_a_bias_weighs_nodes_by_how_well_they_are_known():
    search = SimpleNamespace(outcome="found", variety=1.0, seen_from=1e-3, gain=20.0, likeness=1.0)
    values, sigma = np.array([3e-3, -3e-3, 9e-3]), np.array([1e-3, 1e-3, 2e-3])
    bias = CameraBias(search=search, nodes=np.arange(3.0), values=values, sigma=sigma)
    assert bias.size == pytest.approx(1e-3 * np.sqrt((9 + 9 + 81 / 4) / 2.25))
    assert bias.summary()["size_m"] == bias.size
    assert "4.1 mm found" in bias.words
    none = CameraBias(search=replace_outcome(search, "none"))
    assert none.size == 0.0
    assert none.words == "no camera bias found; one of 1.0 mm would be"


def replace_outcome(search: SimpleNamespace, outcome: str) -> Any:
    return SimpleNamespace(**{**vars(search), "outcome": outcome})


def test_noise_without_a_memory_has_no_time():
    white = SessionNoise(white=(0.002, 0.002, 0.01), fading=(0.0, 0.0, 0.0), memory=(0.4,) * 3)
    assert white.coordinate == CoordinateNoise(white=pytest.approx(0.002), slow=0.0, time=0.0)


def test_the_bias_of_a_camera_has_the_error_of_its_nodes(monkeypatch):
    """Each is a combination of coefficients, which have a covariance."""
    root = np.array([[1.0, 0.0], [0.5, 2.0], [0.0, -3.0]])
    covariance = np.full((5, 5), 99.0)
    covariance[2:4, 2:4] = [[4e-6, 1e-6], [1e-6, 9e-6]]
    monkeypatch.setattr(camera_bias, "mixture", lambda _: SimpleNamespace(covariance=covariance))
    ripple = SimpleNamespace(root=root, values=np.array([2e-3, 1e-3]), nodes=np.arange(3.0))
    model = SimpleNamespace(ripple=ripple, ripple_slice=slice(2, 4))
    search: Any = SimpleNamespace(
        outcome="found", variety=0.4, seen_from=np.inf, gain=50.0, likeness=0.9
    )
    fit: Any = SimpleNamespace(model=model)
    bias = camera_bias_of(search, fit)
    assert bias.found
    assert bias.values == pytest.approx([2e-3, 3e-3, -3e-3])
    variances = [4e-6, 0.25 * 4e-6 + 4 * 9e-6 + 2 * 0.5 * 2 * 1e-6, 9 * 9e-6]
    assert bias.sigma == pytest.approx(np.sqrt(variances))
    shown = bias.summary()
    assert shown == {
        "outcome": "found",
        "variety": 0.4,
        "gain": 50.0,
        "likeness_of_halves": 0.9,
        "size_m": bias.size,
        "y": [0.0, 1.0, 2.0],
        "displacement_m": bias.values.tolist(),
        "sigma_m": bias.sigma.tolist(),
    }
    model.ripple = None
    without = camera_bias_of(replace_outcome(search, "inseparable"), fit)
    assert not without.found
    assert without.summary() == {"outcome": "inseparable", "variety": 0.4}
    assert "expected 8 throws or more" in without.words


def fitted_throws() -> Any:
    """Fit of one throw of two stones, the first of which slides again after a contact."""
    rows = 4

    class Three(SimpleNamespace):
        def __len__(self):
            return 3

    session = Three(
        throws=np.array([3, 3, 3]),
        stones=np.array([0, 0, 5]),
        clocks=np.array([101.5, 108.0, 101.5]),
        times=np.tile(np.arange(4.0), 3),
        gates=None,
        rows=lambda i: slice(rows * i, rows * i + rows),
    )
    predicted, residuals = np.zeros((12, 6)), np.zeros((12, 3))
    predicted[:4, 2:4], residuals[:4, :2] = [0.6, 0.8], [0.01, 0.02]
    predicted[4:8, 2:4], residuals[4:8, :2] = [0.0, -2.0], [0.5, 0.03]
    residuals[5, :2] = np.nan
    states = np.zeros((3, 6))
    states[1, 2:4] = [0.3, -0.4]
    return SimpleNamespace(
        session=session, predicted=predicted, residuals=residuals, states=states,
        ln_factors=np.array([0.0, 0.1, 0.2]), model=SimpleNamespace(spread=0.0, map_field=None),
    )  # fmt: skip


def test_residuals_along_the_travel_have_the_sign_of_the_travel(estimate):
    (first, second, rest) = replace(estimate, fit=fitted_throws()).travel_residuals
    assert first[0].tolist() == [0.0, 1.0, 2.0, 3.0]
    assert first[1] == pytest.approx(np.full(4, 0.022))
    assert second[1][[0, 2, 3]] == pytest.approx(np.full(3, -0.03))
    assert rest[1] == pytest.approx(np.zeros(4))  # a stone at rest travels nowhere
    assert replace(estimate, fit=None).travel_residuals == []


def test_a_slide_is_found_in_the_fit_by_its_time_after_the_contact(estimate):
    """A slide may begin before the push seems to end, and not before the contact."""
    found = replace(estimate, fit=fitted_throws())
    track = replace(slide(3, 80).track, clock=100.0)  # from 101.5 to 109.4

    def place(first, last, **other):
        asked = replace(slide(3, 80), track=replace(track, **other), stretch=(first, last))
        return found.place(asked)

    assert place(0, 60) == 0
    assert place(60, 80) == 1
    assert place(1, 60) is None  # it began a tenth of a second before this stretch
    assert place(60, 66) == 1  # its last row is that of the release
    assert place(60, 65) is None
    assert place(0, 80, stone=5) == 2
    assert place(0, 80, throw=4) is None
    assert replace(estimate, fit=None).place(slide(3, 80)) is None
    shown = found._throw(replace(slide(3, 80), track=track, stretch=(60, 80)))
    assert shown["speed"] == pytest.approx(0.5)
    assert shown["mu_factor"] == pytest.approx(np.exp(0.1))
    assert shown["rms_m"] == pytest.approx(np.sqrt((0.25 + 0.0009) / 2))


def test_a_track_of_several_slides_counts_once(estimate):
    one = slide(3, 40)
    again = replace(one, rows=np.arange(20, 40))
    both = replace(estimate, slides=(one, again, slide(4, 60)))
    assert both.throws == 2
    assert len(both.tracks) == 2
    assert both.tracks[0] is one.track
    assert estimate.scatter == 0.003
    assert replace(estimate, fit=None).scatter == 0.0
    assert replace(estimate, fit=None).resolved == 1.0
