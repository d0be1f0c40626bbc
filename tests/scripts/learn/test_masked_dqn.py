"""DQN with masks: what a drawn step is worth."""

from __future__ import annotations

import numpy as np
from gymnasium import spaces
from learn.masked_dqn import MaskedBuffer


def test_a_drawn_step_adds_rewards_until_its_episode_ends_and_has_the_mask_after_it():
    seen = spaces.Box(-9, 99, (1,), dtype=np.float32)
    buffer = MaskedBuffer(8, seen, spaces.Discrete(3), handle_timeout_termination=False)
    for k in range(6):  # the third step ends an episode, and the sixth is the last up to now
        mask = np.array([True, k % 2 == 0, k == 3])
        here, after, over = (np.array([[float(one)]]) for one in (k, k + 1, k == 2))
        buffer.add(here, after, np.array([k % 3]), np.array([10.0**k]), over[0], [
            {"action_mask": mask}
        ])  # fmt: skip
    (here, _, after, over, rewards), masks = buffer.sample_masked(200, 2, np.random.default_rng(0))
    start = here.numpy().ravel().astype(int)
    assert set(start.tolist()) == set(range(6))
    last = np.where((start == 2) | (start == 5), start, start + 1)
    np.testing.assert_array_equal(after.numpy().ravel(), last + 1)
    np.testing.assert_array_equal(over.numpy().ravel(), last == 2)
    np.testing.assert_allclose(rewards.numpy().ravel(), 10.0**start + (last > start) * 10.0**last)
    np.testing.assert_array_equal(masks.numpy()[:, 1], last % 2 == 0)
    np.testing.assert_array_equal(masks.numpy()[:, 2], last == 3)
