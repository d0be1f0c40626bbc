"""`curling throw` and `curling simulate`."""

from __future__ import annotations

import re
import sys
from dataclasses import replace

import numpy as np
import pytest

from curling_env.ice import ActiveEffect, Ice, load_ice, save_ice
from curling_env.physics import slide
from curling_env.sheet import HOG_LINE_Y, PAPER_SHEET, TEE_Y, Direction
from curling_env.throw import Release, Throw, read_releases, write_releases
from curling_env.trajectory import read_tracks

# --- throw ----------------------------------------------------------------------------------------


def test_a_draw_to_the_tee_on_standard_ice(curling):
    shot = curling("throw", "--ice", "standard", "--speed", 2.099, "--spin", 1.0).json()
    assert shot["status"] == "rest"
    assert shot["y"] == pytest.approx(TEE_Y, abs=0.3)
    assert shot["curl_m"] == pytest.approx(-shot["x"])
    assert 1.1 < shot["curl_m"] < 1.5
    assert 13.0 < shot["hog_to_hog"] < 14.5
    assert 24 < shot["time"] < 25.5
    assert 2 < shot["turns"] < 4


def test_the_competitions_law_as_published(curling):
    # FCV1: 2.091 m/s, 1 rad/s stops at the tee after 24.32 s with 1.470 m of curl.
    shot = curling("throw", "--ice", "fcv1", "--speed", 2.091, "--spin", 1.0).json()
    assert shot["y"] == pytest.approx(TEE_Y, abs=0.01)
    assert shot["time"] == pytest.approx(24.32, abs=0.02)
    assert shot["hog_to_hog"] == pytest.approx(13.80, abs=0.02)
    assert shot["curl_m"] == pytest.approx(1.470, abs=0.01)
    assert shot["turns"] == pytest.approx(2.95, abs=0.02)


def test_uniform_coulomb_friction_agrees_with_the_textbook(curling):
    shot = curling("throw", "--ice", "paper", "--speed", 1.0).json()
    distance = 1.0 / (2 * 0.0019 * 9.80665)
    assert shot["y"] + HOG_LINE_Y == pytest.approx(distance, abs=1e-3)
    assert shot["time"] == pytest.approx(1.0 / (0.0019 * 9.80665), abs=0.05)
    assert shot["x"] == 0
    assert shot["turns"] == 0


def test_the_home_end_is_half_a_turn_away(curling):
    call = ("throw", "--ice", "standard", "--speed", 2, "--angle", 0.02, "--spin", -1, "--x", 0.2)
    away = curling(*call).json()
    home = curling(*call, "--direction", "home").json()
    assert home["x"] == pytest.approx(-away["x"], abs=1e-6)
    assert home["y"] == pytest.approx(-away["y"], abs=1e-6)
    assert home["curl_m"] == pytest.approx(away["curl_m"], abs=1e-6)
    assert away["curl_m"] < -1
    assert away["theta"] < 0 < away["turns"]


def test_a_throw_on_uncertain_ice_reports_the_spread_of_its_rest(curling, tmp_path, monkeypatch):
    ice = load_ice("standard")
    curl = replace(ice.effect("curl"), sigma={"strength": 4e-4})
    unsure = ice.without_effect("curl").with_effect(curl)
    save_ice(unsure, tmp_path / "ice.json")
    call = ("throw", "--ice", tmp_path / "ice.json", "--spin", 1.0, "--speed")
    result = curling(*call, 2.1)
    shot = result.json()
    # The way across grows with the strength of curl, of which 5 % are not known.
    assert shot["rest_sigma_x_m"] == pytest.approx(0.05 * shot["curl_m"], rel=0.1)
    assert shot["rest_sigma_y_m"] < 0.3 * shot["rest_sigma_x_m"]
    assert result.err == ""
    monkeypatch.setattr(sys.stdout, "isatty", lambda: True)
    assert re.search(r"by \d+ cm along the sheet and \d+ cm across", curling(*call, 2.1).out)
    gone = curling(*call, 4.0, "--json").json()
    assert gone["rest_sigma_x_m"] is gone["rest_sigma_y_m"] is None
    certain = curling("throw", "--ice", "standard", "--speed", 2.1, "--json").json()
    assert "rest_sigma_x_m" not in certain


def test_a_throw_on_ice_that_lacks_an_effect_warns(curling, tmp_path):
    save_ice(load_ice("standard").with_effect(ActiveEffect(name="unknown")), tmp_path / "ice.json")
    result = curling("throw", "--ice", tmp_path / "ice.json", "--speed", 2.1)
    assert result.json()["status"] == "rest"
    assert result.err.count("\n") == 1
    assert "lacks an effect" in result.err
    friction = load_ice("paper").friction
    bare = replace(friction, observed=np.zeros_like(friction.observed))
    save_ice(Ice(friction=bare), tmp_path / "bare.json")
    result = curling("throw", "--ice", tmp_path / "bare.json", "--speed", 1.5)
    assert "no stone curls" in result.err


@pytest.mark.parametrize(
    ("speed", "angle", "status"),
    [(1.5, 0, "hogged"), (3.0, 0, "out_back"), (2.1, 0.2, "out_side")],
)
def test_a_throw_that_does_not_stay_in_play(curling, speed, angle, status):
    shot = curling("throw", "--ice", "standard", "--speed", speed, "--angle", angle).json()
    assert shot["status"] == status
    assert (shot["hog_to_hog"] is None) == (status != "out_back")


@pytest.mark.parametrize(
    ("options", "says"),
    [
        (("--speed", 0), "speed must be above 0"),
        (("--speed", -2), "speed must be above 0"),
        (("--speed", "nan"), "speed must be above 0"),
        (("--speed", 50), "at most 6"),
        (("--speed", "fast"), "valid number"),
        (("--speed", 2, "--angle", 2), "angle must be within"),
        (("--speed", 2, "--angle", "nan"), "angle must be within"),
        (("--speed", 2, "--spin", 100), "spin must be within"),
        (("--speed", 2, "--x", 3), "inside the side lines"),
        (("--speed", 2, "--x", "inf"), "within ±100 m"),
        (("--speed", 2, "--direction", "up"), "direction"),
        ((), "speed"),
        (("--speed", 2, "--ice", "no-such"), "no such ice file"),
    ],
)
def test_an_impossible_throw_is_refused_in_one_line(curling, options, says):
    assert says in curling("throw", "--ice", "standard", *options).complaint


# --- simulate -------------------------------------------------------------------------------------


@pytest.fixture
def releases(tmp_path):
    path = tmp_path / "releases.csv"
    write_releases(
        path,
        [
            Throw(speed=2.1, angle=-0.05, spin=1.0).release(stone=3, clock=10.0),
            Throw(speed=2.0, spin=-1.5).release(Direction.HOME, stone=4, clock=70.0, sweep=(2, 9)),
            Throw(speed=3.5).release(stone=5, clock=130.0),
        ],
    )
    return path


def test_tracks_are_the_true_paths(curling, releases, tmp_path):
    out = tmp_path / "tracks.csv"
    run = curling("simulate", "--ice", "standard", "--releases", releases, "-o", out, "--fps", 25)
    assert run.status == 0
    assert run.out == ""
    tracks = read_tracks(out)
    assert [track.throw for track in tracks] == [0, 1, 2]
    assert [track.stone for track in tracks] == [3, 4, 5]
    assert [track.clock for track in tracks] == [10.0, 70.0, 130.0]
    for track, release in zip(tracks, read_releases(releases), strict=True):
        alone = slide(load_ice("standard"), release, fps=25).trajectory
        np.testing.assert_allclose(track.xy, alone.xy, atol=1e-5)
        np.testing.assert_allclose(np.diff(track.t)[:-1], 0.04, atol=2e-6)
    swept = tracks[1].swept == 1
    assert tracks[1].t[swept].min() == pytest.approx(2, abs=0.04)
    assert tracks[1].t[swept].max() == pytest.approx(9, abs=0.05)
    assert not tracks[0].swept.any()
    # The third one slides over the back line and on to the edge of the ice.
    edge = PAPER_SHEET.length / 2 - load_ice("standard").stone.radius
    assert tracks[2].xy[-1, 1] == pytest.approx(edge, abs=1e-4)


def test_more_samples_than_a_file_may_have_are_refused(curling, releases, tmp_path, monkeypatch):
    monkeypatch.setattr("curling_env.infrastructure.files.limits.MAX_ROWS", 100)
    run = curling("simulate", "--ice", "paper", "--releases", releases, "-o", tmp_path / "t.csv")
    assert "at 30 samples a second exceed 100 rows of tracks" in run.complaint
    assert not (tmp_path / "t.csv").exists()


def test_measurement_effects_do_not_move_stones(curling, releases, tmp_path):
    ice = load_ice("standard").with_effect(
        ActiveEffect(name="tracking_offset", parameters={"along": 0.05, "left": 0.02})
    )
    save_ice(ice, tmp_path / "ice.json")
    for name, known in (("a.csv", "standard"), ("b.csv", tmp_path / "ice.json")):
        out = tmp_path / name
        assert curling("simulate", "--ice", known, "--releases", releases, "-o", out).status == 0
    assert (tmp_path / "a.csv").read_bytes() == (tmp_path / "b.csv").read_bytes()


def test_throws_are_numbered_as_in_the_file_and_wear_the_ice_in_its_order(curling, tmp_path):
    ice = load_ice("paper").with_effect(ActiveEffect(name="pebble_wear", parameters={"rate": 0.05}))
    save_ice(ice, tmp_path / "ice.json")
    rows = [Release(x=0, y=-10.9725, vx=0, vy=0.9, throw=k) for k in (12, 7)]
    write_releases(tmp_path / "r.csv", rows)
    out = tmp_path / "tracks.csv"
    assert (
        curling(
            "simulate", "--ice", tmp_path / "ice.json", "--releases", tmp_path / "r.csv", "-o", out
        ).status
        == 0
    )
    end = {track.throw: track.xy[-1, 1] for track in read_tracks(out)}
    assert end[7] < end[12] - 0.5


def test_a_simulated_session_remembers_where_its_stones_went(curling, tmp_path):
    """The last stone's track is the same, but keener than it; the second to last is another."""
    effect = ActiveEffect(name="pebble_wear", parameters={"along_path": -0.05})
    save_ice(load_ice("paper").with_effect(effect), tmp_path / "ice.json")
    sides = (0.0, 0.0, 0.0, 1.9, 0.0)
    rows = [Release(x=x, y=-10.9725, vx=0, vy=0.9, throw=k) for k, x in enumerate(sides)]
    write_releases(tmp_path / "r.csv", rows)
    ends = {}
    for fps in ("5", "30"):
        out = tmp_path / "tracks.csv"
        known, thrown = tmp_path / "ice.json", tmp_path / "r.csv"
        run = curling("simulate", "--ice", known, "--releases", thrown, "-o", out, "--fps", fps)
        assert run.status == 0
        ends[fps] = [track.xy[-1, 1] for track in read_tracks(out)]
    first, second, third, aside, last = ends["5"]
    assert aside == first < second < third < last
    assert ends["5"] == ends["30"]


@pytest.mark.parametrize(
    ("row", "says"),
    [
        ("0,0,-11,0,2,0,1", None),
        ("0,0,-11,0,nan,0,1", "row 2, column vy"),
        ("0,0,-11,0,two,0,1", "row 2, column vy"),
        ("0,0,-11,0,9,0,1", "row 2: release speed must be at most"),
        ("0,0,-11,0,0,0,1", "row 2: a release needs a speed above 0"),
        ("0,3,-11,0,2,0,1", "throw 0: the stone starts off the ice"),
        ("0,0,-11,0,2,0,1\n0,0,-11,0,2,0,1", "row 3, column throw: throw 0 appears twice"),
        ("", "contains no release"),
    ],
)
def test_bad_releases_are_refused_with_their_place(curling, tmp_path, row, says):
    source, out = tmp_path / "r.csv", tmp_path / "tracks.csv"
    source.write_text(f"throw,x,y,vx,vy,theta,omega\n{row}\n")
    run = curling("simulate", "--ice", "paper", "--releases", source, "-o", out)
    if says is None:
        assert run.status == 0
        assert out.exists()
        return
    assert says in run.complaint
    assert "r.csv" in run.complaint
    assert sorted(tmp_path.iterdir()) == [source]


def test_a_missing_file_column_or_directory_is_named(curling, releases, tmp_path):
    run = curling("simulate", "--ice", "paper", "--releases", "nix.csv", "-o", tmp_path / "t.csv")
    assert "nix.csv" in run.complaint
    (tmp_path / "r.csv").write_text("throw,x,y\n0,0,0\n")
    run = curling(
        "simulate", "--ice", "paper", "--releases", tmp_path / "r.csv", "-o", tmp_path / "t.csv"
    )
    assert "vx" in run.complaint
    nowhere = tmp_path / "no" / "such" / "t.csv"
    run = curling("simulate", "--ice", "paper", "--releases", releases, "-o", nowhere)
    assert "no directory" in run.complaint
    for fps in ("0", "-5", "nan", "1e9"):
        run = curling(
            "simulate", "--ice", "paper", "--releases", releases, "-o", tmp_path / "t.csv",
            "--fps", fps,
        )  # fmt: skip
        assert "fps" in run.complaint
