"""The vector environments as stable-baselines3 trains on them."""

from __future__ import annotations

import gymnasium as gym
import numpy as np
import pytest

pytest.importorskip("stable_baselines3")

from stable_baselines3 import PPO

from curling_env.envs import CurlingVecEnv
from curling_env.errors import InputError


def test_it_is_the_same_as_single_sheets():
    options = {"target": "random", "skill": "club", "throws": 2}
    many = CurlingVecEnv("CurlingSheet-v0", 3, seed=4, **options)
    seen = many.reset()
    alone = [gym.make("CurlingSheet-v0", **options).unwrapped for _ in range(3)]
    for k, env in enumerate(alone):
        np.testing.assert_array_equal(env.reset(seed=4 + k)[0], seen[k])
    rng, total = np.random.default_rng(0), np.zeros(3)
    for step in range(4):
        actions = rng.uniform(-1, 1, (3, 3)).astype(np.float32) * np.float32([0.5, 0.2, 1.0])
        seen, rewards, over, infos = many.step(actions)
        for k, env in enumerate(alone):
            one, reward, ended, _, info = env.step(actions[k])
            total[k] += reward
            assert rewards[k] == pytest.approx(reward, abs=1e-3)
            assert infos[k]["distance_m"] == pytest.approx(info["distance_m"], abs=1e-3)
            assert over[k] == ended == bool(step % 2)
            if ended:
                np.testing.assert_allclose(infos[k]["terminal_observation"], one, atol=1e-3)
                assert infos[k]["episode"] == {"r": pytest.approx(total[k], abs=2e-3), "l": 2}
                assert infos[k]["is_success"] is info["success"]
                one, total[k] = env.reset()[0], 0.0
            np.testing.assert_allclose(seen[k], one, atol=1e-3)


def test_ends_tell_their_score_and_their_masks():
    many = CurlingVecEnv("CurlingEnd-v0", 2, seed=0, actions="shots", hammer="opponent")
    many.reset()
    masks = np.stack(many.env_method("action_masks"))
    assert masks.shape == (2, many.action_space.n)
    for _ in range(8):
        _, rewards, over, infos = many.step(np.array([0, 2]))
        assert infos[0]["reward_parts"].keys() == {"points", "win", "fault", "potential"}
    assert over.all()
    assert [info["score"][0] - info["score"][1] for info in infos] == rewards.tolist()
    assert all(info["episode"]["l"] == 8 for info in infos)


@pytest.mark.parametrize("name", ["CurlingSheet-v0", "CurlingEnd-v0"])
def test_algorithms_learn_on_it(name):
    model = PPO("MlpPolicy", CurlingVecEnv(name, n_envs=4, seed=1), n_steps=16, batch_size=32)
    model.learn(64)
    assert model.num_timesteps == 64


def test_options_of_a_reset_reach_the_environments():
    many = CurlingVecEnv("CurlingSheet-v0", 2, seed=0)
    many.set_options({"target": (0.5, 0.5)})
    np.testing.assert_array_equal(many.reset()[:, 0], [np.float32(0.5 / 2.25)] * 2)
    assert many.get_attr("throws") == [1, 1]
    many.set_options([{"target": (0.5, 0.5)}, {}])
    with pytest.raises(InputError, match="the same reset options"):
        many.reset()


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (
            lambda: CurlingVecEnv(gym.make_vec("CartPole-v1", num_envs=2)),
            "expected CurlingSheet-v0",
        ),
        (lambda: CurlingVecEnv(gym.make_vec("CurlingSheet-v0", num_envs=2)), "SameStep"),
        (lambda: CurlingVecEnv("CurlingSheet-v0", 0), "n_envs must be"),
        (lambda: CurlingVecEnv("CurlingSheet-v0", 2, task="wiggle"), "unknown task"),
    ],
)
def test_what_it_cannot_be_made_of_is_refused(make, says):
    with pytest.raises(InputError, match=says):
        make()
