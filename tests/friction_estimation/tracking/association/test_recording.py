"""A film of several throws is cut into them; stones at rest are ignored."""

from __future__ import annotations

import numpy as np

from curling_env.trajectory import Trajectory
from friction_estimation import load_scene
from friction_estimation.camera import save_scene
from friction_estimation.film import Film
from friction_estimation.synthetic import FilmRenderer, FilmSpec, scene_of, write_film
from friction_estimation.tracking import track_each
from friction_estimation.tracking.films.pieces import cut

FPS = 6.0
"""Frames per second of the practice film."""


def test_each_throw_has_its_own_track_clock_and_stone(practice):
    left_out, scene = [], load_scene(practice.path.with_name("scene.json"))
    found = list(track_each([practice.path], scene, left_out=left_out.append))
    assert not practice.path.with_name("scene.solved.json").exists()  # not requested
    assert [one.thrown.throw for one in found] == [0, 1, 2]
    # The red one was picked up and is thrown again past the yellow one, which stays where it is.
    assert [one.thrown.stone for one in found] == [0, 1, 0]
    assert [[k.stone for k in one.tracks[1:]] for one in found] == [[], [], [1]]
    for one, begin, truth in zip(found, practice.begins, practice.truths, strict=True):
        t = one.thrown.clock + one.thrown.t - begin
        assert -0.01 < t[0] < 1.5
        assert len(t) > 0.8 * len(truth)
        assert t[-1] < truth.t[-1] + 4.01
        rows = np.minimum(np.rint(FPS * t).astype(int), len(truth) - 1)
        assert np.hypot(*(one.thrown.xy - truth.xy[rows]).T).max() < 0.03
    (result,) = left_out
    assert result.startswith("practice.mp4, 0:1")
    assert result.endswith("slid back from where the stone before it came to rest")


def test_a_short_film_of_two_throws_is_cut_too(practice):
    begin = practice.begins[1] - 0.5
    part = Film.open(practice.path).part(begin, practice.begins[2] + practice.truths[2].t[-1])
    assert part.duration < 30.0
    found = cut(part, practice.scene)
    assert len(found) == 2
    for one, thrown in zip(found, practice.begins[1:], strict=True):
        assert one.begin < thrown + 1.5 - begin
        assert one.end > thrown + 5.0 - begin


def test_a_long_film_in_which_a_stone_is_only_carried_is_refused(curling, tmp_path):
    """A stone at constant speed is carried; a film this long is scanned before tracking."""
    spec = FilmSpec(camera="gantry", people=False, size=(640, 360), fps=4.0, lead_in=0.0, tail=0.0)
    renderer = FilmRenderer(spec)
    t = np.arange(0.0, 14.0, 0.25)
    path = Trajectory(t=t, xy=np.column_stack([np.full(len(t), 0.4), 8.0 - 1.3 * t]))
    empty = np.asarray(renderer.still, dtype=np.uint8)
    frames = [*[empty] * 20, *renderer.frames(path, seed=1), *[empty] * 170]
    write_film(tmp_path / "practice.mp4", frames, spec.fps)
    save_scene(scene_of(renderer.camera), tmp_path / "scene.json")
    call = ("track", tmp_path / "practice.mp4", "--scene", tmp_path / "scene.json")
    refused = curling(*call, "-o", tmp_path / "tracks.csv")
    assert refused.status == 2
    assert "practice.mp4: no throw found in 1:0" in refused.err
    assert not (tmp_path / "tracks.csv").exists()
