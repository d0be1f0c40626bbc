"""A camera that is filming now: throws are cut from the stream and tracked one by one."""

from __future__ import annotations

import numpy as np
import pytest

from curling_env.errors import InputError
from curling_env.ice import Ice
from curling_env.physics.slide import slide
from curling_env.throw import Throw
from curling_env.trajectory import read_tracks
from friction_estimation.live import LONGEST, QUIET, Recorder, follow, frames_of
from friction_estimation.scene import save_scene
from friction_estimation.synthetic import FilmSpec, Stage, on_film, scene_of, write_film
from friction_estimation.video import Film, is_stream, save_times

FPS = 20.0
WHOLE = (slice(0, 60), slice(0, 160))


def picture(at=None):
    frame = np.full((60, 160, 3), 220, dtype=np.uint8)
    if at is not None:
        frame[25:35, at : at + 10] = 60
    return frame


def recorded(tmp_path, frames):
    """The clips that a recorder makes of a list of frames, the last one included."""
    recorder = Recorder(region=WHOLE, folder=tmp_path, fps=FPS)
    clips = [recorder.take(i / FPS, frame) for i, frame in enumerate(frames)]
    return [clip for clip in [*clips, recorder.finish()] if clip is not None]


def still(seconds, at=None):
    return [picture(at)] * int(seconds * FPS)


def moving(seconds):
    return [picture(2 + i % 140) for i in range(int(seconds * FPS))]


@pytest.mark.parametrize(
    ("source", "stream"),
    [
        ("0", True),
        ("12", True),
        ("rtsp://rink/1", True),
        ("http://a/b.mjpg", True),
        ("end-0.mp4", False),
        ("/films/0", False),
        ("C:/films/end.mp4", False),
    ],
)
def test_numbers_and_addresses_are_streams_and_files_are_not(source, stream):
    assert is_stream(source) == stream


def test_every_motion_between_two_quiets_is_one_film(tmp_path):
    frames = [*still(6), *moving(3), *still(QUIET + 2), *moving(2), *still(1)]
    clips = recorded(tmp_path, frames)
    assert [clip.path.name for clip in clips] == ["throw-000.mp4", "throw-001.mp4"]
    assert {path.name for path in tmp_path.iterdir()} == {
        name for clip in clips for name in (clip.path.name, clip.path.name + ".times.csv")
    }
    first = Film.open(clips[0].path)
    assert clips[0].clock < 6.0 < clips[0].clock + first.frame_count / FPS
    # Something of the quiet before is kept, and no more than was wanted of the quiet after.
    assert 3 + QUIET < first.frame_count / FPS < 3 + QUIET + 4.5


def test_nothing_is_kept_of_ice_on_which_nothing_moves(tmp_path):
    noise = np.random.default_rng(0)
    frames = [np.clip(f + noise.normal(0, 3, f.shape), 0, 255).astype(np.uint8) for f in still(20)]
    assert recorded(tmp_path, frames) == []
    assert list(tmp_path.iterdir()) == []


def test_a_film_ends_even_where_the_ice_is_never_quiet(tmp_path):
    clips = recorded(tmp_path, moving(LONGEST + 5))
    assert len(clips) == 2


def test_times_beside_a_film_are_those_of_its_frames(tmp_path):
    path = tmp_path / "film.mp4"
    write_film(path, [picture(5 * i) for i in range(6)], FPS)
    times = [0.0, 0.05, 0.11, 0.19, 0.2, 0.31]
    save_times(path, [7.0 + t for t in times])
    assert [t for t, _ in Film.open(path).frames()] == pytest.approx(times)
    assert [t for t, _ in Film.open(path).pick([1, 3])] == pytest.approx([0.05, 0.19])
    save_times(path, [0.0, 0.1, 0.1])
    with pytest.raises(InputError, match="row 4: times of frames must increase"):
        Film.open(path)


def test_a_camera_that_is_not_there_is_one_line(curling, tmp_path):
    stage = Stage(FilmSpec(camera="gantry", people=False, size=(320, 180)))
    save_scene(scene_of(stage.camera), tmp_path / "scene.json")
    tried = curling("track", f"file://{tmp_path}/none.mp4", "--scene", tmp_path / "scene.json",
                    "-o", tmp_path / "tracks.csv")  # fmt: skip
    assert "gives no picture" in tried.complaint
    assert not (tmp_path / "tracks.csv").exists()


@pytest.mark.slow
def test_two_throws_of_a_stream_become_two_tracks(curling, tmp_path):
    ice = Ice.uniform(0.03)
    spec = FilmSpec(camera="gantry", people=False, size=(960, 540), fps=FPS, tail=0.2, lead_in=0.3)
    stage = Stage(spec)
    frames, truths, starts = [np.asarray(stage.still, dtype=np.uint8)] * int(2 * FPS), [], []
    for i, (speed, angle) in enumerate([(1.9, 0.02), (2.2, -0.02)]):
        path = slide(ice, Throw(speed=speed, angle=angle, spin=1.2).release(), fps=120).trajectory
        assert path is not None
        starts.append(len(frames) / FPS)
        shown = list(stage.frames(path, seed=i))
        truths.append(on_film(path, spec))
        frames += [*shown, *[shown[-1]] * int((QUIET + 1) * FPS)]
    write_film(tmp_path / "stream.mp4", frames, FPS)
    save_scene(scene_of(stage.camera), tmp_path / "scene.json")
    out = tmp_path / "tracks.csv"
    done = curling("track", f"file://{tmp_path}/stream.mp4", "--scene", tmp_path / "scene.json",
                   "-o", out, "--keep", tmp_path / "kept", "--throws", 2)  # fmt: skip
    assert done.status == 0, done.err
    assert "so far μ = 0.03" in done.err
    tracks = read_tracks(out)
    assert len(tracks) == 2
    for track, truth, start in zip(tracks, truths, starts, strict=True):
        t = track.t + track.clock - start
        inside = (t > 0.5) & (t < truth.t[-1])
        assert inside.sum() > 30
        there = np.column_stack([np.interp(t, truth.t, truth.xy[:, i]) for i in (0, 1)])
        assert np.linalg.norm(track.xy - there, axis=1)[inside].max() < 0.03


@pytest.mark.slow
def test_films_without_a_thrown_stone_are_told_of_and_left(tmp_path):
    stage = Stage(FilmSpec(camera="gantry", people=False, size=(320, 180)))
    empty = np.asarray(stage.still, dtype=np.uint8)
    dark = empty.copy()
    dark[80:110, 100:200] = 0
    one = [*[empty] * 40, *[empty, dark] * 20, *[empty] * int(FPS * (QUIET + 1))]
    write_film(tmp_path / "stream.mp4", one * 3, FPS)
    frames, fps = frames_of(f"file://{tmp_path}/stream.mp4")
    assert fps == FPS
    seen = list(follow(frames, fps, scene_of(stage.camera), tmp_path))
    assert len(seen) == 3
    assert all(k.track is None and "no thrown stone" in k.reason for k in seen)
