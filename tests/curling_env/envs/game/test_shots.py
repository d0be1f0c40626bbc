"""Shots as actions: each is made on an empty way, and the mask tells which there are."""

from __future__ import annotations

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import curling_env
from curling_env.envs import AGENT, DRAWS, SHOTS
from curling_env.errors import InputError

NUMBER = {shot.name: k for k, shot in enumerate(SHOTS)}


def make(**settings):
    settings = {"skill": "none", "hammer": "opponent", **settings}
    return gym.make("CurlingEnd-v0", actions="shots", details=True, **settings).unwrapped


def test_it_keeps_gymnasiums_contract_and_every_shot_has_a_name():
    env = make()
    check_env(env, skip_render_check=True)
    assert len(env.action.names) == len(set(env.action.names)) == env.action_space.n


def test_a_masked_policy_is_given_the_shots_that_it_has():
    asked = []

    class Masked:
        def predict(self, observation, state=None, deterministic=False, action_masks=None):
            asked.append(action_masks)
            return int(np.flatnonzero(action_masks)[-2]), None

    env = make(opponent=Masked(), hammer="opponent")
    env.reset(seed=0)
    for k in range(8):
        _, _, over, _, info = env.step(0)
        shot = info["shots"][1]
        assert asked[k].shape == (env.action_space.n,)
        name = env.action.names[np.flatnonzero(asked[k])[-2]]
        assert shot.call.shot in (name, "through the house")
    assert over
    assert len({tuple(mask) for mask in asked}) > 4  # they follow from the stones
    assert all(mask.sum() < len(mask) for mask in asked)

    def function(observation, action_masks):
        return int(np.flatnonzero(action_masks)[0])

    env = make(opponent=function, hammer="own")
    assert env.reset(seed=0)[1]["shots"][0].call.shot == env.action.names[0]


@pytest.mark.parametrize("name", DRAWS)
def test_a_draw_rests_where_its_name_says(name):
    env = make()
    env.reset(seed=0)
    for turn in ("clockwise", "counter-clockwise"):
        env.reset(seed=0)
        *_, info = env.step(NUMBER[f"draw to {name}, {turn}"])
        shot = info["shots"][0]
        (stone,) = [s for s in shot.stones_after if s.team is AGENT]
        assert (stone.x, stone.y) == pytest.approx(DRAWS[name], abs=0.02)
        assert (shot.thrown.spin > 0) == (turn == "counter-clockwise")


def test_hits_freezes_and_guards_are_about_the_stone_they_name():
    env = make(hammer="own", opponent="draw")
    env.reset(seed=0)
    (theirs,) = env.state.game.end.stones
    kept = env.state
    *_, info = env.step(NUMBER["guard their stone 1"])
    guard = next(s for s in info["shots"][0].stones_after if s.team is AGENT)
    assert (guard.x, guard.y) == pytest.approx((theirs.x, theirs.y - 1.6), abs=0.02)
    env.state = kept
    *_, info = env.step(NUMBER["freeze to their stone 1"])
    frozen = next(s for s in info["shots"][0].stones_after if s.team is AGENT)
    assert np.hypot(frozen.x - theirs.x, frozen.y - theirs.y) == pytest.approx(0.31, abs=0.02)
    assert frozen.y < theirs.y
    free = make(hammer="own", rules={"free_guard_until": 0, "no_takeout_until": 0})
    free.reset(seed=0)
    *_, info = free.step(NUMBER["hit their stone 1 on the nose, board weight"])
    assert {s.team for s in info["shots"][0].stones_after} == {AGENT}


def test_the_mask_has_what_there_is():
    env = make(hammer="own", opponent="draw")
    _, info = env.reset(seed=0)
    mask = info["action_mask"]
    assert env.action_space.sample(mask) in env.action_space
    np.testing.assert_array_equal(mask, env.action_masks())
    there = {SHOTS[k].name for k in np.flatnonzero(mask)}
    assert "hit their stone 1 on the nose, peel weight" in there
    assert "hit their stone 2 on the nose, peel weight" not in there
    assert "hit own stone 1 on the nose, peel weight" not in there
    assert "draw to the button, clockwise" not in there  # a stone lies there
    assert "draw to a long centre guard, clockwise" in there
    over = False
    while not over:
        _, _, over, _, info = env.step(env.action_space.sample(info["action_mask"]))
        if env.state.game.end is not None and env.state.game.end.delivered == 15:
            last = {SHOTS[k].name for k in np.flatnonzero(info["action_mask"])}
            assert not any("guard" in name for name in last)


@pytest.mark.parametrize("mode", ["NextStep", "SameStep"])
def test_many_ends_have_shots_and_masks_too(mode):
    settings = {"actions": "shots", "skill": "none", "hammer": "own"}
    many = gym.make_vec("CurlingEnd-v0", num_envs=3, autoreset_mode=mode, **settings)
    sync = gym.make_vec(
        "CurlingEnd-v0",
        num_envs=3,
        vectorization_mode="sync",
        vector_kwargs={"autoreset_mode": mode},
        **settings,
    )
    for envs in (many, sync):
        _, info = envs.reset(seed=2)
    shots = np.array([NUMBER["draw to a left corner guard, clockwise"]] * 3)
    for _ in range(9):
        (*_, info), (*_, other) = many.step(shots), sync.step(shots)
        assert info.keys() == other.keys()
        assert info["action_mask"].dtype == other["action_mask"].dtype
        np.testing.assert_array_equal(info["action_mask"], other["action_mask"])
    np.testing.assert_array_equal(many.unwrapped.action_masks(), info["action_mask"])


@pytest.mark.parametrize("kind", ["flat", "dict", "planes"])
def test_the_two_team_game_has_shots_and_masks(kind):
    """Masks are in the observation, where PettingZoo's own games have them, and in the infos."""
    pytest.importorskip("pettingzoo")
    plain = curling_env.curling_v0.env(observation=kind, ends=1)
    env = curling_env.curling_v0.env(actions="shots", observation=kind, ends=1)
    env.reset(seed=0)
    plain.reset(seed=0)
    space = env.observation_space("home")
    assert space["observation"] == plain.observation_space("home")
    assert space["action_mask"] == gym.spaces.Box(0, 1, (len(SHOTS),), np.int8)
    first, expected = env.observe("home")["observation"], plain.observe("home")
    if kind == "flat":
        first, expected = {"": first}, {"": expected}
    for name in expected:
        np.testing.assert_array_equal(first[name], expected[name])
    env.action_space("home").seed(0)
    for agent in env.agent_iter():
        seen, _, terminated, truncated, info = env.last()
        assert seen in space
        assert seen["action_mask"].dtype == np.int8
        np.testing.assert_array_equal(seen["action_mask"], info["action_mask"])
        over = terminated or truncated
        env.step(None if over else env.action_space(agent).sample(seen["action_mask"]))
    assert env.unwrapped.state.game.is_over or env.unwrapped.state.game.end is None


@pytest.mark.parametrize(
    ("settings", "says"),
    [
        ({"actions": "shot"}, "actions must be 'throws' or 'shots'"),
        ({"sweeping": "action"}, "sweeping and choices as actions need"),
        ({"choices": "action"}, "sweeping and choices as actions need"),
    ],
)
def test_settings_that_make_no_sense_are_refused(settings, says):
    with pytest.raises(InputError, match=says):
        gym.make("CurlingEnd-v0", **{"actions": "shots", **settings})


@pytest.mark.parametrize("action", [-1, len(SHOTS), 1.5, [1]])
def test_actions_that_are_no_shots_are_refused(action):
    env = make()
    env.reset(seed=0)
    with pytest.raises(InputError, match="number of a shot"):
        env.step(action)


def test_throws_have_no_mask():
    env = gym.make("CurlingEnd-v0").unwrapped
    _, info = env.reset(seed=0)
    assert "action_mask" not in info
    with pytest.raises(InputError, match="actions='shots'"):
        env.action_masks()
