"""`curling design`."""

from __future__ import annotations

from curling_env.throw import read_releases


def test_command_plans_without_tracks(curling, tmp_path, unchanged):
    releases = tmp_path / "releases.csv"
    result = curling("design", "--resolution", 3, "--precision", 1.5, "-o", releases)
    assert result.status == 0, result.err
    numbers = result.json()
    assert numbers["reached"]
    assert numbers["throws"] == len(read_releases(releases))
    assert sum(kind["times"] for kind in numbers["kinds"]) == numbers["throws"]
    assert numbers["words"] in result.err
    unchanged.document(numbers)


def test_speeds_that_are_no_numbers_are_refused(curling):
    assert "--speeds" in curling("design", "--speeds", "fast").complaint


def test_design_takes_no_tracks(curling, tmp_path):
    (tmp_path / "tracks.csv").write_text("throw,t,x,y,theta\n")
    assert "tracks.csv" in curling("design", tmp_path / "tracks.csv").complaint


def test_estimate_needs_tracks_and_an_output(curling, tmp_path):
    (tmp_path / "tracks.csv").write_text("throw,t,x,y,theta\n")
    assert "TRACKS.csv" in curling("estimate", "-o", tmp_path / "ice.json").complaint
    assert "-o" in curling("estimate", tmp_path / "tracks.csv").complaint
