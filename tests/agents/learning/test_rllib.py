"""RLlib on the same sheets with the same configuration, and a model of the same kind."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("stable_baselines3")

from agents import TrainedPolicy
from agents.learning import (
    TrainingSettings,
    compare_with_planner,
    evaluation_draws,
    load_settings,
    make_vec_env,
    new_model,
    read_model,
    settings_from,
)
from agents.learning.configuration import configurations
from agents.learning.rllib import (
    RLlibVectorEnv,
    rllib_parameters,
    take_weights,
    train,
    weights_for_rllib,
)
from curling_env.errors import InputError
from curling_env.ice import load_ice
from curling_env.sheet import Direction, tee


def settings(**others: object) -> TrainingSettings:
    document = {
        "algorithm": "ppo",
        "n_timesteps": 256,
        "n_envs": 8,
        "n_steps": 8,
        "batch_size": 32,
        "policy_kwargs": {"net_arch": [8, 6], "activation_fn": "relu", "log_std_init": -1.0},
        "normalize": True,
        "env_kwargs": {"target": "random"},
        "skill": "elite",
    }
    return settings_from({**document, **others})


def model_of(chosen: TrainingSettings):
    return new_model(make_vec_env(chosen, load_ice("standard")), chosen)


# --- a configuration by RLlib's names ------------------------------------------------------------


PPO = [c for c in configurations() if c != "ends-league" and load_settings(c).algorithm == "ppo"]


@pytest.mark.parametrize("name", PPO)
def test_the_projects_configurations_are_all_understood(name: str) -> None:
    chosen = load_settings(name)
    words = rllib_parameters(chosen, 2)
    given = chosen.hyperparameters
    assert words["train_batch_size_per_learner"] == chosen.n_envs * given["n_steps"]
    assert words["minibatch_size"] == given["batch_size"]
    start = float(given["learning_rate"].removeprefix("lin_"))
    assert words["lr"] == [[0, start], [chosen.n_timesteps, 0.0]]
    assert words["grad_clip"] == 0.5  # left out: as stable-baselines3 has it


@pytest.mark.parametrize(
    ("wrong", "workers", "words"),
    [
        ({"target_kl": 0.1}, 1, "does not support target_kl"),
        ({"clip_range": "lin_0.2"}, 1, "no schedule for clip_range"),
        ({}, 3, "n_envs 8 cannot be divided evenly among 3 workers"),
    ],
)
def test_settings_that_rllib_lacks_are_refused(
    wrong: dict[str, object], workers: int, words: str
) -> None:
    with pytest.raises(InputError, match=words):
        rllib_parameters(settings(**wrong), workers)


def test_other_algorithms_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="only train ppo"):
        train(settings_from({"algorithm": "sac"}), tmp_path / "run", workers=1)
    assert not (tmp_path / "run").exists()


def test_weights_go_there_and_back() -> None:
    one, other = (model_of(settings(seed=seed, normalize=False)) for seed in (1, 2))
    seen = one.env.reset()
    before = one.predict(seen, deterministic=True)[0]
    assert np.abs(before - other.predict(seen, deterministic=True)[0]).max() > 1e-4
    take_weights(other.policy, weights_for_rllib(one.policy))
    np.testing.assert_array_equal(other.predict(seen, deterministic=True)[0], before)
    log_std = other.policy.log_std.detach().numpy()
    np.testing.assert_array_equal(log_std, one.policy.log_std.detach().numpy())


@pytest.mark.parametrize("throws", [1, 3])
def test_rllibs_sheets_are_the_same_sheets(throws: int) -> None:
    chosen = settings(env_kwargs={"target": "random", "throws": throws}, normalize=False)
    plain, look = (
        make_vec_env(chosen, load_ice("standard")),
        model_of(chosen).policy.features_extractor,
    )
    sheets = RLlibVectorEnv(make_vec_env(chosen, load_ice("standard")), look)
    plain.seed(5)
    seen = plain.reset()
    np.testing.assert_array_equal(sheets.reset(seed=5)[0], seen)
    rng = np.random.default_rng(0)
    for _ in range(2):
        for left in range(throws, 0, -1):
            actions = rng.uniform(-1, 1, (8, 3)).astype(np.float32)
            seen, rewards, over, reported = plain.step(actions)
            mine, paid, ended, cut, _ = sheets.step(actions)
            np.testing.assert_array_equal(paid, rewards)
            np.testing.assert_array_equal(ended, over)
            assert over.all() == (left == 1)
            assert not cut.any()
            if over.all():
                last = np.stack([info["terminal_observation"] for info in reported])
                np.testing.assert_array_equal(mine, last)
        # The step in which episodes begin throws nothing, whatever is asked for.
        mine, paid, ended, _, _ = sheets.step(np.ones((8, 3), dtype=np.float32))
        np.testing.assert_array_equal(mine, seen)
        assert not paid.any()
        assert not ended.any()


# --- the command ---------------------------------------------------------------------------------


def test_without_rllib_one_line_reports_the_missing_package(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, curling: Callable[..., Any]
) -> None:
    monkeypatch.setitem(sys.modules, "ray.rllib", None)
    monkeypatch.delitem(sys.modules, "ray.rllib.algorithms.ppo", raising=False)
    result = curling("train", "--workers", "rllib:2", "-o", tmp_path / "run")
    assert result.complaint.endswith(
        "this needs ray.rllib, which is not installed: pip install 'curling-sheet[rllib]'"
    )
    assert not (tmp_path / "run").exists()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--workers", "ray"], "--workers: expected rllib:N with a number"),
        (["--workers", "rllib:0"], "--workers: expected rllib:N with a number"),
        (["--workers", "rllib:2", "--resume", "nowhere.npz"], "write no checkpoints"),
        (
            ["--workers", "rllib:2", "--config", "ends-league"],
            "cannot train a league",
        ),
    ],
)
def test_the_command_refuses_in_one_line(
    arguments: list[str], words: str, tmp_path: Path, curling: Callable[..., Any]
) -> None:
    assert words in curling("train", *arguments, "-o", tmp_path / "run").complaint
    assert not (tmp_path / "run").exists()


# --- with RLlib itself ---------------------------------------------------------------------------


@pytest.fixture
def rllib() -> None:
    pytest.importorskip(
        "ray.rllib.algorithms.ppo", reason="needs RLlib (pip install 'curling-sheet[rllib]')",
        exc_type=ImportError,
    )  # fmt: skip


@pytest.mark.usefixtures("rllib")
def test_rllibs_network_agrees_with_stable_baselines3s() -> None:
    import torch
    from ray.rllib.algorithms.ppo.torch.default_ppo_torch_rl_module import DefaultPPOTorchRLModule

    from agents.learning.rllib import rllib_model_of

    model = model_of(settings())
    sheets = RLlibVectorEnv(make_vec_env(settings(), load_ice("standard")), lambda seen: seen)
    module = DefaultPPOTorchRLModule(
        observation_space=sheets.single_observation_space,
        action_space=sheets.single_action_space,
        model_config=rllib_model_of(model.policy),
    )
    weights = weights_for_rllib(model.policy)
    named = dict(module.named_parameters())
    assert named.keys() == weights.keys()
    module.load_state_dict({k: torch.as_tensor(v) for k, v in weights.items()}, strict=False)
    seen = torch.as_tensor(sheets.reset(seed=0)[0])
    look = model.policy.features_extractor
    with torch.no_grad():
        output = module.forward_inference({"obs": look(seen)})["action_dist_inputs"]
        value = module.compute_values({"obs": look(seen)})
        wanted = model.policy.get_distribution(seen).distribution
        worth = model.policy.predict_values(seen)[:, 0]
    np.testing.assert_allclose(output[:, :3], wanted.mean, atol=1e-6)
    np.testing.assert_allclose(output[:, 3:].exp(), wanted.stddev, atol=1e-6)
    np.testing.assert_allclose(value, worth, atol=1e-6)


@pytest.mark.slow
@pytest.mark.usefixtures("rllib")
def test_two_local_workers_learn_to_draw_and_the_model_throws(
    tmp_path: Path, curling: Callable[..., Any]
) -> None:
    # Throws that are not centred on the best one: an untrained policy misses by metres.
    options = {
        "target": [0.0, 0.0],
        "throw_range": {"speed": [1.5, 2.4], "angle": [-0.15, 0.15], "spin": [0.5, 1.5]},
    }
    chosen = load_settings("button-one-ice", env_kwargs=options, n_timesteps=32768)
    (tmp_path / "wide.yml").write_text(json.dumps(chosen.as_dict()))
    arguments = ["--config", tmp_path / "wide.yml", "--targets", 1, "--workers", "rllib:2"]
    result = curling("train", *arguments, "-o", tmp_path)
    assert result.status == 0, result.err
    ice, model = load_ice("standard"), model_of(chosen)
    trained = TrainedPolicy.load(tmp_path / "model.npz")
    fresh = TrainedPolicy(actor=model.policy, settings=chosen, throw_range=trained.throw_range)
    before = compare_with_planner(fresh, evaluation_draws(chosen, ice, 1))["agent_over_best"][
        "ratio"
    ]
    after = result.json()["agent_over_best"]["ratio"]
    assert before > 3
    assert after < 1.1
    untrained = model.policy.state_dict()
    learnt = read_model(tmp_path / "model.npz")["policy"]
    untrained = {name: tensor.numpy() for name, tensor in untrained.items()}
    assert learnt.keys() == untrained.keys()
    # On one ice with one target nothing that is seen changes: of the first layer the bias learns.
    for name in ("policy_net.0", "value_net.0"):
        assert (
            learnt[f"mlp_extractor.{name}.bias"] != untrained[f"mlp_extractor.{name}.bias"]
        ).any()
    for name in ("action_net.weight", "action_net.bias", "value_net.weight", "log_std"):
        assert (learnt[name] != untrained[name]).all(), name
    for name in (name for name in learnt if "features_extractor" in name):
        assert (learnt[name] == untrained[name]).all(), name
    assert 1.87 < trained.throws(ice, tee(Direction.AWAY))[0, 0] < 2.33
