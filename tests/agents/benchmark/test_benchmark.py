"""The benchmark's tasks are fixed, and who can do one is measured with an interval."""

from __future__ import annotations

import hashlib
import json

import gymnasium
import numpy as np
import pytest

from agents.benchmark import TASKS, Score, contestant, difference_of, ices, make, measure
from curling_env.errors import InputError


def test_the_end_of_doubles_begins_with_placed_stones():
    env = make("end-doubles").unwrapped
    env.reset(seed=1_000_000)
    game = env.state.game
    assert game.end is not None
    assert sum(stone.number == 5 for stone in game.end.stones) == 2
    assert game.rules.deliveries == 10


def test_ten_tasks_count_and_each_can_be_made():
    practice = [name for name, task in TASKS.items() if not task.headline]
    assert practice == ["end-doubles", "end-draw"]
    assert len(TASKS) - len(practice) == 10
    for name, task in TASKS.items():
        env = make(name)
        env.reset(seed=0)
        assert env.spec.id == task.environment
        assert env.spec.reward_threshold == task.reward_threshold
        json.loads(env.spec.to_json())  # plain data, to be written down


def test_all_policies_play_the_same_episodes():
    first = measure(TASKS["draw"], contestant("random"), episodes=20)
    assert first == measure(TASKS["draw"], contestant("random"), episodes=20)
    assert first.low < first.mean < first.high
    still = measure(TASKS["draw"], contestant(lambda seen: np.zeros(3)), episodes=20)
    assert still.mean != first.mean


def test_the_reward_is_that_of_the_environment():
    result = measure(TASKS["end-draw"], contestant("draw"), episodes=4)
    assert result.reward == pytest.approx(result.mean)  # an end is rewarded with its points
    env = make("draw")
    rewards = []
    for k in range(3):
        env.reset(seed=1_000_000 + k)
        rewards.append(env.step(np.zeros(3, dtype=np.float32))[1])
    zero = measure(TASKS["draw"], contestant(lambda seen: np.zeros(3)), episodes=3)
    assert zero.reward == pytest.approx(np.mean(rewards))


def test_the_environments_say_from_which_reward_they_count_as_solved():
    for name, threshold in (("CurlingSheet-v0", 1.0), ("CurlingEnd-v0", 0.2)):
        assert gymnasium.spec(name).reward_threshold == threshold
    assert TASKS["end-draw"].reward_threshold == 1.3


def test_who_thinks_is_better_than_chance():
    by_chance = measure(TASKS["draw"], contestant("random"), episodes=8)
    planned = measure(TASKS["draw"], contestant("planner"), episodes=4)
    assert planned.mean < 0.6 * by_chance.mean
    ends = TASKS["end-draw"]
    assert (
        measure(ends, contestant("rulebased"), episodes=6).mean
        > measure(ends, contestant("random"), episodes=6).mean + 1
    )


def test_the_command_prints_the_table_and_json(curling):
    result = curling("benchmark", "random", "--task", "guard", "--episodes", "5", "--json").json()
    (score,) = result["scores"]
    assert (result["policy"], score["task"], score["metric"]) == ("random", "guard", "success")
    assert score["version"] == 1
    shown = curling("benchmark", "random", "--task", "end-draw", "--episodes", "2")
    assert shown.out.startswith("end-draw")


def test_two_are_compared_in_the_same_episodes(curling):
    asked = ("random", "--against", "random", "--episodes", "3")
    result = curling("benchmark", *asked, "--task", "guard", "--task", "takeout", "--json").json()
    assert (result["against"], len(result["differences"])) == ("random", 2)
    assert result["together"] == {"mean": 0.0, "low": 0.0, "high": 0.0, "episodes": 3}
    shown = curling("benchmark", *asked, "--task", "guard", "--task", "draw").out
    assert shown.count("more than random") == 2
    assert "together" not in shown  # shares of successes and distances have no common mean


def test_a_difference_is_that_of_each_episode():
    luck = np.random.default_rng(0).normal(0, 3, (2, 50))
    apart = difference_of(luck + np.array([[0.5], [0.1]]), luck)
    assert apart.mean == pytest.approx(0.3)
    assert (apart.low, apart.high, apart.episodes) == (pytest.approx(0.3), pytest.approx(0.3), 50)
    assert difference_of(luck, -luck).high - difference_of(luck, -luck).low > 0.5
    assert apart.in_words() == "+0.30 (+0.30 to +0.30)"


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (("absent",), "unknown policy 'absent'; expected one of constant, draw, greedy, learned,"),
        (
            ("random", "--task", "curl"),
            "unknown task 'curl' of the benchmark; expected one of draw, ",
        ),
        (("planner", "--task", "end-draw"), "the planner plans single throws"),
        (("draw", "--task", "draw"), "plays ends"),
        (("nowhere.npz",), "no such file"),
    ],
)
def test_contestants_that_cannot_do_a_task_are_rejected(curling, arguments, says):
    assert says in curling("benchmark", *arguments, "--episodes", "2").complaint


def test_scores_read_in_words():
    score = Score(
        task="guard", metric="success", mean=0.4, low=0.3, high=0.5, episodes=9, reward=-0.7
    )
    assert score.in_words() == "40 % (30–50)"
    with pytest.raises(InputError, match="at least 2"):
        measure(TASKS["draw"], contestant("random"), episodes=1)


def test_the_ices_are_those_of_the_file_and_others_are_refused(monkeypatch):
    env = make("draw").unwrapped
    first = [env.reset(seed=1_000_000 + k) and env.thrown_ice.friction.mu for k in range(3)]
    assert first[0][44, 4] == pytest.approx(0.008835, abs=1e-6)
    known = env.known_ice.friction.mu / env.thrown_ice.friction.mu
    assert 0.005 < np.log(known).std() < 0.03
    # What is drawn here is what the file holds, but for the step in which it is kept.
    drawn = ices.DISTRIBUTION.draw_many([np.random.default_rng((ices.SEED, 3))])
    kept = ices.read_ices()
    np.testing.assert_allclose(kept.ices.mu[3], drawn.ices.mu[0], rtol=0.6 * ices.STEP)
    np.testing.assert_allclose(kept.estimated[3], drawn.estimated[0], rtol=1.2 * ices.STEP)
    monkeypatch.setattr(ices, "SHA256", hashlib.sha256(b"another").hexdigest())
    with pytest.raises(InputError, match="other ices than those of the benchmark"):
        ices.read_ices()


def test_one_action_for_all_scores_below_those_who_see_the_stones():
    task = TASKS["end-rulebased"]
    blind, seeing = (
        measure(task, contestant(name), episodes=60) for name in ("constant", "rulebased")
    )
    assert blind.mean < seeing.mean - 0.3


class Masked:
    """A policy of shots that remembers how many it has called in an end."""

    def predict(self, observation, state=None, deterministic=False, action_masks=None):
        number = 0 if state is None else state
        assert action_masks.shape == (201,)
        return int(np.flatnonzero(action_masks)[number % 3]), number + 1


def test_policies_of_shots_are_measured_with_masks_and_memory():
    score = measure(TASKS["end-rulebased"], contestant(Masked()), episodes=3)
    assert -8 <= score.mean <= 8
    with pytest.raises(InputError, match="a policy must be one of"):
        contestant(3)


def test_a_model_of_stable_baselines_is_measured(tmp_path, curling):
    sb3 = pytest.importorskip("stable_baselines3")
    model = sb3.PPO("MlpPolicy", make("draw"), n_steps=8, batch_size=8, seed=0)
    model.save(tmp_path / "ppo.zip")
    result = curling(
        "benchmark", tmp_path / "ppo.zip", "--task", "draw", "--episodes", "3", "--json"
    )
    (score,) = result.json()["scores"]
    model.policy.set_training_mode(False)
    same = measure(TASKS["draw"], contestant(model), episodes=3)
    assert score["mean"] == pytest.approx(same.mean)
    (tmp_path / "none.zip").write_bytes(b"PK")
    assert "saved by stable-baselines3" in curling("benchmark", tmp_path / "none.zip").complaint
