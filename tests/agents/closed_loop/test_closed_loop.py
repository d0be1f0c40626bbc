"""The loop from hidden ice to throws on it, at small size."""

from __future__ import annotations

import json
import runpy
import sys
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from agents.closed_loop import (
    POSITION_NOISE,
    draw_hidden_ice,
    execute_plan,
    mixed_practice,
    noisy_track,
    run_stone,
    track_errors,
)
from agents.planning import plan, plan_task
from curling_env.physics import slide
from curling_env.sheet import TEE_Y
from curling_env.throw import Throw
from friction_estimation import estimate_ice


@pytest.mark.parametrize("effects", [True, False])
def test_stones_run_on_the_hidden_ice_as_on_its_truth(effects: bool) -> None:
    hidden = draw_hidden_ice(np.random.default_rng(3), effects=effects)
    truth = hidden.truth()
    assert bool(truth.effects) is effects
    assert 0.045 < hidden.spread < 0.085
    for speed, angle, spin in ((1.95, 0.03, 1.2), (1.7, -0.02, -1.5)):
        release = Throw(speed=speed, angle=angle, spin=spin).release()
        path, rest = run_stone(hidden, release), slide(truth, release)
        # Another integrator, a continuous field instead of cells: millimetres apart.
        assert np.hypot(path[-1, 1] - rest.x, path[-1, 2] - rest.y) < 8e-3
        assert path[-1, 5] == pytest.approx(rest.theta, abs=0.03)


def test_the_cameras_errors_are_its_noise() -> None:
    hidden = draw_hidden_ice(np.random.default_rng(3))
    release = mixed_practice(4, np.random.default_rng(1))[2]
    track = noisy_track(hidden, release, 2, np.random.default_rng(2))
    path = run_stone(hidden, release)
    true = np.column_stack([np.interp(track.t, path[:, 0], path[:, k]) for k in (1, 2)])
    assert (track.xy - true).std() == pytest.approx(POSITION_NOISE, rel=0.1)
    assert np.diff(track.t).mean() == pytest.approx(1 / 30)


def test_tracks_are_compared_with_the_truth_in_the_time_of_the_session() -> None:
    hidden = draw_hidden_ice(np.random.default_rng(3))
    releases = mixed_practice(4, np.random.default_rng(1))
    rng = np.random.default_rng(2)
    tracks = [noisy_track(hidden, release, k, rng) for k, release in enumerate(releases)]
    assert track_errors(hidden, releases, tracks) == pytest.approx(
        POSITION_NOISE * np.sqrt(2), rel=0.1
    )
    late = [replace(seen, t=seen.t + 0.5, clock=seen.clock - 0.5) for seen in tracks]
    assert track_errors(hidden, releases, late) == pytest.approx(
        POSITION_NOISE * np.sqrt(2), rel=0.1
    )
    # An error of half a second in the clock is as far as a stone runs in that time.
    assert track_errors(hidden, releases, [replace(s, t=s.t + 0.5) for s in tracks]).min() > 0.3


def test_plans_on_the_truth_succeed_on_the_hidden_ice() -> None:
    hidden = draw_hidden_ice(np.random.default_rng(3))
    truth = hidden.truth()
    draw = plan(truth, (0.4, TEE_Y), skill="none")
    made = execute_plan(hidden, truth, truth, draw, np.zeros((1, 3)))
    assert made.miss[0] < 0.02
    assert made.success.all()
    hit = plan_task(truth, "takeout", (-0.5, 17.8), skill="elite")
    made = execute_plan(hidden, truth, truth, hit, np.array([[0.0, 0.0, 0.0], [0.0, 0.03, 0.0]]))
    assert made.success.tolist() == [True, False]  # the second passes a metre beside the stone
    assert made.miss[0] < 0.01
    assert made.miss[1] == pytest.approx(28.6 * 0.03, rel=0.1)


def test_map_and_effects_are_told_apart() -> None:
    hidden = draw_hidden_ice(np.random.default_rng(5))
    rng = np.random.default_rng(6)
    tracks = [
        noisy_track(hidden, r, k, rng, fps=5.0) for k, r in enumerate(mixed_practice(10, rng))
    ]
    whole = estimate_ice(tracks)
    assert whole.ice.effect("time_drift") is None  # there is none
    air = whole.ice.effect("air_drag")  # nor this, but every ice is believed to have it
    assert air.parameters["coefficient"] < 3 * air.sigma["coefficient"]
    found, curl = (whole.ice.effect(name) for name in ("speed_dependent_friction", "curl"))
    # Ten throws tell it to 0.03 (20 to 0.001); without it all of 0.2 would be read as heavy ice.
    assert found.parameters["exponent"] == pytest.approx(hidden.exponent, abs=0.05)
    assert curl.parameters["strength"] == pytest.approx(hidden.curl, rel=0.1)
    rests = []
    for aim in (0.0, 0.9):
        meant = plan(whole.ice, (aim, TEE_Y), skill="none").best.throw
        path = run_stone(hidden, meant.release())
        rests.append(np.hypot(path[-1, 1] - aim, path[-1, 2] - TEE_Y))
    assert np.mean(rests) < 0.4  # ten throws; uniform ice would miss by metres


@pytest.fixture
def script(monkeypatch, capsys):
    def call(*arguments: object) -> str:
        path = Path(__file__).parents[3] / "scripts" / "closed_loop.py"
        monkeypatch.setattr(sys, "argv", [str(path), *map(str, arguments)])
        with pytest.raises(SystemExit) as end:
            runpy.run_path(str(path), run_name="__main__")
        assert not end.value.code
        return capsys.readouterr().out

    return call


def test_the_script_reports_every_kind_of_knowledge(script, monkeypatch, tmp_path: Path) -> None:
    fewer = partial(noisy_track, fps=8.0)  # as a slower camera
    monkeypatch.setattr("agents.closed_loop.practice.noisy_track", fewer)
    table = script(
        "--seed", 14, "--no-effects", "--practice", 8, "--draws", 1, "--guards", 1,
        "--takeouts", 1, "--trials", 2, "-o", tmp_path,
    )  # fmt: skip
    assert "map and effects" in table
    (report,) = json.loads((tmp_path / "report.json").read_text())
    assert set(report["chains"]) == {"uniform", "map", "map and effects", "truth"}
    for effect in report["effects"]:  # what every ice is believed to have is not there
        for name in ("exponent", "strength", "rate", "coefficient"):
            size = effect["parameters"].get(name, 0.0)
            assert abs(size) <= 3 * effect["sigma"].get(name, 0.0) + 1e-4
    for chain in report["chains"].values():
        miss = chain["with_error"]["mean_miss_m"]
        assert 0 < miss["low"] < miss["mean"] < miss["high"]
    low, high = report["c_over_d_interval"]
    assert low <= report["c_over_d_with_error"] <= high
    low, high = report["a_over_c_interval"]
    assert low < report["a_over_c_exact"] < high
    assert report["chains"]["truth"]["exact"]["mean_miss_m"]["mean"] < 0.02
    assert (tmp_path / "ice-14.png").stat().st_size > 20_000
