"""Logs of light gates: throws found among people, faulty rows, and the evidence of times on the
ice.

The logs are written by the tests from throws that the engine slides, with gates that stand a little
off their lines, beams of several heights, and noise.
"""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

from curling_env.errors import InputError, TrackTooShortError
from curling_env.ice import Ice, load_ice
from curling_env.trajectory import Trajectory, read_tracks, write_tracks
from friction_estimation import discover, estimate_ice
from friction_estimation.comparison import compare_gate_times
from friction_estimation.discovery.discover import Discovery
from friction_estimation.reports import headline
from friction_estimation.tracks import free_slides, measure_throw, read_gates

SIGMA = 0.003
EFFECT = "speed_dependent_friction"


def people(rng, throws):
    """Return sensor, start and end of beams broken by people and by stones that are pushed back."""
    rows = []
    for k in range(throws):
        at = 1e3 + 60 * k + 32
        for name in rng.choice(["T-Line 1", "T-Line 2", "Hog-Line 1", "Hog-Line 2"], 3):
            at += rng.uniform(2.0, 5.0)
            rows.append((name, at, at + rng.uniform(0.05, 0.9)))
    return rows


@pytest.fixture(scope="module")
def session(gates, tmp_path_factory):
    """Return two dozen throws on the standard ice, as tracks, and their file."""
    rng = np.random.default_rng(5)
    path = tmp_path_factory.mktemp("gates") / "gates.csv"
    gates.write(path, gates.log(load_ice("standard"), rng))
    return path, read_gates(path, SIGMA).tracks


def test_throws_are_found_among_people(gates, tmp_path):
    rng = np.random.default_rng(1)
    rows = gates.log(load_ice("standard"), rng)
    path = gates.write(tmp_path / "gates.csv", sorted(rows + people(rng, 24), key=lambda r: -r[1]))
    found = read_gates(path, SIGMA)
    assert len(found.tracks) == 24
    assert not found.faults
    # A person may pass the near tee line as a stone would.
    assert len(found.unused) >= 24 * 3 - 4
    for k, track in enumerate(found.tracks):
        forward = 1 if k % 2 == 0 else -1
        assert forward * (track.xy[-1, 1] - track.xy[0, 1]) > 20
        assert track.clock == pytest.approx(60 * k, abs=3)


def test_the_file_of_tracks_has_times_without_x(session, tmp_path):
    _, tracks = session
    path = tmp_path / "tracks.csv"
    write_tracks(path, tracks)
    assert read_tracks(path) == tracks
    header, first = path.read_text().splitlines()[:2]
    assert header == "throw,t,x,y,theta,stone,clock,swept,sigma_xy,sigma_t"
    assert first.split(",")[2] == ""


@pytest.mark.parametrize(
    ("rows", "problem"),
    [
        ("0,1,,2,\n", "only gate times, with sigma_t, have no x"),
        ("0,1,,2,0.003\n0,2,1,3,\n", "missing in some rows of a throw"),
    ],
)
def test_a_camera_sees_x(tmp_path, rows, problem):
    path = tmp_path / "tracks.csv"
    path.write_text("throw,t,x,y,sigma_t,theta\n" + rows.replace("\n", ",\n"))
    with pytest.raises(InputError, match=problem):
        read_tracks(path)


def test_faulty_rows_are_reported_by_their_numbers(session, tmp_path):
    source, tracks = session
    lines = source.read_text().splitlines()
    faulty = [
        "Camera 1,0.1,0,0,5,5.1,",
        "T-Line 1,0.1,0,0,,5.1,",
        "T-Line 2,-0.1,0,0,5,4.9,",
        "T-Line 1,0.2,0,0,20,20.9,",
        "Hog-Line 1,9999,0,0,1,10000,",
        "Hog-Line 2,x,0,0,7,7.1,",
    ]
    path = tmp_path / "gates.csv"
    path.write_text("\n".join([lines[0], *faulty, *lines[1:]]) + "\n")
    found = read_gates(path, SIGMA)
    assert [fault.split(":")[0] for fault in found.faults] == [f"row {k}" for k in range(2, 8)]
    for fault, words in zip(
        found.faults,
        (
            "unknown sensor 'Camera 1'",
            "numbers",
            "End is not after Start",
            "Break",
            "lasts",
            "Break",
        ),
        strict=True,
    ):
        assert words in fault
    assert len(found.tracks) == len(tracks)


def test_rows_that_are_there_twice_count_once(session, tmp_path):
    source, tracks = session
    header, *lines = source.read_text().splitlines()
    path = tmp_path / "gates.csv"
    path.write_text("\n".join([header, *lines, *lines]) + "\n")
    found = read_gates(path, SIGMA)
    assert len(found.tracks) == len(tracks)
    assert len(found.faults) == len(lines)
    assert all("repeats row" in fault for fault in found.faults)
    for one, other in zip(found.tracks, tracks, strict=True):
        assert np.array_equal(one.t, other.t)


def test_a_gate_that_fails_costs_its_times_only(session, tmp_path):
    """Without the far hog line there is no throw; without a tee line it has fewer times."""
    source, tracks = session
    header, *lines = source.read_text().splitlines()
    path = tmp_path / "gates.csv"
    tee = [line for line in lines if not line.startswith("T-Line")]
    path.write_text("\n".join([header, *tee]) + "\n")
    assert [len(track) for track in read_gates(path, SIGMA).tracks] == [4] * len(tracks)
    rng = np.random.default_rng(0)
    some = [line for line in lines if rng.random() > 0.1]
    path.write_text("\n".join([header, *some]) + "\n")
    found = read_gates(path, SIGMA)
    assert 0.6 * len(tracks) < len(found.tracks) < len(tracks)
    for track in found.tracks:
        assert any(abs(track.clock - other.clock) < 4 for other in tracks)


@pytest.mark.parametrize(
    ("content", "problem"),
    [
        ("Sensor,Start,End\n", "no stone passes both hog lines"),
        ("Sensor,Start,End\nHog-Line 1,1,1.1\n", "no stone passes both hog lines"),
        ("Sensor,Start\nHog-Line 1,1\n", "End"),
    ],
)
def test_a_log_without_throws_is_refused(tmp_path, content, problem):
    path = tmp_path / "gates.csv"
    path.write_text(content)
    with pytest.raises(InputError, match=problem):
        read_gates(path, SIGMA)


def test_splits_are_those_of_the_gates(session):
    _, (first, *_) = session
    found = measure_throw(first)
    assert found.hog_to_hog.value == pytest.approx(first.t[4:6].mean() - first.t[2:4].mean())
    assert found.hog_to_hog.sigma == pytest.approx(SIGMA)
    assert found.tee_to_hog is not None
    assert found.speed is None
    with pytest.raises(TrackTooShortError, match="light gates, which measure no path"):
        free_slides([first])


def without(ice: Ice, name: str) -> Ice:
    return replace(ice, effects=tuple(e for e in ice.effects if e.name != name))


@pytest.mark.parametrize("follows_speed", [True, False])
def test_friction_and_how_it_follows_the_speed_are_found_within_their_errors(
    gates, tmp_path, follows_speed
):
    """Beams of another height than assumed do not count as friction."""
    ice = load_ice("standard") if follows_speed else without(load_ice("standard"), EFFECT)
    exponent = 0.25 if follows_speed else 0.0
    off = []
    for seed in range(8):
        rng = np.random.default_rng(seed)
        width = rng.uniform(0.25, 0.29)
        path = gates.write(tmp_path / "gates.csv", gates.log(ice, rng, width=width))
        found = estimate_ice(read_gates(path, SIGMA).tracks)
        effect = found.ice.effect(EFFECT)
        assert effect is not None
        assert effect.sigma["exponent"] < 0.06
        assert "exponent" not in effect.believed
        off.append(
            (
                (effect.parameters["exponent"] - exponent) / effect.sigma["exponent"],
                np.log(found.mu / ice.friction.mu.mean()) / (found.sigma / found.mu),
            )
        )
    assert np.abs(off).max() < 3.2
    assert (np.sqrt(np.mean(np.square(off), axis=0)) < 1.7).all()


def test_effects_that_gates_do_not_show_are_assumed(session):
    _, tracks = session
    found = estimate_ice(tracks)
    curl = found.ice.effect("curl")
    assert curl is not None
    assert "strength" in curl.believed
    assert any("place to place" in remark for remark in found.remarks)
    assert re.fullmatch(
        r"This ice is of usual speed: μ = 0\.008\d\d ± 0\.000\d\d at 1 m/s, and friction goes with "
        r"the speed as v\^\(−0\.\d\d ± 0\.0\d\)\.",
        headline(found),
    )
    assert found.ice.friction.is_uniform
    few, many = estimate_ice(tracks[:2]).ice.effect(EFFECT), found.ice.effect(EFFECT)
    assert few is not None
    assert many is not None
    assert few.sigma["exponent"] > many.sigma["exponent"]


def found_in(ice: Ice, gates, tmp_path, seed: int) -> Discovery:
    path = gates.write(tmp_path / "gates.csv", gates.log(ice, np.random.default_rng(seed)))
    return discover(read_gates(path, SIGMA).tracks)


@pytest.mark.parametrize("seed", [2, 3])
def test_discovery_names_friction_that_follows_the_speed(gates, tmp_path, seed):
    found = found_in(load_ice("standard"), gates, tmp_path, seed)
    assert [effect.label for effect in found.effects] == [EFFECT]
    assert not found.unknown
    assert found.gaps["after"].rest_error < found.gaps["before"].rest_error


@pytest.mark.parametrize("seed", [2, 3])
def test_discovery_names_nothing_where_there_is_nothing(gates, tmp_path, seed):
    found = found_in(Ice.uniform(0.0085), gates, tmp_path, seed)
    assert not found.effects
    assert not found.unknown


def test_throws_are_compared_at_equal_times_from_hog_line_to_hog_line(session):
    _, tracks = session
    compared = compare_gate_times(tracks, load_ice("standard"))
    right = compared.summary()["directions"]
    wrong = compare_gate_times(tracks, Ice.uniform(0.002)).summary()["directions"]
    mean = np.mean([means["kept_less_predicted"] for means in right.values()])
    assert abs(mean) < 0.02
    for direction in ("away", "home"):
        assert right[direction]["throws"] == 12
        assert wrong[direction]["kept_less_predicted"] < -0.1
        assert abs(right[direction]["hog_to_tee_less_predicted_s"]) < 0.1
    kept, predicted = (
        np.mean([right[way][name] for way in ("away", "home")])
        for name in ("kept", "predicted_kept")
    )
    assert compared.in_words() == (
        f"24 throws kept {kept:.2f} of their speed from hog line to hog line, and would keep "
        f"{predicted:.2f} on this ice"
    )


def test_ice_of_a_club_keeps_less_speed_than_championship_ice(gates, tmp_path):
    """Two real evenings differ from `standard` by −0.03 in the mean of both directions."""
    path = gates.write(tmp_path / "g.csv", gates.log(load_ice("club"), np.random.default_rng(4)))
    tracks = read_gates(path, SIGMA).tracks
    off = {}
    for ice in ("club", "standard"):
        directions = compare_gate_times(tracks, load_ice(ice)).summary()["directions"].values()
        off[ice] = np.mean([means["kept_less_predicted"] for means in directions])
    assert abs(off["club"]) < 0.015
    assert 0.025 < off["club"] - off["standard"] < 0.04


def test_a_session_is_of_gates_or_of_a_camera(session, filmed, rng):
    _, tracks = session
    track, _ = filmed(rng)
    with pytest.raises(InputError, match="throw 99 was seen by a camera"):
        estimate_ice([*tracks, replace(track, throw=99)])


def test_a_throw_past_one_gate_shows_nothing(session):
    _, tracks = session
    first = tracks[0]
    short = Trajectory(
        t=first.t[:4], xy=first.xy[:4], sigma_t=first.sigma_t[:4], throw=77, clock=1.0
    )
    found = estimate_ice([*tracks, short])
    assert any("throw 77 has 2 gate times" in reason for reason in found.skipped)
    with pytest.raises(TrackTooShortError, match="needs 3"):
        estimate_ice([short])


# --- the commands ---------------------------------------------------------------------------------


def test_a_log_is_converted_estimated_compared_and_searched(session, tmp_path, curling):
    source, tracks = session
    log = tmp_path / "gates.csv"
    log.write_text(source.read_text() + "Door,1,0,0,1,2,\n")
    throws = tmp_path / "tracks.csv"
    done = curling("convert", log, "-o", throws)
    assert done.status == 0, done.err
    assert done.json()["throws"] == len(tracks)
    assert "unknown sensor 'Door'" in done.json()["faulty_rows"][0]
    assert "dropped: row " in done.err
    ice = tmp_path / "ice.json"
    done = curling("estimate", throws, "-o", ice)
    assert done.status == 0, done.err
    assert done.json()["throws"] == len(tracks)
    more = curling("estimate", throws, "--update", ice, "-o", ice)
    assert more.status == 0, more.err
    done = curling("compare", throws, "--ice", ice, "-o", tmp_path / "compared")
    assert done.status == 0, done.err
    assert set(done.json()["directions"]) == {"away", "home"}
    assert (tmp_path / "compared" / "throws.csv").read_text().startswith("throw,direction,")
    done = curling("discover", throws, "-o", tmp_path / "found")
    assert done.status == 0, done.err
    assert [effect["name"] for effect in done.json()["effects"]] == [EFFECT]
    assert "the last gate" in done.json()["verdict"]
    assert any("need tracks from film" in remark for remark in done.json()["remarks"])
    assert done.json()["next_throws"] == []  # gates see neither lines nor handles
    assert (tmp_path / "found" / "report.html").exists()


@pytest.mark.parametrize(
    ("options", "problem"),
    [
        (("--report", "page"), "light gates do not measure"),
        (("--method", "paper"), "light gates do not measure"),
    ],
)
def test_options_that_need_paths_are_refused(session, tmp_path, curling, options, problem):
    _, tracks = session
    throws = tmp_path / "tracks.csv"
    write_tracks(throws, tracks)
    done = curling("estimate", throws, "-o", tmp_path / "ice.json", *options)
    assert done.status == 2
    assert problem in done.err
    assert done.err.count("\n") == 1
    assert not (tmp_path / "ice.json").exists()
