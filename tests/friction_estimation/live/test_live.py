"""A camera that is filming now: throws are cut from the stream and tracked one by one."""

from __future__ import annotations

import time
from contextlib import closing
from dataclasses import replace
from socket import socket
from threading import Thread
from types import SimpleNamespace

import av
import cv2
import numpy as np
import pytest

from curling_env.errors import InputError
from curling_env.ice import Ice
from curling_env.infrastructure import write_table
from curling_env.physics import slide
from curling_env.throw import Throw
from curling_env.trajectory import Trajectory, read_tracks
from friction_estimation.camera import save_scene
from friction_estimation.film import Film, brightness_of, is_stream
from friction_estimation.live import (
    LEAD_IN_SECONDS,
    MAX_FILM_SECONDS,
    QUIET_SECONDS,
    Recorder,
    follow_stream,
    open_feed,
)
from friction_estimation.synthetic import FilmRenderer, FilmSpec, on_film, scene_of, write_film
from friction_estimation.tracking import COMPARED_AFTER, MotionDetector
from tests.friction_estimation.home_half import home_half

FPS = 20.0
SESSION_FPS, SESSION_CAMERA = 8.0, home_half((800, 450))
"""Of the film of two throws, of which every frame is made, sent and tracked."""
KEY_EVERY = 12
"""Distance between key frames of a camera's stream [frames]."""
SURELY_OVER = QUIET_SECONDS + COMPARED_AFTER + 1
"""Time without motion after which a film has ended [s]."""


def motion(scale=1):
    """Motion detector for the pictures of these tests, with a stone as large as the square."""
    stones = np.full((30 * scale, 80 * scale), (2 / 10 / scale) ** 2)
    return MotionDetector(stones, (slice(0, 60 * scale), slice(0, 160 * scale)))


def picture(at=None):
    frame = np.full((60, 160, 3), 220, dtype=np.uint8)
    if at is not None:
        frame[25:35, at : at + 10] = 60
    return frame


def fed(tmp_path, frames):
    """Frames as a stream that sends them: as cameras do, with many key frames, all in order."""
    path = tmp_path / "sent.mp4"
    with av.open(str(path), "w") as sent:
        stream = sent.add_stream("libx264", rate=int(FPS))
        stream.height, stream.width = frames[0].shape[:2]
        stream.pix_fmt = "yuv420p"
        stream.options = {"preset": "superfast", "crf": "18", "bf": "0", "g": str(KEY_EVERY)}
        for frame in frames:
            sent.mux(stream.encode(av.VideoFrame.from_ndarray(frame, format="bgr24")))
        sent.mux(stream.encode())
    return open_feed(f"file://{path}")


def recorded(tmp_path, frames):
    """The clips that a recorder makes of a list of frames, the last one included."""
    feed = fed(tmp_path, frames)
    kept = tmp_path / "kept"
    kept.mkdir()
    recorder = Recorder(feed=feed, motion=motion(), folder=kept)
    with closing(feed):
        clips = [*map(recorder.add, feed.frames()), recorder.finish()]
    return [clip for clip in clips if clip is not None]


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
    frames = [
        *still(6),
        *moving(3),
        *still(QUIET_SECONDS + COMPARED_AFTER + 1),
        *moving(2),
        *still(1),
    ]
    clips = recorded(tmp_path, frames)
    assert [clip.path.name for clip in clips] == ["throw-000.mp4", "throw-001.mp4"]
    assert sorted((tmp_path / "kept").iterdir()) == [clip.path for clip in clips]
    first = Film.open(clips[0].path)
    assert first.frame_count == clips[0].frames
    assert clips[0].missing == 0
    # What is kept of the quiet before is no less than was wanted, and of that after no more than
    # it takes to be sure of it.
    wanted = 6.0 - LEAD_IN_SECONDS
    assert wanted - KEY_EVERY / FPS <= clips[0].clock <= wanted
    end_of_motion = clips[0].clock + first.frame_count / FPS - QUIET_SECONDS
    assert 9 < end_of_motion <= 9 + COMPARED_AFTER + 0.2


def test_a_film_holds_the_very_pictures_that_were_sent(tmp_path):
    frames = [*still(6), *moving(3), *still(1)]
    (clip,) = recorded(tmp_path, frames)
    sent = [frame for _, frame in Film.open(tmp_path / "sent.mp4").frames()]
    kept = list(Film.open(clip.path).frames())
    assert len(kept) == clip.frames
    first = round(clip.clock * FPS)
    assert [t for t, _ in kept] == pytest.approx(np.arange(len(kept)) / FPS, abs=1e-3)
    for (_, frame), same in zip(kept, sent[first:], strict=True):
        np.testing.assert_array_equal(frame, same)


@pytest.mark.parametrize("stored", ["yuv420p", "yuv420p10le", "yuyv422", "nv12", "rgb24", "gray"])
def test_brightness_is_the_same_however_a_camera_stores_it(stored):
    ramp = np.linspace(30, 220, 64 * 48).reshape(48, 64).astype(np.uint8)
    frame = av.VideoFrame.from_ndarray(ramp, format="gray").reformat(format="yuv444p")
    seen = brightness_of(frame.reformat(format=stored))
    assert seen.shape == (48, 64)
    # From 16 to 235 or from 0 to 255, but the same picture.
    assert np.corrcoef(seen.ravel(), ramp.ravel())[0, 1] > 0.999
    assert 0.8 < np.ptp(seen) / np.ptp(ramp) < 1.2


def test_frames_that_never_came_are_counted(tmp_path):
    feed = fed(tmp_path, [*moving(3), *still(1)])
    recorder = Recorder(feed=feed, motion=motion(), folder=tmp_path)
    for k, moment in enumerate(feed.frames()):
        late = round(7 / FPS / moment.packets[0].unit) if k > 30 else 0
        packets = [replace(c, pts=c.pts + late, dts=c.dts + late) for c in moment.packets]
        recorder.add(replace(moment, packets=tuple(packets)))
    clip = recorder.finish()
    assert clip is not None
    assert clip.missing == 7


class CameraOfPictures:
    """Stand-in for OpenCV's capture that serves a list of pictures, with or without stamps."""

    def __init__(self, frames, stamps=None):
        self._frames, self._stamps, self._at = frames, stamps, -1

    def read(self):
        self._at += 1
        ok = self._at < len(self._frames)
        return ok, self._frames[self._at].copy() if ok else None

    def get(self, name):
        if name == cv2.CAP_PROP_FPS:
            return FPS
        return 0.0 if self._stamps is None else 1000 * self._stamps[min(self._at, 999)]

    def release(self):
        self._frames = []


@pytest.fixture
def webcam(monkeypatch):
    """Makes camera numbers give pictures; films are opened as ever."""
    real = cv2.VideoCapture

    def plug(frames, stamps=None):
        monkeypatch.setattr(
            cv2,
            "VideoCapture",
            lambda name: CameraOfPictures(frames, stamps) if name == 0 else real(name),
        )

    return plug


def test_a_webcams_frames_are_coded_finely_and_keep_their_drivers_times(tmp_path, webcam):
    frames = [*still(3), *moving(4)]
    frames = [np.repeat(np.repeat(frame, 4, axis=0), 4, axis=1) for frame in frames]
    stamps = 100.0 + np.cumsum(np.random.default_rng(1).uniform(0.04, 0.06, 1000))
    webcam(frames, stamps)
    feed = open_feed("0")
    assert (feed.size, feed.fps) == ((640, 240), FPS)
    recorder = Recorder(feed=feed, motion=motion(4), folder=tmp_path)
    assert all(recorder.add(moment) is None for moment in feed.frames())
    clip = recorder.finish()
    assert clip is not None
    # The first two frames set the camera's properties.
    first = len(frames) - clip.frames
    kept = list(Film.open(clip.path).frames())
    assert len(kept) == clip.frames
    assert [t for t, _ in kept] == pytest.approx(
        stamps[first : len(frames)] - stamps[first], abs=1e-3
    )
    worst = max(
        np.abs(frame.astype(int) - was).mean()
        for (_, frame), was in zip(kept, frames[first:], strict=True)
    )
    assert worst < 2


def test_a_webcam_without_stamps_goes_by_arrival_and_one_without_pictures_is_one_line(webcam):
    webcam(still(1))
    times = [moment.t for moment in open_feed("0").frames()]
    assert len(times) == FPS - 2
    assert times[0] == 0.0
    assert np.all(np.diff(times) > 0)
    webcam([])
    with pytest.raises(InputError, match="camera 0: sends no picture"):
        open_feed("0")


def test_nothing_is_kept_of_ice_on_which_nothing_moves(tmp_path):
    noise = np.random.default_rng(0)
    frames = [np.clip(f + noise.normal(0, 3, f.shape), 0, 255).astype(np.uint8) for f in still(20)]
    assert recorded(tmp_path, frames) == []
    assert list((tmp_path / "kept").iterdir()) == []


@pytest.mark.parametrize(("speed", "seen"), [(0.2, True), (0.0, False)])
def test_a_stone_that_creeps_at_the_far_end_is_seen_and_one_at_rest_is_not(speed, seen):
    spec = FilmSpec(camera="end", people=False, size=(960, 540), fps=5.0, noise=4.0, lead_in=0.0)
    renderer = FilmRenderer(spec)
    t = np.arange(0.0, 4.1, 0.1)
    path = Trajectory(t=t, xy=np.column_stack([np.full_like(t, 0.3), 16.0 + speed * t]))
    watch = MotionDetector.for_camera(renderer.camera, scene_of(renderer.camera))
    looks = [
        watch.detects(k / spec.fps, np.ascontiguousarray(frame[..., 1]))
        for k, frame in enumerate(renderer.frames(path, seed=3))
        if k < 20
    ]
    assert any(looks) == seen
    assert all(looks[10:]) == seen


def test_a_film_ends_even_where_the_ice_is_never_quiet(tmp_path):
    clips = recorded(tmp_path, moving(MAX_FILM_SECONDS + 5))
    assert len(clips) == 2


def test_times_beside_a_film_are_those_of_its_frames(tmp_path):
    path = tmp_path / "film.mp4"
    write_film(path, [picture(5 * i) for i in range(6)], FPS)
    times = [0.0, 0.05, 0.11, 0.19, 0.2, 0.31]
    beside = tmp_path / "film.mp4.times.csv"
    write_table(beside, {"t": [7.0 + t for t in times]})
    assert [t for t, _ in Film.open(path).frames()] == pytest.approx(times)
    assert [t for t, _ in Film.open(path).pick([1, 3])] == pytest.approx([0.05, 0.19])
    write_table(beside, {"t": [0.0, 0.1, 0.1]})
    with pytest.raises(InputError, match="row 4: times of frames must increase"):
        Film.open(path)


def test_a_camera_that_is_not_there_is_one_line(curling, tmp_path):
    renderer = FilmRenderer(FilmSpec(camera="gantry", people=False, size=(320, 180)))
    save_scene(scene_of(renderer.camera), tmp_path / "scene.json")
    tried = curling(
        "live",
        f"file://{tmp_path}/none.mp4",
        "--scene",
        tmp_path / "scene.json",
        "-o",
        tmp_path / "tracks.csv",
    )
    assert "sends no picture" in tried.complaint
    assert not (tmp_path / "tracks.csv").exists()


@pytest.fixture(scope="module")
def session(tmp_path_factory):
    """A film of two throws, its scene, where the stones truly were, and when they began."""
    folder = tmp_path_factory.mktemp("session")
    ice = Ice.uniform(0.03)
    spec = FilmSpec(camera=SESSION_CAMERA, people=False, fps=SESSION_FPS, tail=0.2, lead_in=0.3)
    renderer = FilmRenderer(spec)
    frames, truths, starts = (
        [np.asarray(renderer.still, dtype=np.uint8)] * int(2 * SESSION_FPS),
        [],
        [],
    )
    for i, (speed, angle) in enumerate([(1.9, 0.02), (2.2, -0.02)]):
        path = slide(ice, Throw(speed=speed, angle=angle, spin=1.2).release(), fps=120).trajectory
        assert path is not None
        starts.append(len(frames) / SESSION_FPS)
        shown = list(renderer.frames(path, seed=i))
        truths.append(on_film(path, spec))
        frames += [*shown, *[shown[-1]] * int(SURELY_OVER * SESSION_FPS)]
    write_film(folder / "sent.mp4", frames, SESSION_FPS)
    save_scene(scene_of(renderer.camera), folder / "scene.json")
    return SimpleNamespace(
        film=folder / "sent.mp4", scene=folder / "scene.json", truths=truths, starts=starts
    )


def send(film, address):
    """Send a film as a camera on a network does, as soon as a client listens."""
    for _ in range(600):
        sent = av.open(address, "w", format="mpegts")
        stream = sent.add_stream("libx264", rate=int(SESSION_FPS))
        (stream.width, stream.height), stream.pix_fmt = SESSION_CAMERA.size, "yuv420p"
        stream.options = {"preset": "superfast", "crf": "22", "bf": "2", "g": "20"}
        try:
            sent.start_encoding()  # connects
            break
        except av.FFmpegError:
            time.sleep(0.1)
    with av.open(str(film)) as source, sent:
        for frame in source.decode(video=0):
            sent.mux(stream.encode(frame))
        sent.mux(stream.encode())


@pytest.mark.slow
def test_two_throws_of_a_stream_become_two_tracks_and_a_page(curling, session, tmp_path):
    with socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    address = f"tcp://127.0.0.1:{port}"
    Thread(target=send, args=(session.film, address), daemon=True).start()
    out = tmp_path / "tracks.csv"
    done = curling(
        "live",
        f"{address}?listen=1",
        "--scene",
        session.scene,
        "-o",
        out,
        "--keep",
        tmp_path / "kept",
        "--throws",
        2,
        "--report",
        tmp_path / "ice",
    )
    assert done.status == 0, done.err
    assert "current ice: μ = 0.0" in done.err
    page = (tmp_path / "ice" / "report.html").read_text()
    assert "throws measured" in page
    assert "throw-001.mp4" in page  # the last throw's pictures
    assert "http-equiv=refresh" not in page  # the page is complete
    assert [track.throw for track in read_tracks(out)] == [0, 1]
    for track, truth, start in zip(read_tracks(out), session.truths, session.starts, strict=True):
        t = track.t + track.clock - start
        inside = (t > 0.5) & (t < truth.t[-1])
        assert inside.sum() > 30
        there = np.column_stack([np.interp(t, truth.t, truth.xy[:, i]) for i in (0, 1)])
        assert np.linalg.norm(track.xy - there, axis=1)[inside].max() < 0.03


@pytest.mark.slow
def test_films_without_a_thrown_stone_are_skipped_with_a_warning(tmp_path):
    renderer = FilmRenderer(FilmSpec(camera=home_half((320, 180)), people=False))
    empty = np.asarray(renderer.still, dtype=np.uint8)
    dark = empty.copy()
    dark[35:65, 40:140] = 0
    one = [
        *[empty] * 30,
        *[empty, dark] * 15,
        *[empty] * int(FPS * SURELY_OVER),
    ]
    feed = fed(tmp_path, one * 2)
    assert feed.fps == FPS
    seen = list(follow_stream(feed, scene_of(renderer.camera), tmp_path))
    assert len(seen) == 2
    assert all(not k.tracks and "no thrown stone" in k.reason for k in seen)


def test_a_stream_of_an_unknown_kind_or_of_too_large_pictures_is_refused(tmp_path):
    fed(tmp_path, [picture() for _ in range(5)])
    sent = (tmp_path / "sent.mp4").read_bytes()
    (tmp_path / "kind.mp4").write_bytes(sent.replace(b"avc1", b"zzz1"))
    with pytest.raises(InputError, match="no decodable picture"):
        open_feed(f"file:{tmp_path / 'kind.mp4'}")
    large = np.full((4200, 4200, 3), 220, dtype=np.uint8)
    with pytest.raises(InputError, match="4200 × 4200 pixels"):
        fed(tmp_path, [large])
