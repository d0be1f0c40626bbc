"""Values of shots by simulation agree with the rules and with further play."""

from __future__ import annotations

import dataclasses
import pickle

import gymnasium
import numpy as np
import pytest
from learn.lessons import lessons_of

from agents.playing import ShotValues, views_of
from curling_env.envs import SHOTS
from curling_env.game import RestingStone, Team

NUMBERS = {shot.name: k for k, shot in enumerate(SHOTS)}
NOSE = NUMBERS["hit their stone 3 on the nose, board weight"]
THROUGH = NUMBERS["through the house"]
ONE_IN_THE_HOUSE = RestingStone(Team.AWAY, 2, 0.3, 0.0)


@pytest.fixture(scope="module")
def env():
    return gymnasium.make("CurlingEnd-v0", actions="shots", hammer="own").unwrapped


def before_the_last_stone(env, *stones: RestingStone, delivered: int = 15):
    """The environment's observation with these stones before the agent's last one."""
    env.reset(seed=4)
    game = env.state.game
    end = dataclasses.replace(game.end, stones=stones, delivered=delivered)
    state = dataclasses.replace(env.state, game=dataclasses.replace(game, end=end))
    return env.reset(options={"state": state})[0][None]


def test_every_shot_that_there_is_has_a_value(env, called):
    some = slice(4, 96, 23)  # early and late, with and without the hammer
    lessons = lessons_of(called.observations[some], env.simulator)
    for values in (lessons.once, lessons.expected):
        np.testing.assert_array_equal(np.isfinite(values), called.masks[some] > 0)
    again = lessons_of(called.observations[some], env.simulator)
    np.testing.assert_array_equal(lessons.expected, again.expected)
    # What is thrown without error tells much of what is thrown with it.
    over_none = lessons.expected - lessons.expected[:, -1:]
    both = np.isfinite(over_none)
    assert np.corrcoef(lessons.once[both], over_none[both])[0, 1] > 0.5


def test_with_the_last_stone_values_are_the_points_that_are_scored(env):
    seen = before_the_last_stone(env, ONE_IN_THE_HOUSE)
    lessons = lessons_of(seen, env.simulator)
    once, expected = lessons.once[0], lessons.expected[0]
    assert once[THROUGH] == 0
    assert expected[THROUGH] == pytest.approx(-1)
    # Without error a hit on the nose leaves the thrown stone alone in the house: one for one.
    assert once[NOSE] == pytest.approx(2)
    assert 0.6 < expected[NOSE] <= 1
    assert np.isnan(once[NUMBERS["hit their stone 1 on the nose, board weight"]])
    played = []
    for seed in range(30):
        before_the_last_stone(env, ONE_IN_THE_HOUSE)
        env.state = dataclasses.replace(env.state, seed=seed)
        played.append(env.step(NOSE)[1])
    assert expected[NOSE] == pytest.approx(np.mean(played), abs=0.25)


def test_a_guard_that_may_not_be_put_out_promises_nothing(env):
    lying = RestingStone(Team.AWAY, 0, 0.0, -3.0), RestingStone(Team.AWAY, 1, 0.0, 0.0)
    hit = NUMBERS["hit their stone 1 on the nose, peel weight"]
    early, late = (
        lessons_of(before_the_last_stone(env, *lying, delivered=n), env.simulator).once[0]
        for n in (3, 7)
    )
    assert early[hit] == pytest.approx(0, abs=1e-6)
    assert late[hit] != 0


def test_the_hand_of_the_environment_counts(env):
    seen = before_the_last_stone(env, RestingStone(Team.AWAY, 2, 0.0, -0.3))
    beginner = gymnasium.make("CurlingEnd-v0", actions="shots", skill="club").unwrapped
    sure, unsure = (lessons_of(seen, each.simulator) for each in (env, beginner))
    assert np.nanmax(unsure.expected) < np.nanmax(sure.expected) - 0.05
    np.testing.assert_array_equal(unsure.once, sure.once)


def test_the_cache_of_an_ice_is_not_copied(env):
    values, views = ShotValues(), views_of(before_the_last_stone(env, ONE_IN_THE_HOUSE))
    found = values.once(views)
    np.testing.assert_array_equal(pickle.loads(pickle.dumps(values)).once(views), found)
