"""Films show the whole slide, and tell what came of it only when everything rests."""

from __future__ import annotations

from itertools import pairwise

import av
import gymnasium as gym
import numpy as np
import pytest

import curling_env
from curling_env.envs import RecordVideo
from curling_env.envs.sheet import rendering
from curling_env.errors import InputError

ACTION = np.float32([0.0, 0.0, 0.5])


def length_of(path):
    """Pictures and seconds of a film."""
    with av.open(str(path)) as film:
        return sum(1 for _ in film.decode(video=0)), float(film.duration / av.time_base)


def test_a_film_of_an_episode_is_as_long_as_its_throws(tmp_path):
    env = gym.make("CurlingSheet-v0", render_mode="rgb_array", throws=2, details=True)
    env = RecordVideo(env, tmp_path / "films", episode_trigger=lambda k: k == 0, speed=20.0)
    time = 0.0
    for _ in range(2):
        env.reset(seed=0)
        for _ in range(2):
            time += env.step(ACTION)[-1]["outcome"].time / 2
    env.close()
    (film,) = (tmp_path / "films").iterdir()
    assert film.name == "curling-episode-0.mp4"
    pictures, seconds = length_of(film)
    assert seconds == pytest.approx(pictures / 30, abs=0.05)
    assert 1 + time / 20 < seconds < 1 + time / 20 + 2 * 2.5


def test_an_episode_that_is_not_finished_is_filmed_as_far_as_it_went(tmp_path):
    env = gym.make("CurlingEnd-v0", render_mode="rgb_array", hammer="opponent")
    env = RecordVideo(env, tmp_path, name_prefix="end", speed=100.0)
    env.reset(seed=0)
    env.step(ACTION)
    assert not list(tmp_path.glob("end-*"))
    env.close()
    assert length_of(tmp_path / "end-episode-0.mp4")[0] > 30


@pytest.mark.parametrize("name", ["CurlingSheet-v0", "CurlingEnd-v0", "curling_v0"])
def test_a_list_of_pictures_shows_what_happened_since_the_last(name, monkeypatch):
    monkeypatch.setattr("curling_env.envs.rendering.FILM_SPEED", 100.0)
    if name == "curling_v0":
        pytest.importorskip("pettingzoo")
        game = curling_env.curling_v0
        env = game.env(render_mode="rgb_array_list")
    else:
        env = gym.make(name, render_mode="rgb_array_list", disable_env_checker=True)
    env.reset(seed=1)
    first = env.render()
    assert len(first) >= 1
    env.step(ACTION)
    film = env.render()
    assert len(film) > 10
    assert all(picture.shape == (720, 1280, 3) for picture in film)
    moving = sum(not np.array_equal(a, b) for a, b in pairwise(film))
    assert moving >= 5
    assert len(env.render()) <= 1
    env.close()


def test_the_panel_does_not_tell_the_end_before_it_happened(monkeypatch):
    result = []

    def note(renderer, scene, *others, scene_at_rest, **options):
        result.append(([name for name, _ in scene.facts], [n for n, _ in scene_at_rest.facts]))
        return iter(())

    monkeypatch.setattr(rendering, "playback_frames", note)
    env = gym.make("CurlingSheet-v0", render_mode="rgb_array").unwrapped
    env.reset(seed=0)
    env.step(ACTION)
    list(env.frames())
    ((moving, at_rest),) = result
    assert moving == ["Speed", "Line", "Spin"]
    assert at_rest[3:] == ["Time", "From target", "Result", "Draw"]


def test_what_cannot_be_filmed_is_refused(tmp_path):
    with pytest.raises(InputError, match="render_mode='rgb_array'"):
        RecordVideo(gym.make("CurlingSheet-v0"), tmp_path)
    with pytest.raises(InputError, match="environment of curling_env"):
        RecordVideo(gym.make("CartPole-v1"), tmp_path)
    end = gym.make("CurlingEnd-v0").unwrapped
    end.reset(seed=0)
    with pytest.raises(InputError, match="needs a render_mode"):
        next(end.frames())
