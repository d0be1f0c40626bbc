"""Predicted and actual errors of predictions.

The throws come from the tests' own integrator on ices that no part of the comparison knows.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from curling_env.ice import ActiveEffect, FrictionMap, Ice, save_ice
from curling_env.trajectory import Trajectory, write_tracks
from friction_estimation.comparison import Comparison, compare_tracks, position_noise

MU, CURL = 0.009, 0.0065


def believed_ice(share: float = 0.0, curl_sigma: float = 0.0) -> Ice:
    """Even ice of which a share of the friction, and some of the curl, is not known."""
    curl = ActiveEffect(
        name="curl",
        parameters={"strength": CURL, "speed_exponent": 0.2},
        sigma={"strength": curl_sigma},
    )
    return Ice(friction=FrictionMap.uniform(MU, sigma=share * MU), effects=(curl,))


def with_memory(track: Trajectory, rng: np.random.Generator, size: float, time: float):
    """A track with an error that fades over a time."""
    fade = np.exp(-np.diff(track.t) / time)
    error = np.zeros_like(track.xy)
    error[0] = rng.normal(0, size, 2)
    for i, f in enumerate(fade):
        error[i + 1] = f * error[i] + rng.normal(0, size * np.sqrt(1 - f**2), 2)
    return replace(track, xy=track.xy + error)


def sessions(sliding, ice: Ice, count: int, *, share=0.0, curl_sigma=0.0, slow=0.0):
    """Comparisons of sessions, each on a different ice, with the prior of all of them."""
    for seed in range(count):
        rng = np.random.default_rng((7, seed))
        field = sliding.uniform(MU)
        if share:
            field = sliding.random_field(rng, mu=MU, spread=share, length=2.0)
        tracks = sliding.measured_throws(
            field,
            sliding.varied_starts(rng, 6),
            rng,
            curl=rng.normal(CURL, curl_sigma),
            noise=0.003,
            fps=10,
            rest=1.0,
        )
        if slow:
            tracks = [with_memory(track, rng, slow, 1.0) for track in tracks]
        yield compare_tracks(tracks, ice)


def sigmas(comparisons: list[Comparison]) -> np.ndarray:
    """Errors of all rests in standard deviations, along and to the left, (n, 2)."""
    return np.array(
        [
            k.sigmas[::-1]
            for comparison in comparisons
            for k in comparison.rethrows
            if k.sigmas is not None
        ]
    )


@pytest.mark.parametrize(
    ("count", "share", "curl_sigma", "slow"),
    [(6, 0.0, 0.0, 0.0), (6, 0.0, 0.0, 0.008), (12, 0.03, 6e-4, 0.0)],
    ids=["noise", "noise with a memory", "ice"],
)
def test_errors_are_as_large_as_was_reported(sliding, count, share, curl_sigma, slow):
    truth = {"share": share, "curl_sigma": curl_sigma, "slow": slow}
    found = sigmas(list(sessions(sliding, believed_ice(share, curl_sigma), count, **truth)))
    # The throws of one session share its ice, so that twelve sessions tell it to a fifth.
    assert np.sqrt((found**2).mean(axis=0)) == pytest.approx([1.0, 1.0], rel=0.3)


def test_an_ice_that_claims_to_be_known_is_found_out(sliding):
    (comparison,) = sessions(sliding, believed_ice(), 1, share=0.03, curl_sigma=6e-4)
    assert comparison.summary()["rest_error_sigmas"] > 5


def test_noise_is_reported_although_a_curve_was_subtracted(sliding):
    found = [position_noise(c.rethrows) for c in sessions(sliding, believed_ice(), 4, slow=0.008)]
    assert np.mean([noise.white for noise in found]) == pytest.approx(0.003, rel=0.1)
    assert np.mean([noise.slow for noise in found]) == pytest.approx(0.008, rel=0.15)


def test_a_stone_without_headings_may_curl_either_way(sliding, rng):
    starts = np.array([[0.0, -10.9725, 0.0, 2.0, 1.2], [0.1, 10.9725, 0.0, -2.1, -1.0]])
    tracks = sliding.measured_throws(
        sliding.uniform(MU), starts, rng, curl=CURL, noise=0.003, rest=1.0
    )
    blind = [replace(track, theta=np.full_like(track.theta, np.nan)) for track in tracks]
    seen, unseen = compare_tracks(tracks, believed_ice()), compare_tracks(blind, believed_ice())
    for one, other in zip(seen.rethrows, unseen.rethrows, strict=True):
        assert one.rest_sigma[0] < 0.02
        assert other.rest_sigma[0] > 0.3


def test_the_command_prints_it(sliding, rng, curling, tmp_path):
    tracks = sliding.measured_throws(
        sliding.uniform(MU), sliding.varied_starts(rng, 2), rng, curl=CURL, noise=0.003, rest=1.0
    )
    write_tracks(tmp_path / "tracks.csv", tracks)
    marked = believed_ice(0.02).with_effect(ActiveEffect(name="unknown"))
    save_ice(marked, tmp_path / "ice.json")
    out = tmp_path / "out"
    result = curling("compare", tmp_path / "tracks.csv", "--ice", tmp_path / "ice.json", "-o", out)
    document = result.json()
    assert document["rest_error_sigmas"] > 0
    for throw in document["each"]:
        assert throw["sigmas_too_long"] == pytest.approx(
            throw["too_long_m"] / throw["rest_sigma_y_m"]
        )
    assert "lacks an effect" in result.err
    assert "rest_sigma_x_m" in (out / "throws.csv").read_text().splitlines()[0]
