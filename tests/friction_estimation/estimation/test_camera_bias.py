"""A camera that errs by a smooth bias along the sheet, on throws that another program threw."""

from __future__ import annotations

import json
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from curling_env.ice import Ice
from curling_env.trajectory import Trajectory, write_tracks
from friction_estimation import estimate_ice
from friction_estimation.reports import write_report


def friction_alone(tracks, **choices):
    return estimate_ice(tracks, effects="none", **choices)


def with_camera_bias(
    tracks: list[Trajectory], amplitude: float, wave: float, phase: float
) -> list[Trajectory]:
    """Measured along the sheet with an error that is the same at the same place."""
    return [
        replace(
            k,
            xy=k.xy
            + np.column_stack([0 * k.t, amplitude * np.sin(2 * np.pi * k.xy[:, 1] / wave + phase)]),
        )
        for k in tracks
    ]


def error(ice: Ice, field) -> float:
    """Relative RMSE over the cells that were crossed."""
    sheet, seen = ice.sheet, ice.friction.observed
    truth = field(*np.meshgrid(sheet.x_centres, sheet.y_centres))
    return float(np.sqrt(np.mean((ice.friction.mu / truth - 1)[seen] ** 2)))


def wandering(tracks: list[Trajectory], rng: np.random.Generator, time: float) -> list[Trajectory]:
    """With 4 mm of noise that is correlated in time."""
    out = []
    for k in tracks:
        fade = np.exp(-1 / 30 / time)
        steps = rng.normal(0, 0.004 * np.sqrt(1 - fade**2), k.xy.shape)
        wander = [rng.normal(0, 0.004, 2)]
        for step in steps[1:]:
            wander.append(fade * wander[-1] + step)
        out.append(replace(k, xy=k.xy + wander))
    return out


@pytest.fixture(scope="module")
def seen_badly(sliding) -> SimpleNamespace:
    """Ten varied throws through a camera with a bias, fitted with and without it."""
    seed, amplitude, wave = 22, 0.005, 6.0
    rng = np.random.default_rng(seed)
    field = sliding.random_field(rng, mu=0.0095, spread=0.06, length=3.0)
    true = sliding.measured_throws(field, sliding.varied_starts(rng, 10), rng, fps=8)
    tracks = with_camera_bias(true, amplitude, wave, 1.0)
    return SimpleNamespace(
        amplitude=amplitude,
        wave=wave,
        field=field,
        tracks=tracks,
        found=friction_alone(tracks, camera_bias="auto"),
        without=friction_alone(tracks, camera_bias="off"),
    )


def test_map_is_better_by_far_with_the_bias(seen_badly):
    case = seen_badly
    assert case.without.camera_bias is None
    assert error(case.found.ice, case.field) < 0.5 * error(case.without.ice, case.field)
    assert error(case.found.ice, case.field) < 0.01


def test_bias_is_found_where_and_as_large_as_it_is(seen_badly):
    case, search = seen_badly, seen_badly.found.camera_bias
    assert search.search.outcome == "found"
    bias = search
    y = bias.nodes[4:-4]
    true = case.amplitude * np.sin(2 * np.pi * y / case.wave + 1.0)
    # A linear displacement is no such bias: it cannot be distinguished from scale and speed.
    even = np.column_stack([np.ones_like(y), y])
    left = bias.values[4:-4] - true
    left -= even @ np.linalg.lstsq(even, left, rcond=None)[0]
    assert np.sqrt(np.mean(left**2)) < 0.25 * case.amplitude
    assert bias.size == pytest.approx(case.amplitude / np.sqrt(2), rel=0.25)
    # Where stones ran it is known to a part of itself.
    assert np.median(bias.sigma[4:-4]) < 0.5 * case.amplitude
    assert np.mean(np.abs(left) < 3 * bias.sigma[4:-4]) > 0.9


def test_sigma_of_cells_is_true_beside_a_bias(seen_badly):
    ice = seen_badly.found.ice
    sheet, friction = ice.sheet, ice.friction
    truth = seen_badly.field(*np.meshgrid(sheet.x_centres, sheet.y_centres))
    normed = ((friction.mu - truth) / friction.sigma)[friction.observed]
    # One ice has some fifty independent numbers: a share of 0.95 varies by 0.05 and more.
    assert np.mean(np.abs(normed) < 1.96) > 0.8


def test_sigma_of_cells_is_true_where_all_throws_have_one_speed(sliding):
    """Only the direction tells a bias of the camera from the ice: σ must say how badly."""
    rng = np.random.default_rng(31)
    field = sliding.random_field(rng, mu=0.0095, spread=0.06, length=3.0)
    starts = sliding.varied_starts(rng, 8)
    starts[:, 2:4] *= (2.1 / np.hypot(starts[:, 2], starts[:, 3]))[:, None]
    tracks = with_camera_bias(sliding.measured_throws(field, starts, rng, fps=8), 0.005, 4.0, 1.0)
    found = friction_alone(tracks)
    assert found.camera_bias.search.outcome == "found"
    assert error(found.ice, field) < 0.006  # 1 % where a row's own noise was in its column
    friction = found.ice.friction
    truth = field(*np.meshgrid(found.ice.sheet.x_centres, found.ice.sheet.y_centres))
    normed = ((friction.mu - truth) / friction.sigma)[friction.observed]
    assert np.mean(np.abs(normed) < 1.96) > 0.85


@pytest.mark.parametrize(
    ("seed", "kind", "fps"),
    [(32, "coloured", 30), (33, "rough", 15), (35, "follows the speed", 8)],
)
def test_without_a_ripple_none_is_found(sliding, seed, kind, fps):
    rng = np.random.default_rng(seed)
    field = sliding.random_field(rng, mu=0.009, spread=0.06, length=2.0, rough=kind == "rough")
    tracks = sliding.measured_throws(
        field, sliding.varied_starts(rng, 8), rng,
        noise=0.002 if kind == "coloured" else 0.005, fps=fps,
        exponent=0.1 if kind == "follows the speed" else 0.0,
    )  # fmt: skip
    if kind == "coloured":
        tracks = wandering(tracks, rng, 0.2)
    found = friction_alone(tracks)
    assert found.camera_bias.search.outcome == "none"
    if kind == "rough":  # what was looked for in vain leaves no trace
        other = friction_alone(tracks, camera_bias="off")
        assert np.array_equal(found.ice.friction.mu, other.ice.friction.mu)
        assert np.array_equal(found.ice.friction.sigma, other.ice.friction.sigma)
        assert found.camera_bias.search.seen_from < 0.002


def one_way(sliding, rng, count, speed=None):
    """Throws towards the away end, all at one speed where one is given."""
    starts = sliding.varied_starts(rng, count)
    starts[:, 1] = -np.abs(starts[:, 1])
    starts[:, 3] = np.abs(starts[:, 3])
    if speed is not None:
        starts[:, 2:4] *= (speed / np.hypot(starts[:, 2], starts[:, 3]))[:, None]
    return starts


def test_throws_of_one_speed_and_direction_cannot_show_a_bias(curling, sliding, tmp_path):
    """Then a bias of the camera and the ice are nearly the same to all throws."""
    rng = np.random.default_rng(41)
    field = sliding.random_field(rng, mu=0.0095, spread=0.06, length=3.0)
    starts = one_way(sliding, rng, 8, speed=2.1)
    true = sliding.measured_throws(field, starts, rng, fps=8)
    tracks = with_camera_bias(true, 0.005, 6.0, 1.0)
    write_tracks(tmp_path / "tracks.csv", tracks)
    run = curling(
        "estimate", tmp_path / "tracks.csv", "-o", tmp_path / "ice.json", "--effects", "none"
    )
    assert run.status == 0
    assert run.json()["camera_bias"]["outcome"] == "inseparable"


def test_speeds_well_apart_tell_it_one_way(sliding):
    rng = np.random.default_rng(32)
    field = sliding.random_field(rng, mu=0.0095, spread=0.06, length=3.0)
    starts = one_way(sliding, rng, 10)
    tracks = with_camera_bias(sliding.measured_throws(field, starts, rng, fps=8), 0.005, 6.0, 1.0)
    found = friction_alone(tracks)
    assert found.camera_bias.search.outcome == "found"
    assert error(found.ice, field) < 0.015  # 0.054 without the bias


def test_report_names_and_draws_the_bias(seen_badly, tmp_path, must_fit, unchanged):
    names = write_report(seen_badly.found, tmp_path)
    assert (tmp_path / "camera.png").stat().st_size > 10_000
    assert "camera.png" in names
    page = (tmp_path / "report.html").read_text()
    size = seen_badly.found.camera_bias.size
    assert f"{1000 * size:.1f} mm" in page
    assert "Bias of the camera" in page
    must_fit(tmp_path / "estimate.json", "estimate-1")
    document = json.loads((tmp_path / "estimate.json").read_text())["camera_bias"]
    assert document["outcome"] == "found"
    assert document["size_m"] == pytest.approx(size)
    assert len(document["y"]) == len(document["displacement_m"]) == len(document["sigma_m"])
    unchanged.document(document)
    unchanged.page(page)
