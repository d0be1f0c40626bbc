"""What an estimate says of itself in numbers."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from curling_env.ice import ActiveEffect, FrictionMap, Ice
from curling_env.sheet import PAPER_SHEET
from curling_env.trajectory import Trajectory
from friction_estimation.inversion.estimate import Estimate
from friction_estimation.inversion.friction.information import StoredInformation
from friction_estimation.inversion.friction.posterior import Hyperparameters
from friction_estimation.inversion.noise import Noise
from friction_estimation.tracks.free_slide import FreeSlide


def slide(throw: int, rows: int) -> FreeSlide:
    t = np.arange(rows) / 10
    return FreeSlide(
        track=Trajectory(t=t, xy=np.column_stack([0 * t, t]), throw=throw),
        rows=np.arange(rows),
        released_at=1.5,
        rests=throw == 4,
        wild=3,
        noise=0.002,
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
        scatter=0.003,
        noise=Noise(white=0.002, slow=0.001, time=0.4),
        resolved=5.0,
        information=StoredInformation(
            reference=0.0,
            cells=np.arange(3),
            matrix=np.eye(10),
            vector=np.zeros(10),
            observed=observed,
            mu=mu,
            noise=Noise(white=0.002),
            hyperparameters=Hyperparameters(spread=0.05, length=3.0, scatter=0.003),
        ),
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
    assert replace(estimate, resolved=0.3).resolution == pytest.approx(np.sqrt(5.0))


def test_the_summary_of_a_map(estimate):
    found = estimate.summary()
    assert (found["mu"], found["sigma"], found["throws"], found["samples"]) == (0.009, 2e-4, 2, 100)
    assert (found["low"], found["high"]) == estimate.interval
    assert found["method"] == "trajectory"
    assert found["throws_before"] == 5
    assert found["scatter"] == 0.003
    assert found["noise_m"] == {"white": 0.002, "slow": 0.001, "slow_time_s": 0.4}
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
    white = replace(estimate, noise=Noise(white=0.002, time=0.4), skipped=())
    assert white.summary()["noise_m"] == {"white": 0.002, "slow": 0.0, "slow_time_s": 0.0}
    assert "skipped" not in white.summary()
    gaussian = replace(estimate.information, hyperparameters=Hyperparameters(
        spread=0.05, length=3.0, scatter=0.0, smoothness=np.inf))  # fmt: skip
    assert replace(estimate, information=gaussian).summary()["map"]["smoothness"] == "gaussian"
    one = replace(
        estimate,
        ice=Ice.uniform(0.009),
        uniform=True,
        noise=None,
        information=replace(
            estimate.information,
            cells=np.empty(0, dtype=np.intp),
            matrix=np.eye(2),
            vector=np.zeros(2),
            hyperparameters=None,
        ),
    ).summary()
    assert not {"map", "noise_m", "effects", "throws_before"} & set(one)
