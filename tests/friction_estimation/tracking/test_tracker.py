"""Third-party trackers plug into tracking, estimating and live tracking."""

from __future__ import annotations

import sys
from importlib.metadata import EntryPoint
from types import SimpleNamespace

import cv2
import numpy as np
import pytest

from curling_env.errors import InputError, NoThrowError
from curling_env.ice import load_ice
from curling_env.trajectory import Trajectory, read_tracks
from friction_estimation import load_scene, tracking
from friction_estimation.film import Film
from friction_estimation.live import IceSoFar, TrackedClip, follow_stream, open_feed
from friction_estimation.synthetic import FilmRenderer, FilmSpec, scene_of, write_film
from friction_estimation.tracking import (
    Checkpoints,
    load_tracker,
    track_each,
    track_film,
    track_films,
    tracker,
)

STRANGER = '''
import numpy as np

from curling_env.errors import InputError, NoThrowError
from curling_env.trajectory import Trajectory
from friction_estimation.film import Film

def track(film, scene, *, progress):
    """A dark square, as the stone; where it is in the picture tells where it is on the ice."""
    t, y = [], []
    movie = Film.open(film)
    for k, (moment, frame) in enumerate(movie.frames()):
        progress("our own tracker", k + 1, movie.frame_count)
        columns = np.flatnonzero((frame.mean(axis=2) < 128).any(axis=0))
        if len(columns):
            t.append(moment)
            y.append(-20 + 40 * columns.mean() / frame.shape[1])
    if not t:
        raise InputError("nothing dark in it", source=film)
    return [Trajectory(t=np.array(t), xy=np.column_stack([np.zeros(len(t)), y]))]

def takes_no_progress(film, scene):
    return []

def returns_a_number(film, scene, *, progress):
    return 3

no_function = 7
'''


@pytest.fixture
def club(tmp_path, monkeypatch):
    """A folder with a club's tracker, a scene and two films of a dark square that slides."""
    (tmp_path / "our_tracker.py").write_text(STRANGER)
    (tmp_path / "scene.json").write_text(
        '{"corners_px": {"home_left": [10, 5], "home_right": [10, 55], '
        '"away_left": [150, 5], "away_right": [150, 55]}}'
    )
    for name in "ab":
        write_film(tmp_path / f"{name}.mp4", pictures(), 20.0)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", [*sys.path])
    yield tmp_path
    sys.modules.pop("our_tracker", None)


def pictures():
    """The square slows down as on ice of μ = 0.01, seen 20 times a second."""
    shown = []
    for t in np.arange(0, 12, 0.05):
        frame = np.full((60, 160, 3), 220, dtype=np.uint8)
        way = 1.8 * t - 0.5 * 0.01 * 9.80665 * t**2
        at = round(10 + 4 * way)
        frame[25:35, at : at + 10] = 60
        shown.append(frame)
    return shown


CALL = ("--scene", "scene.json", "--tracker", "our_tracker:track")


def test_track_takes_a_strangers_tracker(club, curling):
    done = curling("track", "a.mp4", "b.mp4", *CALL, "-o", "tracks.csv")
    assert done.status == 0, done.err
    tracks = read_tracks("tracks.csv")
    assert [(track.throw, track.stone) for track in tracks] == [(0, 0), (1, 0)]
    assert [entry["tracked"] for entry in done.json()] == [240, 240]
    assert tracks[1].xy[0] == pytest.approx([0.0, -20 + 40 * 14.5 / 160], abs=0.3)


def test_estimate_takes_a_strangers_tracker(club, curling):
    done = curling("estimate", "a.mp4", "b.mp4", *CALL, "-o", "ice.json", "--uniform")
    assert done.status == 0, done.err
    assert load_ice("ice.json").friction.mu.mean() == pytest.approx(0.01, rel=0.1)


class Interrupted:
    """A feed whose user presses Ctrl-C after some time."""

    def __init__(self, feed, after):
        self._feed, self._after = feed, after
        self.size, self.fps = feed.size, feed.fps
        self.add_to, self.close = feed.add_to, feed.close

    def frames(self):
        for moment in self._feed.frames():
            if moment.t > self._after:
                raise KeyboardInterrupt
            yield moment


def test_live_takes_a_strangers_tracker_and_tracks_what_came_before_an_interruption(club):
    """The function is found again in the process beside, in which films are tracked."""
    renderer = FilmRenderer(FilmSpec(camera="gantry", people=False, size=(320, 180)))
    sliding = [
        cv2.copyMakeBorder(frame, 60, 60, 80, 80, cv2.BORDER_CONSTANT, value=(220, 220, 220))
        for frame in pictures()[::2]
    ]
    first = [*sliding[:1] * 30, *sliding, *sliding[-1:] * 70]
    write_film("sent.mp4", [*first, *sliding], 10.0)
    amid = len(first) / 10 + 8.0  # while the second square slides
    feed = Interrupted(open_feed(f"file://{club}/sent.mp4"), after=amid)
    scene = scene_of(renderer.camera)
    news = list(follow_stream(feed, scene, club, tracker=load_tracker("our_tracker:track")))
    seen = [result for result in news if isinstance(result, TrackedClip)]
    assert [result.reason for result in seen] == ["", ""]
    for result in seen:
        assert len(result.tracks[0]) == Film.open(result.clip.path).frame_count
    assert seen[1].clip.clock + seen[1].tracks[0].t[-1] == pytest.approx(amid, abs=0.5)
    assert isinstance(news[-1], IceSoFar)
    assert "from 2 throws" in news[-1].words


def test_trackers_are_found_by_the_name_that_a_package_declares(club, monkeypatch):
    mine = EntryPoint("mine", "our_tracker:track", tracker.TRACKER_GROUP)
    sys.path.append(str(club))
    monkeypatch.setattr("importlib.metadata.entry_points", lambda group: [mine])
    assert load_tracker("mine").__module__ == "our_tracker"


def test_the_built_in_tracker_is_declared_as_any_other():
    assert load_tracker() is load_tracker("built-in") is track_film


@pytest.mark.parametrize(
    ("name", "complaint"),
    [
        ("mine", "unknown tracker 'mine'; expected one of built-in, or module:function"),
        ("no_such_module:track", "cannot be loaded: No module named 'no_such_module'"),
        ("our_tracker:trak", "has no attribute 'trak'"),
        ("our_tracker:takes_no_progress", "tracker(film, scene, progress=progress)"),
        ("our_tracker:no_function", "must be a function"),
        ("our_tracker:returns_a_number", "a.mp4: the tracker returned int, expected tracks"),
    ],
)
def test_what_is_no_tracker_is_refused_in_one_line(club, curling, name, complaint):
    tried = curling("track", "a.mp4", "--scene", "scene.json", "--tracker", name, "-o", "t.csv")
    assert complaint in tried.complaint
    assert not (club / "t.csv").exists()


def test_options_of_the_built_in_tracker_and_overlays_are_not_for_others(club, curling):
    tried = curling("track", "a.mp4", *CALL, "--as-marked")
    assert "options of the built-in tracker" in tried.complaint
    tried = curling("track", "a.mp4", *CALL, "--overlay", "o.mp4", "-o", "t.csv")
    assert "returns tracks only" in tried.err
    assert not (club / "t.csv").exists()


def test_films_are_numbered_in_order_and_progress_is_reported(club):
    result = []

    def stand_in(film, scene, *, progress):
        progress(film.name, 1.0)
        return Trajectory(t=np.array([0.0, 1.0]), xy=np.zeros((2, 2)), throw=9, stone=4)

    scene = load_scene(club / "scene.json")
    films = [club / "a.mp4", club / "b.mp4"]
    found = list(track_each(films, scene, tracker=stand_in, progress=lambda *k: result.append(k)))
    assert [(one.thrown.throw, one.thrown.stone) for one in found] == [(0, 0), (1, 0)]
    assert result == [("a.mp4", 1.0), ("b.mp4", 1.0)]
    with pytest.raises(InputError, match="all 2 films or one for each, got 3"):
        track_each(films, [scene] * 3, tracker=stand_in)


def test_one_call_tracks_films_and_goes_on_where_it_was_interrupted(club):
    calls = []

    def stand_in(film, scene, *, progress):
        calls.append(film.name)
        if calls == ["a.mp4", "b.mp4"]:
            raise KeyboardInterrupt
        return Trajectory(t=np.array([0.0, 1.0]), xy=np.full((2, 2), np.pi))

    films, out = ["a.mp4", "b.mp4"], club / "tracks.csv"
    with pytest.raises(KeyboardInterrupt):
        track_films(films, "scene.json", tracker=stand_in, resume_beside=out)
    tracks = track_films(films, club / "scene.json", tracker=stand_in, resume_beside=out)
    assert calls == ["a.mp4", "b.mp4", "b.mp4"]
    assert [track.throw for track in tracks] == [0, 1]
    assert tracks[0].xy[0, 0] == np.pi
    assert not Checkpoints(out).folder.exists()


def test_no_track_at_all_is_no_thrown_stone(club):
    scene = load_scene(club / "scene.json")
    with pytest.raises(InputError, match=r"a\.mp4: the tracker found no thrown stone"):
        list(track_each([club / "a.mp4"], scene, tracker=lambda film, scene, *, progress: []))


def test_films_without_a_throw_are_skipped_with_a_warning(club):
    scene = load_scene(club / "scene.json")
    films = [club / "a.mp4", club / "b.mp4"]

    def stand_in(film, scene, *, progress):
        return [] if film.name in without else [Trajectory(t=np.arange(2.0), xy=np.zeros((2, 2)))]

    skipped, without = [], ["a.mp4"]
    found = list(track_each(films, scene, tracker=stand_in, left_out=skipped.append))
    assert [(one.film.name, one.thrown.throw) for one in found] == [("b.mp4", 0)]
    assert skipped == ["a.mp4: the tracker found no thrown stone"]
    with pytest.raises(NoThrowError, match=r"a\.mp4: the tracker found"):
        track_films(films, scene, tracker=stand_in)
    without.append("b.mp4")
    with pytest.raises(NoThrowError, match=r"a\.mp4: the tracker found"):
        list(track_each(films, scene, tracker=stand_in, left_out=skipped.append))


def test_the_default_is_what_the_package_offers(club, monkeypatch):
    """A user, or a test, may replace it."""
    given = SimpleNamespace(calls=0)

    def stand_in(film, scene, *, progress):
        given.calls += 1
        return Trajectory(t=np.array([0.0, 1.0]), xy=np.zeros((2, 2)))

    monkeypatch.setattr(tracking, "track_film", stand_in)
    list(track_each([club / "a.mp4"], load_scene(club / "scene.json")))
    assert given.calls == 1
