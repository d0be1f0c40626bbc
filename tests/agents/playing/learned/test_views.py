"""Views have the observed positions and the observed friction."""

from __future__ import annotations

import gymnasium
import numpy as np
import pytest

from agents.playing import views_of
from curling_env.envs import mean_friction
from curling_env.envs.known_ice import squash, unsquash
from curling_env.errors import InputError
from curling_env.ice import load_ice


def test_a_view_has_the_observed_stones_in_order():
    env = gymnasium.make("CurlingEnd-v0", opponent="rulebased", actions="shots").unwrapped
    rng = np.random.default_rng(2)
    observation, info = env.reset(seed=5)
    over, met = False, 0
    while not over:
        (view,) = views_of(observation[None])
        end, true = view.game.end, env.state.game.end
        assert (end.delivered, end.hammer, view.team) == (true.delivered, true.hammer, 0)
        assert {(s.team, s.number) for s in end.stones} == {(s.team, s.number) for s in true.stones}
        by_number = {(s.team, s.number): (s.x, s.y) for s in true.stones}
        for stone in end.stones:
            place = by_number[stone.team, stone.number]
            assert (stone.x, stone.y) == pytest.approx(place, abs=1e-5)
        assert view.ice is views_of(observation[None])[0].ice
        np.testing.assert_array_equal(view.ice.friction.mu, env.simulator.known_ice.friction.mu)
        met += len(end.stones)
        observation, _, over, _, info = env.step(rng.choice(np.flatnonzero(info["action_mask"])))
    assert met > 10


def test_the_ice_of_a_view_has_the_observed_friction():
    env = gymnasium.make("CurlingEnd-v0", actions="shots", ice="club")
    observation, _ = env.reset(seed=1)
    (view,) = views_of(observation[None])
    true = float(load_ice("club").friction.mu.mean())
    assert float(view.ice.friction.mu.mean()) == pytest.approx(true, rel=2e-3)
    assert view.ice.effects == load_ice("standard").effects


def test_numbers_can_be_read_back():
    numbers = np.linspace(-7, 7, 41)
    np.testing.assert_allclose(unsquash(squash(numbers)), numbers, atol=1e-12)
    no_ice = mean_friction(np.array([-1.0, 1.0]))
    np.testing.assert_allclose(no_ice, [0.01 * np.exp(-2), 0.01 * np.exp(2)])


def test_other_observations_are_refused():
    with pytest.raises(InputError, match="flat observations"):
        views_of(np.zeros((1, 20)))
