"""Many ends at once are the ends that are played one at a time."""

from __future__ import annotations

import gymnasium as gym
import numpy as np
import pytest

import curling_env  # noqa: F401  (registers the environments)
from curling_env.errors import InputError
from curling_env.game import USUAL


def make(n, **settings):
    return gym.make_vec(
        "CurlingEnd-v0", num_envs=n, vectorization_mode="vector_entry_point", **settings
    )


def test_each_is_the_end_that_is_played_alone():
    many = make(4)
    alone = [gym.make("CurlingEnd-v0").unwrapped for _ in range(4)]
    seen, _ = many.reset(seed=20)
    for k, env in enumerate(alone):
        assert np.allclose(env.reset(seed=20 + k)[0], seen[k], atol=1e-6)
    rng = np.random.default_rng(0)
    for delivery in range(8):
        actions = rng.uniform(-1, 1, (4, 3)).astype(np.float32)
        seen, _, over, _, _ = many.step(actions)
        for k, env in enumerate(alone):
            one, _, ended, _, _ = env.step(actions[k])
            # Collisions multiply what little the two engines differ by.
            if delivery < 4:
                assert np.allclose(one, seen[k], atol=2e-3)
            assert ended == over[k]
    assert over.all()


def test_an_end_that_is_over_begins_anew():
    many = make(3, hammer="opponent", skill="none")
    first, _ = many.reset(seed=1)
    for _ in range(8):
        _, _, over, _, info = many.step(np.zeros((3, 3), dtype=np.float32))
    assert over.all()
    assert set(info["points"]) <= set(range(-8, 9))
    again, rewards, over, _, _ = many.step(np.zeros((3, 3), dtype=np.float32))
    assert np.array_equal(first, again)
    assert not rewards.any()
    assert not over.any()


@pytest.mark.parametrize("kind", ["dict", "planes"])
def test_other_observations_come_in_batches(kind):
    many = make(2, observation=kind)
    seen, _ = many.reset(seed=0)
    assert many.observation_space.contains(seen)


@pytest.mark.parametrize(
    ("settings", "word"),
    [
        ({"living": USUAL}, "living"),
        ({"sweeping": "scripted"}, "swept"),
        ({"render_mode": "rgb_array"}, "render_mode"),
    ],
)
def test_what_only_one_end_can_do_is_refused(settings, word):
    with pytest.raises(InputError, match=word):
        make(2, **settings)
