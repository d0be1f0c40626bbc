"""Friction found again in throws that another program threw."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from curling_env.ice import ActiveEffect, Ice
from curling_env.sheet import PAPER_SHEET
from curling_env.throw import Release
from curling_env.trajectory import Trajectory
from friction_estimation import estimate_ice
from friction_estimation.design import uniform_bound
from friction_estimation.estimation import estimate_by_paper
from tests.friction_estimation.design.cell_bound import cell_bound

HOG = 10.9725


def friction_alone(tracks, **choices):
    return estimate_ice(tracks, effects="none", **choices)


def straight(count: int, speed: float) -> np.ndarray:
    return np.tile([0.0, -HOG, 0.0, speed, 0.0], (count, 1))


def centres() -> tuple[np.ndarray, np.ndarray]:
    return np.meshgrid(PAPER_SHEET.x_centres, PAPER_SHEET.y_centres)


# --- one number ------------------------------------------------------------------------------


def test_one_friction_at_the_papers_throws_reaches_the_bound(sliding, rng):
    """One pitch a session; `make figures` measures sessions of five."""
    errors, normed = [], []
    for mu in np.linspace(0.00182, 0.002, 10):
        tracks = sliding.measured_throws(sliding.uniform(mu), straight(1, 1.6), rng, until=HOG)
        found = friction_alone(tracks, uniform=True)
        bound = uniform_bound([1.6], mu=mu, noise=0.005, fps=30, distance=2 * HOG)
        errors.append(100 * abs(found.mu / mu - 1))
        normed.append((found.mu - mu) / bound)
        # A single throw says nothing of the scatter between throws, which counts in sigma.
        assert found.sigma < max(4.0 * bound, 0.01 * mu)
    assert np.mean(errors) < 0.3
    # The spread of ten errors of unit variance lies below 1.5 with 99.9 % probability.
    assert np.sqrt(np.mean(np.square(normed))) < 1.5


def test_interval_holds_the_truth(sliding, rng):
    inside = 0
    for _ in range(12):
        mu = rng.uniform(0.007, 0.012)
        tracks = sliding.measured_throws(
            sliding.uniform(mu), sliding.varied_starts(rng, 2), rng, noise=0.008, fps=8
        )
        low, high = friction_alone(tracks, uniform=True).interval
        inside += low < mu < high
    assert inside >= 10


@pytest.fixture(scope="module")
def scattering(sliding) -> SimpleNamespace:
    """Ten throws whose friction scatters by a hundredth, and the same throws without scatter."""
    rng = np.random.default_rng(20261121)
    starts = sliding.varied_starts(rng, 10)
    factor = np.exp(rng.normal(0, 0.01, 10))
    even, scattered = (
        sliding.measured_throws(sliding.uniform(0.009), starts, rng, fps=15, factor=own)
        for own in (None, factor)
    )
    return SimpleNamespace(even=even, scattered=scattered)


def test_scatter_between_throws_widens_the_interval(scattering):
    even = friction_alone(scattering.even, uniform=True)
    scattered = friction_alone(scattering.scattered, uniform=True)
    assert even.scatter < 0.0015
    assert 0.005 < scattered.scatter < 0.02
    assert scattered.sigma > 5 * even.sigma
    assert abs(scattered.mu - 0.009) < 3 * scattered.sigma


def test_a_map_finds_the_scatter_between_throws_too(scattering):
    assert 0.004 < friction_alone(scattering.scattered).scatter < 0.02


def test_curl_that_no_model_knows_does_not_bias_friction(sliding, rng):
    starts = sliding.varied_starts(rng, 6)
    tracks = sliding.measured_throws(sliding.uniform(0.009), starts, rng, curl=0.009, fps=15)
    found = friction_alone(tracks, uniform=True)
    assert abs(found.mu / 0.009 - 1) < 5e-4


def test_effects_of_the_start_stay_in_the_law(sliding, rng):
    starts = sliding.varied_starts(rng, 6, spin=0.0)
    tracks = sliding.measured_throws(sliding.uniform(0.008), starts, rng, exponent=0.3, fps=15)
    law = ActiveEffect(name="speed_dependent_friction", parameters={"exponent": 0.3})
    found = friction_alone(tracks, start=Ice.uniform(0.01, effects=(law,)), uniform=True)
    ignorant = friction_alone(tracks, uniform=True)
    assert found.ice.effects == (law,)
    assert abs(found.mu / 0.008 - 1) < 2e-3
    assert abs(ignorant.mu / 0.008 - 1) > 0.02
    assert ignorant.sigma > 5 * found.sigma


def test_wild_rows_lost_frames_lead_in_and_no_heading(sliding, rng):
    tracks = []
    for clean in sliding.measured_throws(
        sliding.uniform(0.009), sliding.varied_starts(rng, 4, spin=0.0), rng, rest=2.0
    ):
        away = np.sign(clean.xy[20, 1] - clean.xy[0, 1])
        velocity = (clean.xy[30] - clean.xy[0]) / clean.t[30]
        early = np.arange(-1.0, -0.01, 1 / 30)
        lead = clean.xy[0] + early[:, None] * (velocity + np.array([0, 0.045 * away]))
        xy = np.vstack([lead + rng.normal(0, 0.005, lead.shape), clean.xy])
        t = np.concatenate([early, clean.t]) + 1.0
        wild = rng.random(len(t)) < 0.01
        xy[wild] += rng.normal(0, 1.0, (int(wild.sum()), 2))
        kept = rng.random(len(t)) > 0.1
        tracks.append(Trajectory(t=t[kept], xy=xy[kept], throw=clean.throw))
    found = friction_alone(tracks, uniform=True)
    assert abs(found.mu / 0.009 - 1) < 2e-3
    assert abs(found.mu - 0.009) < 4 * found.sigma
    for slide in found.slides:
        assert slide.released_at == pytest.approx(1.0, abs=0.6)


def test_noise_that_lasts_is_seen_and_makes_sigma_honest(sliding, rng):
    normed, colours = [], []
    for _ in range(6):
        tracks = []
        for clean in sliding.measured_throws(
            sliding.uniform(0.009), sliding.varied_starts(rng, 2), rng, noise=1e-6
        ):
            wander, fade = np.zeros(2), np.exp(-1 / 30 / 0.3)
            noise = []
            for _ in clean.t:
                wander = fade * wander + rng.normal(0, 0.005 * np.sqrt(1 - fade**2), 2)
                noise.append(wander.copy())
            tracks.append(
                Trajectory(t=clean.t, xy=clean.xy + noise, theta=clean.theta, throw=clean.throw)
            )
        found = friction_alone(tracks, uniform=True)
        normed.append((found.mu - 0.009) / found.sigma)
        colours.append(found.noise.time if found.noise.slow > found.noise.white else 0.0)
    assert np.median(colours) == pytest.approx(0.3, rel=0.35)
    assert np.sqrt(np.mean(np.square(normed))) < 1.7


def test_even_ice_is_found_even_on_film(sliding, as_filmed):
    """A smoother leaves waves that last for seconds, as those do that uneven ice makes."""
    left, inside = [], []
    for seed in range(6):
        rng = np.random.default_rng([61, seed])
        starts = sliding.varied_starts(rng, 2)
        tracks = sliding.measured_throws(sliding.uniform(0.009), starts, rng, noise=1e-5, fps=8)
        friction = friction_alone(as_filmed(tracks, seed), camera_bias="off").ice.friction
        off = (friction.mu - 0.009)[friction.observed]
        left.append(np.sqrt(np.mean(off**2)) / 0.009)
        inside.append(np.abs(off) < 1.96 * friction.sigma[friction.observed])
    assert np.median(left) < 0.004  # three times as much where all waves are taken for ice
    assert np.concatenate(inside).mean() > 0.9


def test_rows_that_are_reported_to_err_more_count_less(sliding, rng):
    """Of half of all rows, far away, the errors are six times as large, and the track says so."""
    errors = {}
    for seed in range(10):
        rng = np.random.default_rng([62, seed])
        tracks = sliding.measured_throws(
            sliding.uniform(0.009), sliding.varied_starts(rng, 1), rng, noise=1e-5, fps=8
        )
        size = [np.where(k.xy[:, 1] > 0, 0.012, 0.002) for k in tracks]
        off = [rng.normal(0, 1, k.xy.shape) * s[:, None] for k, s in zip(tracks, size, strict=True)]
        seen = [replace(k, xy=k.xy + e) for k, e in zip(tracks, off, strict=True)]
        stated = [replace(k, sigma_xy=s) for k, s in zip(seen, size, strict=True)]
        for name, measured in (("seen", seen), ("stated", stated)):
            errors.setdefault(name, []).append(
                friction_alone(measured, uniform=True).mu / 0.009 - 1
            )
    spread = {name: np.sqrt(np.mean(np.square(e))) for name, e in errors.items()}
    assert spread["stated"] < 0.85 * spread["seen"]


# --- the map ---------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def mapped(sliding) -> list[SimpleNamespace]:
    """Two smooth random ices, 24 varied throws each, their estimates and truths."""
    out = []
    for seed, rough in ((1, False), (2, True)):
        rng = np.random.default_rng(seed)
        spread, length = rng.uniform(0.05, 0.08), rng.uniform(2.0, 4.0)
        field = sliding.random_field(rng, mu=0.0095, spread=spread, length=length, rough=rough)
        starts = sliding.varied_starts(rng, 24)
        tracks = sliding.measured_throws(field, starts, rng, curl=0.0065, fps=8)
        out.append(
            SimpleNamespace(
                found=friction_alone(tracks),
                tracks=tracks,
                starts=starts,
                truth=field(*centres()),
                spread=spread,
                length=length,
                smoothness=1.5 if rough else np.inf,
            )
        )
    return out


def test_map_leaves_far_less_than_a_uniform_one(mapped):
    for case in mapped:
        friction = case.found.ice.friction
        seen = friction.observed
        left = np.sqrt(np.mean((friction.mu - case.truth)[seen] ** 2))
        assert left < 0.25 * case.truth[seen].std()


def test_map_reaches_the_bayesian_bound(mapped):
    ratios = []
    for case in mapped:
        releases = [Release(x=s[0], y=s[1], vx=s[2], vy=s[3]) for s in case.starts]
        bound = cell_bound(
            releases, mu=0.0095, noise=0.005, fps=8, spread=case.spread, length=case.length,
            smoothness=case.smoothness,
        )  # fmt: skip
        friction = case.found.ice.friction
        both = friction.observed & bound.crossed
        left = np.sqrt(np.mean((friction.mu - case.truth)[both] ** 2))
        ratios.append(left / np.sqrt(np.mean(bound.sigma[both] ** 2)))
    # One ice has some fifty independent numbers: its RMSE alone varies by a tenth and more.
    assert np.sqrt(np.mean(np.square(ratios))) < 1.5


def test_sigma_of_cells_is_true(mapped):
    inside = []
    for case in mapped:
        friction = case.found.ice.friction
        normed = (friction.mu - case.truth) / friction.sigma
        inside.append(np.abs(normed[friction.observed]) < 1.96)
    assert 0.88 < np.concatenate(inside).mean() <= 1.0


def test_cells_never_crossed_are_marked_and_less_known(mapped):
    friction = mapped[0].found.ice.friction
    assert 0.2 < friction.observed.mean() < 0.6
    assert not friction.observed[:5].any()
    assert np.median(friction.sigma[~friction.observed]) > 3 * np.median(
        friction.sigma[friction.observed]
    )


def test_the_papers_method_is_there_and_worse(mapped):
    case = mapped[0]
    paper = estimate_by_paper(case.tracks).ice.friction
    joint = case.found.ice.friction
    both = paper.observed & joint.observed

    def left(friction):
        return np.sqrt(np.mean((friction.mu - case.truth)[both] ** 2))

    assert left(paper) > 2 * left(joint)
    assert np.median(paper.sigma) > np.median(joint.sigma)


def test_uniform_ice_is_found_even(sliding, rng):
    starts = sliding.varied_starts(rng, 8)
    tracks = sliding.measured_throws(sliding.uniform(0.009), starts, rng, fps=15)
    friction = friction_alone(tracks).ice.friction
    assert np.abs(friction.mu[friction.observed] / 0.009 - 1).max() < 0.01


def test_same_tracks_same_ice(mapped):
    again = friction_alone(mapped[0].tracks[:4])
    assert np.array_equal(
        again.ice.friction.mu, friction_alone(mapped[0].tracks[:4]).ice.friction.mu
    )


def test_half_turn_of_the_sheet_turns_the_map(mapped):
    tracks = mapped[0].tracks[:5]
    turned = [Trajectory(t=k.t, xy=-k.xy, theta=k.theta, throw=k.throw) for k in tracks]
    one, other = friction_alone(tracks).ice.friction, friction_alone(turned).ice.friction
    apart = np.abs(one.mu - other.mu[::-1, ::-1]) / one.sigma
    assert apart.max() < 0.2
