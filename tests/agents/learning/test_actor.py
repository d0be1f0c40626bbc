"""Policies evaluated in NumPy act as stable-baselines3's own."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest
from gymnasium import spaces

from agents.learning import ALGORITHMS, TrainingSettings, actor_of, policy_kwargs_of

SIZE = 7


def policy_of(settings: TrainingSettings):
    sb3 = pytest.importorskip("stable_baselines3")
    rng = np.random.default_rng(0)
    mean, deviation = rng.normal(size=SIZE), np.append(rng.random(SIZE - 1), 0.0)
    kinds = {"ppo": sb3.ppo.MlpPolicy, "sac": sb3.sac.MlpPolicy, "td3": sb3.td3.MlpPolicy}
    policy = kinds[settings.algorithm](
        spaces.Box(-1, 1, (SIZE,), np.float32),
        spaces.Box(-1, 1, (3,), np.float32),
        lambda _: 1e-3,
        **policy_kwargs_of(settings, mean.astype(np.float32), deviation.astype(np.float32)),
    )
    for parameter in policy.parameters():
        parameter.data += 0.3 * rng.standard_normal(parameter.shape).astype(np.float32)
    policy.set_training_mode(False)
    return policy


@pytest.mark.parametrize("algorithm", ALGORITHMS)
@pytest.mark.parametrize(
    ("activation", "normalize"), [(None, True), ("elu", False), ("relu", True)]
)
def test_an_actor_acts_as_the_policy_whose_weights_it_has(algorithm, activation, normalize):
    chosen = {"net_arch": [5, 4]} | ({} if activation is None else {"activation_fn": activation})
    settings = TrainingSettings(algorithm=algorithm, normalize=normalize, policy_kwargs=chosen)
    policy = policy_of(settings)
    weights = {name: tensor.numpy() for name, tensor in policy.state_dict().items()}
    actor = actor_of(weights, settings, SIZE)
    seen = np.random.default_rng(1).normal(size=(50, SIZE)).astype(np.float32)
    wanted, _ = policy.predict(seen, deterministic=True)
    got, _ = actor.predict(seen, deterministic=True)
    np.testing.assert_allclose(got, wanted, atol=2e-6)
    one, _ = actor.predict(seen[3], deterministic=True)
    np.testing.assert_allclose(one, wanted[3], atol=2e-6)


@pytest.mark.parametrize("algorithm", ["ppo", "sac"])
def test_drawn_actions_scatter_as_those_of_the_policy(algorithm):
    settings = TrainingSettings(algorithm=algorithm, policy_kwargs={"net_arch": [5, 4]})
    policy = policy_of(settings)
    weights = {name: tensor.numpy() for name, tensor in policy.state_dict().items()}
    actor = actor_of(weights, settings, SIZE)
    seen = np.repeat(np.random.default_rng(2).normal(size=(1, SIZE)), 4000, axis=0)
    wanted, _ = policy.predict(seen.astype(np.float32), deterministic=False)
    got, _ = actor.predict(seen, rng=np.random.default_rng(3))
    np.testing.assert_allclose(got.mean(0), wanted.mean(0), atol=0.06)
    np.testing.assert_allclose(got.std(0), wanted.std(0), rtol=0.1, atol=0.02)


def test_a_model_is_used_without_pytorch():
    program = (
        "import sys; sys.modules['torch'] = None; from agents.learning.policy import TrainedPolicy"
    )
    assert subprocess.run([sys.executable, "-c", program]).returncode == 0
