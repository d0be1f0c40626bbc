"""Cameras on one throw joined: throws from a generator that shares no code with the estimator."""

from __future__ import annotations

import numpy as np
import pytest

from curling_env.errors import InputError
from curling_env.trajectory import Trajectory
from friction_estimation.tracks import join_cameras
from friction_estimation.tracks.other_stones import other_stones

BIAS = 0.002
"""Standard deviation of a camera's systematic error in each coordinate [m]."""
OVERLAPPING = ((-22.0, -3.0), (-5.0, 8.0), (6.0, 22.0))
APART = ((-22.0, -5.0), (8.0, 22.0))


@pytest.fixture(scope="module")
def throws(sliding):
    """Draws, seen to rest, without noise: friction varies along each sheet, and they curl."""
    rng = np.random.default_rng(8)
    starts = np.array([[0.1, -10.9725, 0.02, 2.2, 1.3]])
    return [
        sliding.measured_throws(
            sliding.random_field(rng, mu=0.0095, spread=0.05, length=4.0),
            starts,
            rng,
            noise=0.0,
            curl=0.006,
        )[0]
        for _ in range(4)
    ]


@pytest.fixture(scope="module")
def throw(throws):
    return throws[0]


def seen(throw, stretch, rng, clock=0.0, turns=0):
    """Return one camera's view of a stretch of the sheet, on its own clock."""
    rows = (throw.xy[:, 1] > stretch[0]) & (throw.xy[:, 1] < stretch[1])
    xy = throw.xy[rows] + rng.normal(0, BIAS, 2) + rng.normal(0, 0.001, (rows.sum(), 2))
    return Trajectory(
        t=throw.t[rows] - clock,
        xy=xy,
        theta=throw.theta[rows] - 2 * np.pi * turns,
        sigma_xy=np.full(rows.sum(), np.hypot(BIAS, 0.001)),
        sigma_theta=np.full(rows.sum(), 0.01),
    )


def truth_at(throw, t):
    return np.column_stack([np.interp(t, throw.t, throw.xy[:, k]) for k in range(2)])


def test_overlapping_cameras_synchronise_their_clocks_to_milliseconds(throw):
    rng = np.random.default_rng(1)
    clocks = (0.0, 11.37, -4.21)
    tracks = [
        seen(throw, stretch, rng, clock, turns)
        for stretch, clock, turns in zip(OVERLAPPING, clocks, (0, 2, -1), strict=True)
    ]
    joined = join_cameras(tracks)
    assert joined.order == (0, 1, 2)
    assert joined.gaps == ()
    assert joined.bridge is None
    assert joined.offset == pytest.approx(clocks, abs=0.006)
    off = joined.trajectory.xy - truth_at(throw, joined.trajectory.t)
    assert np.sqrt(np.mean(np.sum(off**2, axis=1))) < 0.008
    turned = joined.trajectory.theta - np.interp(joined.trajectory.t, throw.t, throw.theta)
    assert np.abs(turned).max() < 0.1  # one heading, unwrapped, through all cameras


def test_a_gap_is_bridged_and_its_sigma_is_honest(throws):
    misses, clocks = [], []
    for seed in range(8):
        rng, throw = np.random.default_rng(100 + seed), throws[seed % len(throws)]
        clock = rng.uniform(-30, 30)
        tracks = [seen(throw, APART[1], rng, clock), seen(throw, APART[0], rng)]
        joined = join_cameras(tracks)  # in any order
        assert joined.order == (1, 0)
        assert joined.offset_sigma[1] == 0.0
        clocks.append((joined.offset[0] - clock) / joined.offset_sigma[0])
        middle = joined.bridge.t[len(joined.bridge) // 2]
        off = truth_at(throw, np.array([middle])) - joined.whole.xy[joined.whole.t == middle]
        misses.append(off[0] / joined.bridge.sigma_xy[len(joined.bridge) // 2])
        assert 0.002 < joined.bridge.sigma_xy.max() < 0.15
        assert (np.diff(joined.whole.t) > 0).all()
    assert np.sqrt(np.mean(np.square(clocks))) < 1.5
    assert np.sqrt(np.mean(np.square(misses))) < 1.5


def test_clocks_that_agree_are_left_alone(throw):
    rng = np.random.default_rng(3)
    joined = join_cameras([seen(throw, stretch, rng) for stretch in OVERLAPPING])
    assert np.abs(joined.offset).max() < 0.006
    assert np.abs(joined.offset / np.maximum(joined.offset_sigma, 1e-3)).max() < 3


def test_rows_of_a_camera_include_the_uncertainty_of_its_clock(throw):
    rng = np.random.default_rng(4)
    track = join_cameras([seen(throw, stretch, rng, 2.0) for stretch in APART]).trajectory
    early, late = track.xy[:, 1] < 0, (track.xy[:, 1] > 8) & (track.xy[:, 1] < 10)
    assert np.median(track.sigma_xy[late]) > 1.5 * np.median(track.sigma_xy[early])


def test_films_of_different_throws_are_refused(throw, sliding):
    rng = np.random.default_rng(5)
    starts = np.array([[0.1, -10.9725, 0.02, 2.9, 1.3]])
    faster = sliding.measured_throws(sliding.uniform(0.0095), starts, rng, noise=0.0)[0]
    with pytest.raises(InputError, match="not of one throw"):
        join_cameras([seen(throw, APART[0], rng), seen(faster, APART[1], rng)])
    aside = Trajectory(t=throw.t, xy=throw.xy + np.array([0.6, 0.0]), theta=throw.theta)
    with pytest.raises(InputError, match="does not fit the others"):
        join_cameras([seen(throw, (-22, 5), rng), seen(aside, (-2, 22), rng)])


def test_one_camera_is_not_joined(throw):
    with pytest.raises(InputError, match="two or more cameras"):
        join_cameras([throw])


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ([], "expected the films of two or more cameras"),
        (["b.mp4", "c.mp4", "--scene", "a.json"], "all 3 films or one for each, got 2"),
    ],
)
def test_films_and_scenes_that_do_not_fit_are_refused(options, message, tmp_path, curling):
    from friction_estimation.camera import save_scene
    from friction_estimation.synthetic import named_camera, scene_of

    scene = str(tmp_path / "a.json")
    save_scene(scene_of(named_camera("ceiling")), scene)
    options = [scene if option == "a.json" else option for option in options]
    film = str(tmp_path / "a.mp4")
    assert message in curling("join-cameras", film, "--scene", scene, *options).complaint


def test_the_command_joins_films_and_reports_the_offset_of_their_clocks(
    throw, tmp_path, curling, monkeypatch
):
    """Following the stone is tested elsewhere: here the films' tracks are given."""
    import friction_estimation.tracking as tracking
    from curling_env.trajectory import read_tracks
    from friction_estimation.camera import save_scene
    from friction_estimation.synthetic import named_camera, scene_of

    rng = np.random.default_rng(6)
    tracks = {"home": seen(throw, APART[0], rng), "away": seen(throw, APART[1], rng, 7.5)}

    monkeypatch.setattr(tracking, "track_film", lambda film, scene, **_: tracks[film.stem])
    asked = []
    for name in tracks:
        camera = "ceiling" if name == "away" else "ceiling_home"
        save_scene(scene_of(named_camera(camera)), tmp_path / f"{name}.json")
        asked += ["--scene", str(tmp_path / f"{name}.json")]
    films = [str(tmp_path / f"{name}.mp4") for name in tracks]
    output = tmp_path / "tracks.csv"
    done = curling("join-cameras", *films, *asked, "-o", output)
    assert done.status == 0, done.err
    document = done.json()
    assert document[1]["offset_s"] == pytest.approx(7.5, abs=4 * document[1]["offset_sigma_s"])
    plain = read_tracks(output)
    assert curling("join-cameras", *films, *asked, "--bridge", "-o", output).status == 0
    bridged = read_tracks(output)
    assert len(plain) == len(bridged) == 1
    assert np.diff(plain[0].t).max() > 2.0 > 0.1 > np.diff(bridged[0].t).max()


def lying(xy, stretch, clock=0.0, sigma=0.004):
    """Return an untouched stone in the first and in the last frame of a film."""
    xy = np.array([xy, xy])
    return Trajectory(t=np.array(stretch) - clock, xy=xy, sigma_xy=np.full(2, sigma))


def test_resting_stones_are_joined_too_each_of_them_once(throw):
    rng = np.random.default_rng(9)
    end = throw.t[-1] + 1
    views = [seen(throw, (-22.0, 3.0), rng), seen(throw, (-1.0, 22.0), rng, 7.5)]
    house, guard, far = [0.3, 17.0], [0.1, 1.0], [-0.6, 17.1]
    others = [
        [lying(guard, (-0.5, end))],
        [
            lying(house, (0.0, end), 7.5),
            lying(guard, (0.0, end), 7.5, 0.001),
            lying(far, (0.0, end), 7.5),
        ],
    ]
    joined = join_cameras(views)
    found = other_stones(others, joined)
    assert [origin for _, origin in found] == [(0, 0), (1, 0), (1, 2)]
    tracks = [track for track, _ in found]
    np.testing.assert_allclose([track.xy[0] for track in tracks], [guard, house, far])
    assert tracks[0].t[0] == pytest.approx(-0.5)  # as long as any camera saw it,
    assert tracks[0].sigma_xy.min() < 0.002  # and as well as any did
    assert tracks[1].t[-1] == pytest.approx(end, abs=0.02)  # on the first camera's clock


def test_a_stone_that_is_hit_before_two_cameras_is_one_stone(throw):
    rng = np.random.default_rng(10)
    views = [seen(throw, (-22.0, 3.0), rng), seen(throw, (-1.0, 22.0), rng, 7.5)]
    t = np.arange(4.0, 9.0, 0.1)
    moved = np.clip(t - 6.0, 0.0, None)
    xy = np.column_stack([0.1 * moved, 2.0 + 0.5 * moved])
    hit = Trajectory(t=t, xy=xy, sigma_xy=np.full(len(t), 0.004))
    here, there = lying([0.1, 1.9], (0.0, 12.0), 7.5), Trajectory(t=t - 7.5, xy=xy + 0.003)
    joined = join_cameras(views)
    assert len(other_stones([[hit], [there]], joined)) == 1
    assert len(other_stones([[hit], [here]], joined)) == 2
