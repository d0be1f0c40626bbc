"""Interrupted work goes on where it was, and never with tracks that were made otherwise."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from types import SimpleNamespace

import numpy as np
import pytest

from curling_env.errors import InputError
from curling_env.trajectory import Trajectory, read_tracks, write_tracks
from friction_estimation import tracking
from friction_estimation.synthetic import named_camera, scene_of
from friction_estimation.tracking import Checkpoints, FilmTrack, track_each, track_films


@pytest.fixture
def film(tmp_path):
    path = tmp_path / "end.mp4"
    path.write_bytes(b"a film")
    return path


def track(throw=0):
    t = np.arange(5) / 30
    return Trajectory(t=t, xy=np.column_stack([0 * t, t]), throw=throw)


def tracked_film(throw=0):
    """Track as the built-in tracker returns it."""
    path = Trajectory(**{**track(throw).__dict__, "sigma_xy": np.full(5, 0.01)})
    return FilmTrack(
        trajectory=path,
        frame=np.arange(5),
        velocity=np.zeros((5, 2)),
        spin=np.zeros(5),
        frame_count=9,
        camera=SimpleNamespace(size=(120, 600)),
        appearance=SimpleNamespace(has_handle=False),
        refined=SimpleNamespace(measured=0, height_uncertainty=0.0),
    )


def test_kept_tracks_are_read_back_to_the_last_bit_until_they_are_deleted(tmp_path):
    kept = track()
    kept.xy[:] += np.pi / 1e6
    before = Checkpoints(tmp_path / "tracks.csv")
    assert before.load("key") is None
    before.save("key", [kept], {"frames": 7})
    again = Checkpoints(tmp_path / "tracks.csv")
    assert again.load("key") == ([kept], {"frames": 7})
    assert again.load("another key") is None
    assert Checkpoints(tmp_path / "other.csv").load("key") is None
    again.delete()
    assert again.load("key") is None
    assert not again.folder.exists()


@pytest.mark.parametrize("changed", ["nothing", "film", "scene", "options", "tracker"])
def test_tracks_of_another_film_or_made_with_other_options_are_not_used(tmp_path, film, changed):
    scene = scene_of(named_camera("gantry", (640, 360)))
    tracked, missing = [], tmp_path / "later.mp4"

    def made_with(path, scene, *, progress, flow):
        if not path.exists():
            raise InputError("no such film", source=path)
        tracked.append(path.name)
        return track()

    def another(path, scene, *, progress, flow):
        return made_with(path, scene, progress=progress, flow=flow)

    def run(function=made_with, flow="plain"):
        tracker = partial(function, flow=flow)
        films = [film, missing]
        return track_films(films, scene, tracker=tracker, resume_beside=tmp_path / "tracks.csv")

    with pytest.raises(InputError, match="no such film"):
        run()
    missing.write_bytes(b"a film")
    if changed == "film":
        film.write_bytes(b"another film")
    if changed == "scene":
        scene = replace(scene, stone_radius=0.14 + 1e-12)
    given = {"options": {"flow": "pyramidal"}, "tracker": {"function": another}}
    assert len(run(**given.get(changed, {}))) == 2
    again = [] if changed == "nothing" else ["end.mp4"]
    assert tracked == ["end.mp4", *again, "later.mp4"]


@pytest.mark.parametrize("keep", [0, 100])
def test_a_half_written_file_is_not_used(tmp_path, keep):
    work = Checkpoints(tmp_path / "tracks.csv")
    work.save("key", [track()], {})
    (file,) = work.folder.iterdir()
    file.write_bytes(file.read_bytes()[:keep])
    assert work.load("key") is None


def test_the_command_goes_on_after_an_interruption(curling, tmp_path, monkeypatch):
    """The third of three films is missing at first; the others are not tracked again."""
    scene = tmp_path / "scene.json"
    scene.write_text(
        '{"corners_px": {"home_left": [10, 590], "home_right": [110, 590], '
        '"away_left": [10, 10], "away_right": [110, 10]}}'
    )
    films = [tmp_path / f"{name}.mp4" for name in "abc"]
    for path in films[:2]:
        path.write_bytes(b"film")
    tracked = []
    whole = tracking.track_film

    def stand_in(path, scene, *, progress, options=None):
        if not path.exists():
            return whole(path, scene, options=options, progress=progress)
        tracked.append(path.name)
        return tracked_film()

    monkeypatch.setattr(tracking, "track_film", stand_in)
    call = ("track", *films, "--scene", scene, "-o", tmp_path / "tracks.csv")
    stopped = curling(*call)
    assert stopped.status == 2
    assert "c.mp4: no such film" in stopped.err
    assert not (tmp_path / "tracks.csv").exists()
    films[2].write_bytes(b"film")
    done = curling(*call)
    assert done.status == 0, done.err
    assert tracked == ["a.mp4", "b.mp4", "c.mp4"]
    assert done.err.count("tracked before the interruption") == 2
    assert [k.throw for k in read_tracks(tmp_path / "tracks.csv")] == [0, 1, 2]
    assert [entry["frames"] for entry in done.json()] == [9, 9, 9]
    assert not any(path.suffix == ".unfinished" for path in tmp_path.iterdir())


def test_what_is_kept_of_another_scene_never_stands_in_the_way(curling, tmp_path, monkeypatch):
    """The second film is damaged at first, and then the scene is corrected."""
    scene = tmp_path / "scene.json"
    corners = (
        '{{"corners_px": {{"home_left": [{}, 590], "home_right": [110, 590], '
        '"away_left": [10, 10], "away_right": [110, 10]}}}}'
    )
    scene.write_text(corners.format(10))
    films = [tmp_path / f"{name}.mp4" for name in "ab"]
    films[0].write_bytes(b"film")
    films[1].write_bytes(b"cut")
    tracked = []

    def stand_in(path, scene, *, progress, options=None):
        if path.read_bytes() == b"cut":
            raise InputError("is no film", source=path)
        tracked.append(path.name)
        return tracked_film()

    monkeypatch.setattr(tracking, "track_film", stand_in)
    call = ("track", *films, "--scene", scene, "-o", tmp_path / "tracks.csv")
    refused = curling(*call).complaint
    assert "b.mp4: is no film" in refused
    assert f"is kept in {tmp_path / 'tracks.csv.unfinished'}; repeat the command" in refused
    films[1].write_bytes(b"film")
    scene.write_text(corners.format(11))
    done = curling(*call)
    assert done.status == 0, done.err
    assert tracked == ["a.mp4", "a.mp4", "b.mp4"]
    assert not any(path.suffix == ".unfinished" for path in tmp_path.iterdir())


def test_estimate_takes_films_of_two_cameras(curling, sliding, tmp_path, monkeypatch):
    """Each film has its scene; films tracked before an interruption are not tracked again."""
    rng = np.random.default_rng(3)
    thrown = sliding.measured_throws(sliding.uniform(0.0085), sliding.varied_starts(rng, 2), rng)
    scenes = [tmp_path / f"{name}.json" for name in "ab"]
    for k, path in enumerate(scenes):
        path.write_text(
            f'{{"corners_px": {{"home_left": [1{k}, 590], "home_right": [110, 590], '
            '"away_left": [10, 10], "away_right": [110, 10]}}'
        )
    films = [tmp_path / f"{name}.mp4" for name in "ab"]
    films[0].write_bytes(b"film")
    whole, tracked = tracking.track_film, []

    def stand_in(path, scene, *, progress):
        if not path.exists():
            return whole(path, scene, progress=progress)
        tracked.append(path.name)
        return thrown[films.index(path)]

    monkeypatch.setattr(tracking, "track_film", stand_in)
    ice = tmp_path / "ice.json"
    call = ("estimate", *films, "--scene", scenes[0], "--scene", scenes[1], "-o", ice, "--uniform")
    assert "no such film" in curling(*call).err
    assert not ice.exists()
    films[1].write_bytes(b"film")
    done = curling(*call)
    assert done.status == 0, done.err
    assert tracked == ["a.mp4", "b.mp4"]
    assert done.json()["mu"] == pytest.approx(0.0085, rel=0.005)
    assert not any(path.suffix == ".unfinished" for path in tmp_path.iterdir())
    three = curling("estimate", *films, films[0], *call[3:])
    assert three.status == 2
    assert "expected one scene for all 3 films or one for each, got 2" in three.err
    table = tmp_path / "tracks.csv"
    write_tracks(table, thrown)
    for option, value in (("--scene", scenes[0]), ("--slow", 4)):
        assert "applies to films" in curling("estimate", table, option, value, "-o", ice).err


def test_a_missing_film_is_reported_before_any_is_tracked(tmp_path):
    (tmp_path / "0.mp4").write_text("no film, which would be reported first")
    with pytest.raises(InputError, match=r"1\.mp4: no such film"):
        track_each([tmp_path / "0.mp4", tmp_path / "1.mp4"], [None, None])
