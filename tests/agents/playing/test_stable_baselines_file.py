"""Policies that stable-baselines3 saved: read, but never run."""

import json
import pickle
from base64 import b64encode
from pathlib import Path
from zipfile import ZipFile

import gymnasium as gym
import numpy as np
import pytest

import curling_env  # noqa: F401  registers the environments
from agents.playing.stable_baselines_file import stable_baselines_policy
from curling_env.errors import InputError

pytest.importorskip("stable_baselines3")
import torch
from stable_baselines3 import DQN, PPO, SAC


class Creates:
    """An object whose unpickling creates a file."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def __reduce__(self):
        return Path.touch, (self.path,)


@pytest.fixture(scope="module")
def saved(tmp_path_factory):
    env = gym.make("CurlingSheet-v0", ice="standard")
    path = tmp_path_factory.mktemp("models") / "model.zip"
    PPO("MlpPolicy", env, device="cpu", seed=0).save(path)
    return path


def changed(saved, path, **entries):
    """A copy of a model in which entries are replaced."""
    with ZipFile(saved) as source, ZipFile(path, "w") as copy:
        for name in source.namelist():
            copy.writestr(name, entries.pop(name.partition(".")[0], source.read(name)))
    return path


@pytest.mark.parametrize(
    ("algorithm", "options"),
    [
        (PPO, {"policy_kwargs": {"net_arch": [16], "activation_fn": torch.nn.ReLU}}),
        (SAC, {"policy_kwargs": {"net_arch": [16]}}),
        (DQN, {"policy_kwargs": {"net_arch": [16]}}),
    ],
)
def test_it_acts_as_the_model_that_was_saved(tmp_path, algorithm, options):
    actions = "shots" if algorithm is DQN else "throws"
    env = gym.make("CurlingEnd-v0", opponent="draw", actions=actions)
    model = algorithm("MlpPolicy", env, device="cpu", seed=0, **options)
    model.save(tmp_path / "model.zip")
    observation, _ = env.reset(seed=1)
    read = stable_baselines_policy(tmp_path / "model.zip")
    expected, _ = model.predict(observation, deterministic=True)
    np.testing.assert_allclose(read.predict(observation, deterministic=True)[0], expected)


def test_pickled_objects_are_never_loaded(tmp_path, saved):
    ran = tmp_path / "ran"
    bad = changed(saved, tmp_path / "weights.zip", policy=pickle.dumps(Creates(ran)))
    with pytest.raises(InputError, match="the weights do not fit"):
        stable_baselines_policy(bad)
    with ZipFile(saved) as archive:
        data = json.loads(archive.read("data"))
    for value in data.values():
        if isinstance(value, dict) and ":serialized:" in value:
            value[":serialized:"] = b64encode(pickle.dumps(Creates(ran))).decode()
    stable_baselines_policy(changed(saved, tmp_path / "data.zip", data=json.dumps(data)))
    assert not ran.exists()


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"policy_class": {"__module__": "os"}}, "unknown policy of 'os'"),
        ({"policy_kwargs": {"activation_fn": "<class 'os.system'>"}}, "expected a model"),
        ({"policy_kwargs": {"net_arch": [3]}}, "the weights do not fit"),
        ({"policy_kwargs": {"nonsense": 1}}, "the weights do not fit"),
        ({"action_space": {}}, "expected a model"),
    ],
)
def test_what_it_cannot_read_is_refused(tmp_path, saved, change, words):
    with ZipFile(saved) as archive:
        data = json.loads(archive.read("data")) | change
    with pytest.raises(InputError, match=words):
        stable_baselines_policy(changed(saved, tmp_path / "a.zip", data=json.dumps(data)))


def test_a_file_that_is_no_archive(tmp_path):
    (tmp_path / "a.zip").write_text("text", encoding="utf-8")
    with pytest.raises(InputError, match="saved by stable-baselines3"):
        stable_baselines_policy(tmp_path / "a.zip")
    with pytest.raises(InputError, match="no such file"):
        stable_baselines_policy(tmp_path / "b.zip")


def test_a_policy_with_values_of_actions_takes_the_best_that_there_is(tmp_path):
    env = gym.make("CurlingEnd-v0", opponent="draw", actions="shots")
    model = DQN("MlpPolicy", env, device="cpu", seed=0, policy_kwargs={"net_arch": [16]})
    model.save(tmp_path / "model.zip")
    policy = stable_baselines_policy(tmp_path / "model.zip")
    seen, info = env.reset(seed=3)
    with torch.no_grad():
        values = model.q_net(torch.as_tensor(seen)[None]).numpy()[0]
    there = np.flatnonzero(info["action_mask"])
    shot, _ = policy.predict(seen, action_masks=info["action_mask"])
    assert shot == there[values[there].argmax()]
    assert policy.predict(seen)[0] == values.argmax() != shot
