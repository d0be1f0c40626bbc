"""Measured throws thrown again."""

from __future__ import annotations

import csv
from dataclasses import replace

import numpy as np
import pytest

from curling_env import simulate
from curling_env.errors import InputError
from curling_env.ice import ActiveEffect, Ice, save_ice
from curling_env.throw import Release, Throw
from curling_env.trajectory import Trajectory, write_tracks
from friction_estimation.comparison import Comparison, Rethrow, compare_tracks

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
        assert rethrow.miss[1] == pytest.approx(-run * (1 - 1 / 1.05), rel=0.25)


def test_without_the_curl_predictions_end_on_the_side_it_came_from(tracks):
    for rethrow in compare_tracks(tracks, Ice.uniform(MU)).rethrows:
        # A counter-clockwise stone curls left: the straight prediction ends right of it.
        assert rethrow.miss[0] * np.sign(rethrow.release.omega) < -0.1


def test_track_that_ends_early_has_no_rest_but_a_path(tracks, true_ice):
    cut = [
        Trajectory(t=k.t[:300], xy=k.xy[:300], theta=k.theta[:300], throw=k.throw) for k in tracks
    ]
    totals = compare_tracks(cut, true_ice).summary()
    assert totals["rested"] == 0
    assert totals["rest_error_m"] is None
    assert totals["path_rms_m"] < 0.03


@pytest.mark.parametrize(("felt", "wear"), [("along_path", -0.05), ("under_contacts", -0.0125)])
def test_stones_run_on_the_ice_that_those_before_wore(rng, felt, wear):
    effect = ActiveEffect(name="pebble_wear", parameters={"rate": 0.0, felt: wear})
    worn = Ice.uniform(MU, effects=(effect,))
    throws = [Throw(speed=2.0, spin=1.0)] * 3
    tracks = [
        replace(k, xy=k.xy + rng.normal(0, 0.001, k.xy.shape)) for k in simulate(worn, throws)
    ]
    gone = [track.xy[-1, 1] for track in tracks]
    assert gone[2] > gone[1] + 0.2 > gone[0] + 0.4
    right = [abs(k.miss[1]) for k in compare_tracks(tracks, worn).rethrows]
    assert max(right) < 0.15
    unworn = [k.miss[1] for k in compare_tracks(tracks, Ice.uniform(MU)).rethrows]
    assert abs(unworn[0]) < 0.15
    assert unworn[2] < unworn[1] - 0.15 < unworn[0] - 0.3


def test_window_must_be_positive(tracks, true_ice):
    with pytest.raises(InputError, match="window"):
        compare_tracks(tracks, true_ice, window=0.0)


def test_command_writes_tables_and_a_picture(curling, tracks, true_ice, tmp_path, unchanged):
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
    unchanged.document(result.json())
    unchanged.document(rows, "throws")
    unchanged.picture((tmp_path / "out" / "comparison.png").read_bytes())


def test_command_refuses_a_missing_ice(curling, tracks, tmp_path):
    write_tracks(tmp_path / "tracks.csv", tracks)
    complaint = curling(
        "compare", tmp_path / "tracks.csv", "--ice", tmp_path / "no.json", "-o", tmp_path / "out"
    ).complaint
    assert "no.json" in complaint
    assert not (tmp_path / "out").exists()


def made_up(
    *,
    direction=1.0,
    rest=(0.1, 17.0),
    predicted_rest=(0.4, 16.6),
    path_error=0.0,
    rest_sigma=(0.15, 0.1),
):
    """A rethrow whose numbers are given."""
    t = np.arange(10.0)
    measured = np.column_stack([0 * t, direction * t])
    return Rethrow(
        throw=4,
        stone=2,
        release=Release(x=0.0, y=-direction * 11, vx=0.0, vy=direction * 2.0, omega=1.5),
        t=t,
        measured=measured,
        predicted=measured + np.array([path_error, 0.0]),
        tested=t >= 5,
        rest=None if rest is None else np.array(rest),
        predicted_rest=np.array(predicted_rest),
        rest_time=None if rest is None else 20.5,
        predicted_time=20.75,
        rest_sigma=rest_sigma,
    )


def test_errors_of_a_rest_are_reported_along_and_across_the_play():
    away = made_up()
    assert away.rest_error == pytest.approx(0.5)
    assert away.miss == pytest.approx((-0.3, -0.4))
    home = made_up(direction=-1.0, rest=(0.1, -17.0), predicted_rest=(0.4, -16.6))
    assert home.miss == pytest.approx((0.3, -0.4))
    assert made_up(path_error=0.02).summary()["path_rms_m"] == pytest.approx(0.02)
    assert made_up(rest=None).rest_error is None
    assert made_up(rest=None).miss is None


def test_a_throw_in_numbers():
    assert made_up(path_error=0.02).summary() == pytest.approx(
        {
            "throw": 4,
            "stone": 2,
            "speed": 2.0,
            "spin": 1.5,
            "rest_x": 0.1,
            "rest_y": 17.0,
            "predicted_x": 0.4,
            "predicted_y": 16.6,
            "rest_sigma_x_m": 0.15,
            "rest_sigma_y_m": 0.1,
            "rest_error_m": 0.5,
            "too_long_m": -0.4,
            "too_far_left_m": -0.3,
            "sigmas_too_long": -4.0,
            "sigmas_too_far_left": -2.0,
            "path_rms_m": 0.02,
            "rest_time_s": 20.5,
            "predicted_time_s": 20.75,
        }
    )
    assert made_up(rest=None).summary()["rest_x"] is None
    assert made_up(rest=None).summary()["sigmas_too_long"] is None
    unknown = made_up(rest_sigma=None).summary()
    assert unknown["rest_sigma_x_m"] is unknown["sigmas_too_far_left"] is None


def test_totals_count_only_throws_that_rested():
    throws = (
        made_up(path_error=0.03),
        made_up(predicted_rest=(0.1, 18.2), path_error=0.01),
        made_up(rest=None),
    )
    totals = Comparison(rethrows=throws, skipped=("throw 9: too short",), window=2.5).summary()
    assert (totals["throws"], totals["rested"], totals["release_window_s"]) == (3, 2, 2.5)
    assert totals["path_rms_m"] == pytest.approx(np.sqrt((0.03**2 + 0.01**2) / 3))
    assert totals["rest_error_m"] == pytest.approx(np.sqrt((0.5**2 + 1.2**2) / 2))
    sigmas = np.array([-4.0, -2.0, 12.0, 0.0])
    assert totals["rest_error_sigmas"] == pytest.approx(np.sqrt((sigmas**2).mean()))
    assert totals["rest_error_median_m"] == pytest.approx(0.85)
    assert totals["rest_error_worst_m"] == pytest.approx(1.2)
    assert totals["too_long_mean_m"] == pytest.approx((-0.4 + 1.2) / 2)
    assert totals["too_far_left_mean_m"] == pytest.approx(-0.15)
    assert totals["skipped"] == ["throw 9: too short"]
    assert len(totals["each"]) == 3
    assert "skipped" not in Comparison(rethrows=throws, skipped=(), window=2.5).summary()
