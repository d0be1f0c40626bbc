"""Start of episodes: random stones and targets, and options for one episode."""

from __future__ import annotations

import gymnasium
import numpy as np
import pytest

import curling_env  # noqa: F401  (registers the environments)
from curling_env.errors import InputError
from curling_env.sheet import HOUSE_RADIUS, TEE_Y, Direction, to_delivery


def make(**options):
    return gymnasium.make("CurlingSheet-v0", **options).unwrapped


def test_another_seed_lays_other_stones():
    env = make(stones=4, target="random")
    a, b = env.reset(seed=1)[0], env.reset(seed=2)[0]
    assert np.abs(a - b).max() > 0.05


def test_random_stones_and_targets_lie_where_they_should():
    env = make(stones=10, target="random")
    for seed in range(20):
        observation, info = env.reset(seed=seed)
        assert np.hypot(*to_delivery(info["target"], Direction.AWAY)) <= HOUSE_RADIUS
        places = observation[-33:].reshape(11, 3)
        assert (places[:10, 0] == -1).all()
        assert (places[10] == 0).all()
        xy = places[:10, 1:] * env.observation.scaled((1, 1)) ** -1
        apart = np.hypot(*(xy[:, None] - xy).transpose(2, 0, 1))[np.triu_indices(10, 1)]
        assert apart.min() > 2 * 0.145


def test_options_hold_for_one_episode():
    env = make(stones=1)
    _, info = env.reset(
        seed=0, options={"target": (0.5, -1.0), "stones": ((1.0, -2.0),), "direction": "home"}
    )
    np.testing.assert_allclose(info["target"], (-0.5, -TEE_Y + 1.0))
    assert info["direction"] is Direction.HOME
    assert env.reset()[1]["direction"] is Direction.AWAY


@pytest.mark.parametrize(
    ("options", "says"), [({"stone": 3}, "unknown option"), ({"stones": 3}, "places for 0 stones")]
)
def test_options_that_make_no_sense_are_refused(options, says):
    with pytest.raises(InputError, match=says):
        make().reset(options=options)
