"""Paths and their file."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from curling_env.errors import InputError
from curling_env.trajectory import Trajectory, read_tracks, write_tracks


def path(n: int = 50, **labels) -> Trajectory:
    t = np.arange(n) / 25
    return Trajectory(t=t, xy=np.column_stack([0.1 * t**2, 2 * t - 10]), theta=1.1 * t, **labels)


def test_tracks_survive_their_file(tmp_path):
    swept = (np.arange(50) > 20).astype(float)
    tracks = [
        path(throw=0, stone=3, clock=5.5, swept=swept),
        path(30, throw=1, stone=3, clock=70.0),
        path(30, throw=1, stone=8, clock=70.0),
    ]
    write_tracks(tmp_path / "t.csv", tracks)
    assert read_tracks(tmp_path / "t.csv") == [
        replace(k, xy=np.round(k.xy, 5), t=np.round(k.t, 6), theta=np.round(k.theta, 5))
        for k in tracks
    ]


def test_standard_errors_are_kept_where_there_are_any(tmp_path):
    measured = path(20, sigma_xy=np.full(20, 0.005), throw=0)
    write_tracks(tmp_path / "t.csv", [measured, path(20, throw=1)])
    first, second = read_tracks(tmp_path / "t.csv")
    assert first.sigma_xy == pytest.approx(0.005)
    assert second.sigma_xy.size == 0


def test_unknown_headings_are_empty_cells(tmp_path):
    bare = Trajectory(t=np.arange(3.0), xy=np.zeros((3, 2)))
    assert np.isnan(bare.theta).all()
    write_tracks(tmp_path / "t.csv", [bare])
    assert ",nan" not in (tmp_path / "t.csv").read_text()
    assert read_tracks(tmp_path / "t.csv") == [bare]


def headings(tmp_path, times, thetas):
    rows = [f"0,{t},0,{t},{theta}" for t, theta in zip(times, thetas, strict=True)]
    (tmp_path / "t.csv").write_text("\n".join(["throw,t,x,y,theta", *rows]))
    return tmp_path / "t.csv"


@pytest.mark.parametrize("jump", [1e23, -300.0, 40.0])
def test_a_heading_that_jumps_is_refused(tmp_path, jump):
    turning = [1.2 * k / 30 for k in range(20)]
    turning[11] += jump
    file = headings(tmp_path, [k / 30 for k in range(20)], turning)
    with pytest.raises(InputError) as refused:
        read_tracks(file)
    assert refused.value.where == "row 13, column theta"
    assert "jumps" in str(refused.value) or "expected a number" in str(refused.value)


def test_a_heading_may_turn_on_where_it_was_not_seen(tmp_path):
    # 3 rad/s over 20 s in which no row tells it: more than any turn between two frames.
    file = headings(tmp_path, [0, 0.1, 10, 20, 20.1], [0, 0.3, "", 60, 60.3])
    assert np.nanmax(read_tracks(file)[0].theta) == pytest.approx(60.3)


def test_tracks_come_back_in_order_of_play(tmp_path):
    write_tracks(tmp_path / "t.csv", [path(throw=7), path(throw=2)])
    assert [track.throw for track in read_tracks(tmp_path / "t.csv")] == [2, 7]


def test_lengths_and_velocities():
    track = path(200)
    assert track.duration == pytest.approx(199 / 25)
    np.testing.assert_allclose(track.velocity[1:-1, 1], 2.0)
    np.testing.assert_allclose(track.velocity[1:-1, 0], 0.2 * track.t[1:-1], atol=1e-9)
    assert track.path_length[0] == 0
    assert (np.diff(track.path_length) >= 0.08 - 1e-9).all()


def test_equality_looks_at_every_sample():
    a, b = path(), path()
    assert a == b
    b.xy[3, 0] += 1e-6
    assert a != b
    assert a != path(stone=1)
    assert a != "a path"


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"xy": np.zeros((4, 2))}, "xy of shape"),
        ({"theta": np.zeros(4)}, "theta"),
        (
            {"t": np.array([0.0, 2.0, 1.0]), "xy": np.zeros((3, 2)), "theta": np.zeros(3)},
            "sample 2",
        ),
        ({"t": np.zeros(3), "xy": np.zeros((3, 2)), "theta": np.zeros(3)}, "increase"),
        ({"xy": np.full((50, 2), np.nan)}, "finite"),
    ],
)
def test_an_invalid_path_is_refused(change, says):
    with pytest.raises(InputError, match=says):
        replace(path(), swept=np.empty(0), **change)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("throw,t,x,y\n0,0,0,0\n", "theta"),
        ("throw,t,x,y,theta\n", "no rows"),
        ("throw,t,x,y,theta\n0,0,0,0,0\n0,0.1,nan,0,0\n", "row 3, column x"),
        ("throw,t,x,y,theta\n0,0,0,0,0\n0,0.1,abc,0,0\n", "row 3, column x"),
        ("throw,t,x,y,theta\n0,1,0,0,0\n0,0.5,0,0,0\n", "row 3, column t"),
        ("throw,t,x,y,theta\n0,0,0,0,0\n1,0,0,0,0\n0,1,0,0,0\n", "row 4"),
        ("throw,t,x,y,theta\n0.5,0,0,0,0\n", "row 2, column throw"),
        ("throw,t,x,y,theta\n0,0,0,0,0\n0,1e-9,0,1,0\n0,2e-9,0,2,0\n", "row 4, column t: 2 m"),
    ],
)
def test_bad_files_are_refused_with_the_place(tmp_path, text, says):
    (tmp_path / "t.csv").write_text(text)
    with pytest.raises(InputError, match=says):
        read_tracks(tmp_path / "t.csv")
