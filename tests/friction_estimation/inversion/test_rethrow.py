"""Measured throws thrown again."""

from __future__ import annotations

import csv

import numpy as np
import pytest

from curling_env.errors import InputError
from curling_env.ice import ActiveEffect, Ice, save_ice
from curling_env.trajectory import Trajectory, write_tracks
from friction_estimation.inversion.rethrow import compare_tracks

MU = 0.009


@pytest.fixture
def tracks(sliding, rng):
    starts = sliding.varied_starts(rng, 6)
    return sliding.measured_throws(
        sliding.uniform(MU), starts, rng, curl=0.0065, noise=0.003, rest=1.0
    )


@pytest.fixture
def true_ice():
    curl = ActiveEffect(name="curl", parameters={"strength": 0.0065, "speed_exponent": 0.2})
    return Ice.uniform(MU, effects=(curl,))


def test_on_the_true_ice_predictions_arrive(tracks, true_ice):
    comparison = compare_tracks(tracks, true_ice)
    totals = comparison.summary()
    assert totals["throws"] == totals["rested"] == 6
    # 3 mm over 2.5 s leave the speed uncertain by 0.5 mm/s, which a draw makes into a centimetre.
    assert totals["rest_error_m"] < 0.05
    assert totals["path_rms_m"] < 0.03
    for rethrow in comparison.rethrows:
        assert rethrow.predicted_time == pytest.approx(rethrow.rest_time, abs=0.4)
        assert rethrow.tested.any()
        assert not rethrow.tested[:60].any()


def test_on_heavier_ice_predictions_fall_short_by_what_friction_takes(tracks, true_ice):
    heavy = Ice.uniform(1.05 * MU, effects=true_ice.effects)
    for rethrow in compare_tracks(tracks, heavy).rethrows:
        run = rethrow.release.speed**2 / (2 * 9.80665 * MU)
        assert rethrow.too_long == pytest.approx(-run * (1 - 1 / 1.05), rel=0.25)


def test_without_the_curl_predictions_end_on_the_side_it_came_from(tracks):
    for rethrow in compare_tracks(tracks, Ice.uniform(MU)).rethrows:
        # A counter-clockwise stone curls left: the straight prediction ends right of it.
        assert rethrow.too_far_left * np.sign(rethrow.release.omega) < -0.1


def test_track_that_ends_early_has_no_rest_but_a_path(tracks, true_ice):
    cut = [
        Trajectory(t=k.t[:300], xy=k.xy[:300], theta=k.theta[:300], throw=k.throw) for k in tracks
    ]
    totals = compare_tracks(cut, true_ice).summary()
    assert totals["rested"] == 0
    assert totals["rest_error_m"] is None
    assert totals["path_rms_m"] < 0.03


def test_window_must_be_positive(tracks, true_ice):
    with pytest.raises(InputError, match="window"):
        compare_tracks(tracks, true_ice, window=0.0)


def test_command_writes_tables_and_a_picture(curling, tracks, true_ice, tmp_path):
    write_tracks(tmp_path / "tracks.csv", tracks)
    save_ice(true_ice, tmp_path / "ice.json")
    result = curling(
        "compare", tmp_path / "tracks.csv", "--ice", tmp_path / "ice.json", "-o", tmp_path / "out"
    )
    assert result.status == 0, result.err
    assert result.json()["rest_error_m"] < 0.05
    assert (tmp_path / "out" / "comparison.png").stat().st_size > 20_000
    with (tmp_path / "out" / "throws.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [int(row["throw"]) for row in rows] == [k.throw for k in tracks]
    assert float(rows[0]["rest_error_m"]) < 0.2


def test_command_refuses_a_missing_ice(curling, tracks, tmp_path):
    write_tracks(tmp_path / "tracks.csv", tracks)
    complaint = curling(
        "compare", tmp_path / "tracks.csv", "--ice", tmp_path / "no.json", "-o", tmp_path / "out"
    ).complaint
    assert "no.json" in complaint
    assert not (tmp_path / "out").exists()
