"""`curling track` adds to an evening's tracks, and harms neither film nor scene."""

from __future__ import annotations

import json

import numpy as np

from curling_env.trajectory import read_tracks
from friction_estimation.film import film_writer

TRACKER = """
import numpy as np
from curling_env.trajectory import Trajectory
def track(film, scene, *, progress):
    t = np.arange(20) / 10
    return Trajectory(t=t, xy=np.column_stack([0 * t, 2 * t]))
"""


def test_films_are_added_to_the_tracks_of_the_evening(curling, tmp_path, monkeypatch):
    (tmp_path / "ours_to_append.py").write_text(TRACKER)
    corners = {"home_left": [5, 115], "home_right": [55, 115], "away_right": [45, 5]}
    scene = tmp_path / "s.json"
    scene.write_text(json.dumps({"corners_px": {**corners, "away_left": [15, 5]}}))
    film = tmp_path / "f.mp4"
    with film_writer(film, (64, 128), 10.0) as writer:
        for k in range(5):
            writer.write(np.full((128, 64, 3), 40 * k, np.uint8))
    before = film.read_bytes()
    monkeypatch.chdir(tmp_path)
    words = ("track", film, "--scene", scene, "--tracker", "ours_to_append:track", "-o")
    for throws in ([0], [0, 1], [0, 1, 2]):
        added = curling(*words, tmp_path / "t.csv", "--append")
        assert added.status == 0
        assert "was replaced" not in added.err
        assert ("added to" in added.err) == (len(throws) > 1)
        assert [track.throw for track in read_tracks(tmp_path / "t.csv")] == throws
    assert (
        "t.csv: the earlier file of this name was replaced"
        in curling(*words, tmp_path / "t.csv").err
    )
    assert [track.throw for track in read_tracks(tmp_path / "t.csv")] == [0]
    for harmed in (film, scene):
        assert "is an input of this command" in curling(*words, harmed).complaint
    assert film.read_bytes() == before


def test_a_file_of_another_kind_is_refused_before_any_film_is_looked_at(curling, tmp_path):
    kept = tmp_path / "notes.json"
    kept.write_text('{"mine": 1}')
    film, scene = tmp_path / "missing.mp4", tmp_path / "missing.json"
    refused = curling("track", film, "--scene", scene, "-o", kept)
    assert "is not replaced by a table of tracks" in refused.complaint
    assert kept.read_text() == '{"mine": 1}'


def test_an_overlay_is_a_film_by_name_and_replaces_no_film_of_ones_own(curling, tmp_path):
    own = tmp_path / "own.mp4"
    own.write_bytes(b"\0\0\0\x20ftypisom, and what a camera took")
    words = ("track", tmp_path / "missing.mp4", "--scene", tmp_path / "missing.json")
    refused = curling(*words, "--overlay", tmp_path / "seen.png")
    assert "expected a name ending in .mp4 or .avi" in refused.complaint
    refused = curling(*words, "--overlay", own)
    assert "is a film of your own and is not replaced" in refused.complaint
