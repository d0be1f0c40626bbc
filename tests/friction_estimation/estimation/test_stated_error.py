"""Errors that all frames of a camera share, on throws that another program threw."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from curling_env.trajectory import Trajectory
from friction_estimation import estimate_ice

SHARED, NOISE = 0.008, 0.002
WAVES = (20, 50)
"""Of what a camera is off by along the sheet [m]."""
STATED = float(np.hypot(SHARED, NOISE))


def friction_alone(tracks, **choices):
    return estimate_ice(tracks, effects="none", **choices)


def misplaced(
    tracks: list[Trajectory], rng: np.random.Generator, stated: float
) -> list[Trajectory]:
    """Tracks by a camera with a wrong pose: smooth errors, the same for all throws."""
    waves, phases = 2 * np.pi / rng.uniform(*WAVES, 6), rng.uniform(0, 2 * np.pi, 6)
    size = np.full(6, SHARED * np.sqrt(2 / 6))

    def seen(track: Trajectory) -> Trajectory:
        off = np.sin(np.multiply.outer(track.xy[:, 1], waves) + phases) @ size
        xy = track.xy + np.column_stack([0 * off, off])
        return replace(track, xy=xy, sigma_xy=np.full(len(track), stated))

    return [seen(track) for track in tracks]


def one_way(sliding, rng, count: int, mu: float) -> list[Trajectory]:
    starts = sliding.varied_starts(rng, 2 * count)[::2]
    return sliding.measured_throws(sliding.uniform(mu), starts, rng, noise=NOISE, fps=8)


def test_interval_of_one_friction_holds_it_through_many_cameras(sliding):
    """Throws one way: nothing in them tells the camera's error from the ice's friction."""
    stated, unsaid = [], []
    for seed in range(12):
        rng = np.random.default_rng([71, seed])
        mu = rng.uniform(0.0075, 0.0105)
        tracks = misplaced(one_way(sliding, rng, 4, mu), rng, STATED)
        silent = [replace(track, sigma_xy=np.empty(0)) for track in tracks]
        for found, session in ((stated, tracks), (unsaid, silent)):
            estimate = friction_alone(session, uniform=True)
            found.append((estimate.mu - mu) / estimate.sigma)
    # 12 of a share of 0.95: fewer than 9 with 0.2 %.
    assert np.sum(np.abs(stated) < 1.96) >= 9
    assert 0.5 < np.sqrt(np.mean(np.square(stated))) < 1.5
    # What is not stated cannot be known.
    assert np.sqrt(np.mean(np.square(unsaid))) > 1.3 * np.sqrt(np.mean(np.square(stated)))


def test_more_throws_do_not_average_it_away(sliding):
    rng = np.random.default_rng(72)
    tracks = misplaced(one_way(sliding, rng, 16, 0.009), rng, STATED)
    half, whole = (friction_alone(part, uniform=True) for part in (tracks[:8], tracks))
    assert whole.sigma > 0.8 * half.sigma  # 0.71 if it were averaged


def test_what_is_seen_as_noise_counts_once(sliding):
    """A table that states the noise of each row keeps its μ and its interval."""
    rng = np.random.default_rng(73)
    starts = sliding.varied_starts(rng, 6)
    tracks = sliding.measured_throws(sliding.uniform(0.009), starts, rng)
    stated = [replace(track, sigma_xy=np.full(len(track), 0.005)) for track in tracks]
    plain, found = (friction_alone(t, uniform=True) for t in (tracks, stated))
    assert found.mu == plain.mu
    assert found.sigma == plain.sigma


def test_level_of_a_map_knows_of_it_and_the_map_hardly_moves(sliding):
    rng = np.random.default_rng(74)
    field = sliding.random_field(rng, mu=0.009, spread=0.06, length=4.0)
    tracks = sliding.measured_throws(field, sliding.varied_starts(rng, 6), rng, noise=NOISE, fps=8)
    plain = friction_alone(tracks)
    stated = [replace(track, sigma_xy=np.full(len(track), STATED)) for track in tracks]
    found = friction_alone(stated)
    seen = plain.ice.friction.observed
    one, other = found.ice.friction, plain.ice.friction
    apart = np.abs(one.mu - other.mu) / one.sigma
    assert np.median(apart[seen]) < 1.0
    assert np.median((one.sigma / other.sigma)[seen]) > 1.0
    assert found.sigma > plain.sigma


def test_a_stone_whose_turn_was_not_seen_is_known_less_well(sliding):
    """Turning stones are braked less; without a heading the usual turn is taken, and doubted."""
    inside = 0
    for seed in range(8):
        rng = np.random.default_rng(80 + seed)
        mu = rng.uniform(0.0075, 0.0105)
        starts = sliding.varied_starts(rng, 5, spin=1.0)
        tracks = sliding.measured_throws(sliding.uniform(mu), starts, rng, noise=NOISE, fps=8)
        blind = [replace(track, theta=np.full(len(track), np.nan)) for track in tracks]
        found, seen = (friction_alone(t, uniform=True) for t in (blind, tracks))
        assert found.sigma > 1.05 * seen.sigma
        inside += abs(found.mu - mu) < 1.96 * found.sigma
    assert inside >= 7
