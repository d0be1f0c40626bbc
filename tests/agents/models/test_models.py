"""Performance of the models that come with the package."""

from __future__ import annotations

import subprocess
import sys
from importlib.resources import files

import numpy as np
import pytest

from agents import TrainedPolicy
from agents.benchmark import TASKS, contestant, make, measure
from agents.models import LEARNT, load
from agents.playing import LearnedPlayer
from curling_env.errors import InputError
from curling_env.game import player_named


@pytest.mark.parametrize("name", LEARNT)
def test_a_model_is_small_and_predicts_for_its_environment(name):
    assert files("agents.models").joinpath(f"{name}.npz").read_bytes().__sizeof__() < 1_000_000
    model = load(name)
    task, options = ("end-draw", {"actions": "shots"}) if name == "ends" else (name, {})
    env = make(task, **options)
    observation, info = env.reset(seed=1)
    masks = {"action_masks": info["action_mask"]} if name == "ends" else {}
    action, state = model.predict(observation, **masks)
    assert state is None
    assert env.action_space.contains(np.asarray(action)[()])
    many, _ = model.predict(np.stack([observation, observation]))
    assert len(many) == 2


def test_the_environment_of_a_model_takes_its_actions_as_they_are():
    import gymnasium

    for name in ("draw", "takeout"):
        model = load(name)
        assert isinstance(model, TrainedPolicy)
        env = gymnasium.make("CurlingSheet-v0", **model.environment())
        worth = []
        for seed in range(12):
            observation, _ = env.reset(seed=seed)
            _, _, _, _, info = env.step(model.predict(observation)[0])
            worth.append(info["distance_m"] if name == "draw" else info["success"])
        assert np.mean(worth) < 1.6 if name == "draw" else np.mean(worth) > 0.5


def test_learnt_is_far_better_than_chance_at_the_tasks_of_the_benchmark():
    who = contestant("learned")
    assert measure(TASKS["draw"], who, episodes=12).mean < 1.6
    assert measure(TASKS["takeout"], who, episodes=12).mean > 0.5
    assert measure(TASKS["end-draw"], who, episodes=6).mean > -2
    with pytest.raises(InputError, match="no model for the task guard; expected one of draw,"):
        measure(TASKS["guard"], who, episodes=2)


def test_models_are_known_by_name():
    assert isinstance(player_named("learned"), LearnedPlayer)
    with pytest.raises(
        InputError, match="unknown model 'guard'; expected one of draw, takeout, ends"
    ):
        load("guard")


def test_models_are_loaded_and_used_with_numpy_alone():
    program = """
import sys

class Blocked:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in ("torch", "stable_baselines3", "yaml", "ray"):
            raise ModuleNotFoundError(name)

sys.meta_path.insert(0, Blocked())
import gymnasium
import curling_env
from agents.models import load

env = gymnasium.make("CurlingSheet-v0", **load("draw").environment())
print(load("draw").predict(env.reset(seed=0)[0])[0].shape)
env = gymnasium.make("CurlingEnd-v0", actions="shots")
print(load("ends").predict(env.reset(seed=0)[0])[0].shape, load("takeout").throw_range.speed[0] > 1)
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert done.stdout.split("\n")[:2] == ["(3,)", "() True"], done.stderr
