"""`curling estimate`."""

from __future__ import annotations

import json

import pytest

from curling_env.ice import ActiveEffect, Ice, load_ice, save_ice
from curling_env.trajectory import write_tracks


@pytest.fixture
def tracks_file(sliding, rng, tmp_path):
    path = tmp_path / "tracks.csv"
    starts = sliding.varied_starts(rng, 4)
    write_tracks(path, sliding.measured_throws(sliding.uniform(0.0085), starts, rng, rest=0.5))
    return path


def test_command_prints_one_number_and_writes_an_ice(curling, tracks_file, tmp_path):
    result = curling("estimate", tracks_file, "-o", tmp_path / "ice.json", "--uniform")
    assert result.status == 0, result.err
    numbers = result.json()
    assert numbers["low"] < 0.0085 < numbers["high"]
    assert numbers["low"] < numbers["mu"] < numbers["high"]
    assert numbers["throws"] == 4
    ice = load_ice(tmp_path / "ice.json")
    assert ice.friction.is_uniform
    assert ice.friction.mu[0, 0] == pytest.approx(numbers["mu"])


@pytest.mark.parametrize("method", ["trajectory", "paper"])
def test_command_writes_map_and_report(curling, tracks_file, tmp_path, method, must_fit, unchanged):
    ice = tmp_path / "ice.json"
    report = tmp_path / "report"
    result = curling("estimate", tracks_file, "-o", ice, "--method", method, "--report", report)
    assert result.status == 0, result.err
    assert result.json()["map"]["observed_cells"] == int(load_ice(ice).friction.observed.sum())
    for name in ("map.png", "motion.png"):
        assert (report / name).stat().st_size > 10_000
    assert json.loads((report / "estimate.json").read_text())["method"] == method
    must_fit(report / "estimate.json", "estimate-1")
    must_fit(ice, "ice-1")
    origin = json.loads((report / "estimate.json").read_text())["provenance"]
    assert origin["command"] == f"curling estimate tracks.csv --method {method}"
    assert load_ice(ice).provenance == origin
    assert origin["inputs"][0]["sha256"] in (report / "report.html").read_text()
    assert len((report / "cells.csv").read_text().splitlines()) == 1 + 9 * 89
    unchanged.document(json.loads((report / "estimate.json").read_text()))
    if method == "trajectory":
        unchanged.document(json.loads(ice.read_text()), "ice")
    unchanged.page((report / "report.html").read_text())


def test_command_keeps_the_starts_sheet_and_effects(curling, tracks_file, tmp_path):
    law = ActiveEffect(name="curl", parameters={"strength": 0.0082, "speed_exponent": 0.2})
    save_ice(Ice.uniform(0.01, effects=(law,)), tmp_path / "start.json")
    out = tmp_path / "ice.json"
    result = curling(
        "estimate", tracks_file, "-o", out, "--uniform", "--start", tmp_path / "start.json"
    )
    assert result.status == 0, result.err
    assert load_ice(out).effects[0].name == "curl"


@pytest.mark.parametrize(
    ("rows", "says"),
    [
        ("throw,t,x,theta\n0,0,0,\n", "y"),
        ("throw,t,x,y,theta\n0,0,0,nan,\n", "row 2"),
        ("throw,t,x,y,theta\n0,0.1,0,0,\n0,0.0,0,1,\n", "row 3"),
        ("throw,t,x,y,theta\n", "no rows"),
        ("throw,t,x,y,theta\n0,0.0,0,0,\n0,0.1,0,0.2,\n", "throw 0"),
    ],
)
def test_bad_tracks_give_one_line_and_no_file(curling, tmp_path, rows, says):
    path = tmp_path / "tracks.csv"
    path.write_text(rows)
    result = curling("estimate", path, "-o", tmp_path / "ice.json")
    assert says in result.complaint
    assert not (tmp_path / "ice.json").exists()


def test_film_without_scene_and_two_tables_are_refused(curling, tracks_file, tmp_path):
    out = tmp_path / "ice.json"
    assert "--scene" in curling("estimate", tmp_path / "a.mp4", "-o", out).complaint
    assert "one tracks file" in curling("estimate", tracks_file, tracks_file, "-o", out).complaint
    assert not out.exists()
