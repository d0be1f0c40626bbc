"""Tasks: which throws do them, on one sheet and on many, and how hard their positions are."""

from __future__ import annotations

import warnings
from dataclasses import fields

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import curling_env  # noqa: F401  (registers the environments)
from curling_env.envs import TASKS, RewardParts, RewardWeights, TakeoutTask
from curling_env.errors import InputError
from curling_env.ice import load_ice
from curling_env.physics import Aim
from curling_env.sheet import HOUSE_RADIUS, Direction, to_delivery
from curling_env.throw import Throw

SPIN = 1.5
PARTS = tuple(part.name for part in fields(RewardParts))
AIM = Aim(load_ice("standard"), Direction.AWAY)


def make(**options):
    return gymnasium.make("CurlingSheet-v0", details=True, **options).unwrapped


def throw(env, shot: Throw):
    assert env.throw_of(env.action_of(shot)).speed == pytest.approx(shot.speed, abs=1e-3)
    return env.step(env.action_of(shot))


def button_weight() -> float:
    return AIM.draw(0.0, 0.0, SPIN).speed


def takes(x: float, weight: float, off: float = 0.0) -> Throw:
    """A hit of a stone at (x, 0), `weight` times as fast as a draw, `off` beside its centre [m]."""
    return AIM.through(x + off, 0.0, weight * button_weight(), SPIN)


GOOD = {
    "draw": lambda: AIM.draw(0.3, 0.2, SPIN),
    "guard": lambda: AIM.draw(0.1, -3.6, SPIN),
    "takeout": lambda: takes(0.0, 1.4, 0.1),
    "hit_and_stay": lambda: takes(0.0, 1.4, 0.01),
    "peel": lambda: takes(0.0, 1.55, 0.17),
    "freeze": lambda: AIM.draw(0.0, -0.31, SPIN),
}
BAD = {
    "draw": lambda: AIM.draw(0.9, 0.0, SPIN),
    "guard": lambda: AIM.draw(0.0, -1.0, SPIN),
    "takeout": lambda: takes(0.0, 1.4, 0.5),
    "hit_and_stay": lambda: takes(0.0, 1.55, 0.17),
    "peel": lambda: takes(0.0, 1.4, 0.01),
    "freeze": lambda: AIM.draw(0.0, 0.6, SPIN),
}


@pytest.mark.parametrize("name", TASKS)
def test_a_good_throw_does_the_task_and_a_bad_one_does_not(name):
    env = make(task=name)
    result, rewards = [], []
    for shots in (GOOD, BAD):
        env.reset(seed=0)
        _, reward, over, _, info = throw(env, shots[name]())
        assert over
        result.append(info)
        rewards.append(reward)
        assert tuple(info["reward_parts"]) == PARTS
        assert info["reward_parts"]["success"] == info["success"]
    assert [info["success"] for info in result] == [True, False]
    if name != "draw":  # its reward grows with precision alone
        assert rewards[0] > rewards[1]


def test_only_a_plain_takeout_leaves_the_shooter_free_to_stay_or_leave():
    done = {}
    for name in ("takeout", "hit_and_stay", "peel"):
        env = make(task=name)
        for shot in ("hit_and_stay", "peel"):
            env.reset(seed=0)
            done[name, shot] = throw(env, GOOD[shot]())[4]["success"]
    assert [shot == name or name == "takeout" for name, shot in done] == list(done.values())


def test_a_freeze_may_not_push_its_target_stone_away_nor_lie_behind_it():
    env = make(task="freeze")
    env.reset(seed=0)
    _, _, _, _, info = throw(env, AIM.draw(0.0, 1.2, SPIN))
    assert info["reward_parts"]["removed"] > 0
    assert not info["success"]
    env.reset(seed=0, options={"target": (0.0, 0.5)})
    behind = AIM.draw(0.31, 0.6, SPIN)
    _, _, _, _, info = throw(env, behind)
    assert info["reward_parts"]["removed"] == 0
    assert info["distance_m"] < 0.6
    assert not info["success"]


def test_the_target_stone_lies_at_the_goal_asked_for():
    env = make(task="takeout", target=(0.6, -0.4), stones=((0.0, -3.0),), direction="home")
    seen, info = env.reset(seed=0)
    names = dict(zip(env.observation.names, seen, strict=True))
    place = env.observation.scaled((0.6, -0.4))
    assert [names["stone 1 x"], names["stone 1 y"]] == pytest.approx(place)
    assert [names["target x"], names["target y"]] == pytest.approx(place)
    np.testing.assert_allclose(to_delivery(info["target"], Direction.HOME), (0.6, -0.4))
    # On even ice the same throw has the same effect towards the home end.
    _, _, _, _, info = throw(env, AIM.through(0.7, -0.4, 1.4 * button_weight(), SPIN))
    assert info["success"]
    freeze = make(task="freeze", target=(0.6, -0.4))
    gap = freeze.reset(seed=0)[1]["target"] - np.array((0.6, -0.4))
    assert np.hypot(*to_delivery(gap, Direction.AWAY)) == pytest.approx(2 * freeze.ice.stone.radius)


def test_weights_are_the_tasks_unless_others_are_asked_for():
    assert make(task="peel").weights is TASKS["peel"].weights
    own = RewardWeights(success=5.0)
    assert make(task="peel", weights=own).weights is own


def test_a_task_of_your_own_serves_in_place_of_a_name():
    class OutTheBack(TakeoutTask):
        def is_done(self, landing):
            return landing.is_out & (landing.stone[..., 1] < 0)

    env = make(task=OutTheBack(name="out_the_back", easiest_goal=(0.0, 0.3)))
    env.reset(seed=0)
    shot = AIM.through(0.01, 0.3, 1.4 * button_weight(), SPIN)
    assert throw(env, shot)[4]["success"] is False


# --- positions at random --------------------------------------------------------------------------


def positions(env, level, seeds=40):
    marks, counts = [], []
    for seed in range(seeds):
        seen, info = env.reset(seed=seed, options={"level": level})
        marks.append(to_delivery(info["target"], info["direction"]))
        counts.append(int((seen[-3 * env.observation.slots :: 3] != 0).sum()))
    return np.array(marks), np.array(counts)


@pytest.mark.parametrize("name", TASKS)
def test_levels_go_from_the_easiest_position_to_anywhere(name):
    env = make(task=name, stones=6, direction="random")
    given = TASKS[name].has_target_stone
    (easy, few), (middle, some), (hard, many) = (positions(env, v) for v in (0.0, 0.5, 1.0))
    assert np.ptp(easy, axis=0) == pytest.approx((0, 0))
    assert (few == given).all()
    assert some.max() == 3 + given
    assert many.max() == 6 + given
    spread = [np.hypot(*(marks - easy[0]).T).max() for marks in (middle, hard)]
    assert 0.3 < spread[0] < 0.6 * spread[1] + 0.05
    assert spread[1] < HOUSE_RADIUS


# --- one sheet and many ---------------------------------------------------------------------------


@pytest.mark.parametrize("name", TASKS)
def test_many_sheets_do_good_throws_and_miss_bad_ones(name):
    many = gymnasium.make_vec("CurlingSheet-v0", num_envs=2, task=name)
    many.reset(seed=0)
    actions = np.stack([many.unwrapped.action_of(shots[name]()) for shots in (GOOD, BAD)])
    assert many.step(actions)[-1]["success"].tolist() == [True, False]


@pytest.mark.parametrize("name", TASKS)
def test_the_checkers_of_gymnasium_and_stable_baselines_find_nothing(name):
    from stable_baselines3.common.env_checker import check_env as check_for_training

    options = {"task": name, "stones": 3, "level": 0.7}
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(make(render_mode="rgb_array", **options))
        check_for_training(make(**options))


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ({"task": "wiggle"}, "unknown task"),
        ({"task": "takeout", "throws": 2}, "one throw"),
        ({"level": 1.5}, "level"),
        ({"level": "hard"}, "level"),
        ({"task": "takeout", "stones": ((0.0, 0.0),), "level": 1e-9}, "no room"),
    ],
)
def test_options_that_make_no_sense_are_refused(options, says):
    with pytest.raises(InputError, match=says):
        make(**options).reset(seed=0)
