"""DQN with a mask of the available actions, which that of stable-baselines3 lacks."""

# stable-baselines3 leaves parts untyped.
# pyright: basic

from __future__ import annotations

from typing import Any

import numpy as np
import torch
from stable_baselines3 import DQN
from stable_baselines3.common.buffers import ReplayBuffer
from torch.nn.functional import smooth_l1_loss

IMPOSSIBLE = -1e9
"""Value of an unavailable action."""


class MaskedBuffer(ReplayBuffer):
    """Replay buffer with the available actions of the next observation, instead of timeouts."""

    def __init__(self, *args: Any, **options: Any) -> None:
        super().__init__(*args, **options)
        choices = int(self.action_space.n)  # pyright: ignore[reportAttributeAccessIssue]
        self.masks = np.zeros((self.buffer_size, self.n_envs, choices), dtype=bool)

    def add(self, *given: Any) -> None:
        """Store a step of every environment; the last argument is their `info`."""
        self.masks[self.pos] = [info["action_mask"] for info in given[-1]]
        super().add(*given)

    def sample_masked(
        self, number: int, steps: int, rng: np.random.Generator
    ) -> tuple[list[torch.Tensor], torch.Tensor]:
        """Draw steps at random, and the mask of the actions after each.

        Each spans up to `steps` steps, or the rest of its episode; its reward is their sum.
        """
        rows = rng.integers(self.buffer_size if self.full else self.pos, size=number)
        columns = rng.integers(self.n_envs, size=number)
        last, rewards = rows.copy(), self.rewards[rows, columns].copy()
        for _ in range(steps - 1):
            after = (last + 1) % self.buffer_size
            goes_on = (self.dones[last, columns] == 0) & (after != self.pos)
            last = np.where(goes_on, after, last)
            rewards += goes_on * self.rewards[last, columns]
        drawn = (
            self.observations[rows, columns],
            self.actions[rows, columns],
            self.next_observations[last, columns],
            self.dones[last, columns],
            rewards,
        )
        return [self.to_torch(array) for array in drawn], self.to_torch(self.masks[last, columns])


class MaskedDQN(DQN):
    """DQN whose exploration, choice and targets are limited to the available actions.

    The environments give the mask of each as `action_masks`, and in `info` as `action_mask`.

    Parameters
    ----------
    args, options : as for `DQN`, with gamma 1
    n_steps : number of steps whose rewards are added before the value of a position counts
    """

    replay_buffer: MaskedBuffer

    def __init__(self, *args: Any, n_steps: int = 1, **options: Any) -> None:
        super().__init__(*args, replay_buffer_class=MaskedBuffer, **options)
        self.n_steps = n_steps
        self.rng = np.random.default_rng(self.seed)

    def _sample_action(
        self, learning_starts: int, action_noise: Any = None, n_envs: int = 1
    ) -> tuple[Any, Any]:
        assert self.env is not None
        masks = np.array(self.env.env_method("action_masks"), dtype=bool)
        seen = torch.as_tensor(self._last_obs)
        with torch.no_grad():
            values = self.q_net(seen).numpy()
        rate = 1.0 if self.num_timesteps < learning_starts else self.exploration_rate
        explored = self.rng.random(n_envs) < rate
        values[explored] = self.rng.random((int(explored.sum()), values.shape[1]))
        actions = np.where(masks, values, IMPOSSIBLE).argmax(axis=1)
        return actions, actions

    def train(self, gradient_steps: int, batch_size: int = 100) -> None:
        """Fit the values of drawn steps; the target is that of the best available action."""
        self.policy.set_training_mode(True)
        self._update_learning_rate(self.policy.optimizer)
        for _ in range(gradient_steps):
            (seen, actions, after, over, rewards), masks = self.replay_buffer.sample_masked(
                batch_size, self.n_steps, self.rng
            )
            with torch.no_grad():
                best = self.q_net_target(after).masked_fill(~masks, IMPOSSIBLE).amax(dim=1)
                target = rewards + (1 - over) * self.gamma * best
            value = self.q_net(seen).gather(1, actions.long()).squeeze(1)
            self.policy.optimizer.zero_grad()
            smooth_l1_loss(value, target).backward()
            torch.nn.utils.clip_grad_norm_(self.policy.parameters(), self.max_grad_norm)
            self.policy.optimizer.step()
        self._n_updates += gradient_steps
