"""stable-baselines3 on many sheets at once."""

from __future__ import annotations

import warnings

import gymnasium
import numpy as np
import pytest

pytest.importorskip("stable_baselines3")

import stable_baselines3 as sb3
from stable_baselines3.common.evaluation import evaluate_policy

from agents.learning import RandomIces, RandomIceVecEnv, SheetVecEnv
from curling_env.envs import ThrowRange
from curling_env.errors import InputError
from curling_env.physics import Aim
from curling_env.sheet import Direction

N = 8


def sheets(skill: str = "none", **options) -> SheetVecEnv:
    options = {"autoreset_mode": "SameStep", "target": "random", **options}
    return SheetVecEnv(gymnasium.make_vec("CurlingSheet-v0", num_envs=N, **options), skill)


ALGORITHMS = {
    "SAC": {"learning_starts": 64, "batch_size": 32, "gradient_steps": 2},
    "PPO": {"n_steps": 16, "batch_size": 64, "n_epochs": 2},
}


@pytest.mark.parametrize("name", ALGORITHMS)
def test_algorithms_train_on_it(name):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        envs = sheets("club", throws=2)
        model = getattr(sb3, name)(
            "MlpPolicy", envs, seed=1, device="cpu", policy_kwargs={"net_arch": [16]},
            **ALGORITHMS[name],
        )  # fmt: skip
        before = [value.clone() for value in model.policy.parameters()]
        model.learn(384)
    assert model.num_timesteps == 384
    assert len(model.ep_info_buffer) == 100
    assert {info["l"] for info in model.ep_info_buffer} == {2}
    assert len(model.ep_success_buffer) == 100  # which is logged as success_rate
    after = list(model.policy.parameters())
    assert any((a != b).any() for a, b in zip(before, after, strict=True))
    # What it learnt on many sheets it throws on one.
    rewards, _ = evaluate_policy(model, envs, n_eval_episodes=N, return_episode_rewards=True)
    assert np.isfinite(rewards).all()
    alone = gymnasium.make("CurlingSheet-v0", target="random", throws=2)
    assert model.predict(alone.reset(seed=0)[0])[0] in alone.action_space


def test_batch_results_equal_single_ones(rng):
    envs, alone = sheets(throws=2), gymnasium.make("CurlingSheet-v0", target="random", throws=2)
    envs.seed(5)
    first = envs.reset()
    actions = rng.uniform(-1, 1, (2, N, 3)).astype(np.float32) * np.float32([1, 0.5, 0.3])
    steps = [envs.step(action) for action in actions]
    for i in range(N):
        np.testing.assert_array_equal(first[i], alone.reset(seed=5 + i)[0])
        total = 0.0
        for (seen, rewards, over, infos), action in zip(steps, actions, strict=True):
            last, reward, ended, _, info = alone.step(action[i])
            total += reward
            np.testing.assert_allclose(
                infos[i].get("terminal_observation", seen[i]), last, atol=1e-3
            )
            assert rewards[i] == pytest.approx(reward, abs=2e-3)
            assert over[i] == ended
            assert infos[i]["status"] == info["status"]
            assert infos[i]["success"] == info["success"]
            assert infos[i].get("is_success") == (info["success"] if ended else None)
        assert infos[i]["episode"]["l"] == 2
        assert infos[i]["episode"]["r"] == pytest.approx(total, abs=4e-3)


def test_execution_errors_have_the_scatter_of_the_skill():
    thrown: dict[str, list[float]] = {}
    for skill in ("none", "club"):
        envs = sheets(skill, target=(0.0, 0.0))
        envs.seed(2)
        envs.reset()
        rewards = [envs.step(np.zeros((N, 3), dtype=np.float32))[1] for _ in range(4)]
        envs.seed(2)
        envs.reset()
        again = [envs.step(np.zeros((N, 3), dtype=np.float32))[1] for _ in range(4)]
        np.testing.assert_array_equal(rewards, again)
        thrown[skill] = np.ravel(rewards).tolist()
    assert len(set(thrown["none"])) == 1
    assert len(set(thrown["club"])) == 4 * N


def test_other_environments_are_refused():
    with pytest.raises(InputError, match="SameStep"):
        sheets(autoreset_mode="NextStep")
    with pytest.raises(InputError, match="CurlingSheet-v0"):
        SheetVecEnv(gymnasium.make_vec("CartPole-v1", num_envs=2))
    with pytest.raises(InputError, match="share"):
        sheets().set_attr("ice", None)


def many(**others) -> RandomIceVecEnv:
    options = {
        "ices": RandomIces(), "groups": 2, "throw_range": ThrowRange(speed=(1.8, 2.4)), **others,
    }  # fmt: skip
    return RandomIceVecEnv(N, **options)


def test_many_ices_are_new_ones_every_few_throws_and_the_same_for_a_seed():
    def run(seed: int) -> tuple[list, list]:
        envs = many(throws_on_one=2, skill="club")
        envs.seed(seed)
        seen, rewards = [envs.reset()], []
        for _ in range(4):
            observation, reward, over, infos = envs.step(np.zeros((N, 3), dtype=np.float32))
            seen.append(observation)
            rewards.append(reward)
            assert over.all()
            assert all(info["terminal_observation"].shape == seen[0][0].shape for info in infos)
        return seen, rewards

    seen, rewards = run(3)
    again, rewards_again = run(3)
    np.testing.assert_array_equal(seen, again)
    np.testing.assert_array_equal(rewards, rewards_again)
    ices = [{tuple(row[3:]) for row in observation.tolist()} for observation in seen]
    assert [len(some) for some in ices] == [2] * 5
    assert ices[0] == ices[1]
    assert not ices[1] & ices[2]
    assert not np.array_equal(seen[0], run(4)[0][0])


def test_many_ices_need_a_range_of_throws_independent_of_the_ice():
    with pytest.raises(InputError, match="throw_range"):
        many(throw_range=None)
    with pytest.raises(InputError, match="evenly"):
        many(groups=3)


def test_a_draw_to_the_target_counts_as_a_success():
    envs = sheets(target=(0.0, 0.0))
    inner = envs.sheets
    envs.seed(0)
    envs.reset()
    aim = Aim(inner.ice, Direction.AWAY).draw(0.0, 0.0, 1.5)
    assert aim is not None
    actions = np.tile(inner.action_of(aim), (N, 1))
    actions[1::2, 0] = -1.0  # dies at the hog line
    infos = envs.step(actions)[3]
    assert [info["is_success"] for info in infos] == [True, False] * (N // 2)
