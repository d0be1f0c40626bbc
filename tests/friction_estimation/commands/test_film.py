"""`curling film`."""

from __future__ import annotations

import pytest

from friction_estimation import load_scene

RELEASES = "throw,x,y,vx,vy,theta,omega\n0,0,-10.9725,0,0.5,0,1.0\n"


def test_the_command_films_releases_and_lists_its_files(curling, tmp_path):
    (tmp_path / "r.csv").write_text(RELEASES)
    result = curling(
        *("film", "--ice", "standard", "--releases", tmp_path / "r.csv", "--camera", "side"),
        *("--size", "192x108", "--fps", 10, "--no-people", "-o", tmp_path / "films"),
    )
    assert result.status == 0
    written = result.json()
    assert written["films"] == [str(tmp_path / "films" / "side-0.mp4")]
    for path in (written["films"] + written["truth"], [written["scene"], written["ice"]]):
        for name in path:
            assert (tmp_path / name).is_file()
    assert load_scene(written["scene"]).has_corners


@pytest.mark.parametrize(
    ("arguments", "releases", "message"),
    [
        (["--camera", "drone"], RELEASES, "unknown camera 'drone'"),
        (["--size", "large"], RELEASES, "WIDTHxHEIGHT"),
        (["--fps", "-3"], RELEASES, "frames per second"),
        (["--ice", "slush"], RELEASES, "slush"),
        ([], "throw,x,y,vx,vy,theta,omega\n", "contains no release"),
        ([], "throw,x,y\n0,0,0\n", "vx"),
        ([], None, "r.csv"),
    ],
)
def test_the_command_refuses_bad_input_in_one_line(curling, tmp_path, arguments, releases, message):
    if releases is not None:
        (tmp_path / "r.csv").write_text(releases)
    given = ["--ice", "standard", *arguments] if "--ice" not in arguments else arguments
    result = curling("film", "--releases", tmp_path / "r.csv", *given, "-o", tmp_path / "films")
    assert message in result.complaint
    assert not (tmp_path / "films").exists()


def test_the_command_needs_a_directory_it_can_write(curling, tmp_path):
    (tmp_path / "r.csv").write_text(RELEASES)
    (tmp_path / "films").write_text("a file")
    result = curling(
        "film", "--ice", "standard", "--releases", tmp_path / "r.csv", "-o", tmp_path / "films"
    )
    assert "a file is in its place" in result.complaint


def test_the_command_replaces_no_film_of_ones_own(curling, tmp_path):
    (tmp_path / "r.csv").write_text(RELEASES)
    own = tmp_path / "side-0.mp4"
    own.write_bytes(b"\0\0\0\x20ftypisom, and what a camera took")
    result = curling(
        *("film", "--ice", "standard", "--releases", tmp_path / "r.csv", "--camera", "side"),
        *("--size", "192x108", "--fps", 10, "--no-people", "-o", tmp_path),
    )
    assert "side-0.mp4: is a film of your own and is not replaced" in result.complaint


def test_the_command_refuses_thousands_of_films(curling, tmp_path):
    rows = "".join(f"{k},0,-10.9725,0,2.1,0,1.5\n" for k in range(1001))
    (tmp_path / "r.csv").write_text("throw,x,y,vx,vy,theta,omega\n" + rows)
    result = curling(
        "film", "--ice", "standard", "--releases", tmp_path / "r.csv", "-o", tmp_path / "films"
    )
    assert "r.csv: has 1001 throws; expected at most 1000" in result.complaint
    assert not (tmp_path / "films").exists()
