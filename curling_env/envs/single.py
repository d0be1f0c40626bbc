"""Single environment in Gymnasium's form: a view of a core with one episode."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterator, Sequence
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces

from curling_env.envs.core import Core, Episodes, alone, row_of
from curling_env.envs.options import whole_number
from curling_env.envs.rendering import FPS, RENDER_MODES, ClipRenderer, Screen
from curling_env.errors import InputError
from curling_env.typing import Image

ROW = np.zeros(1, dtype=np.intp)
"""The index of the only episode."""


class SingleEnv(Core[Episodes], gymnasium.Env[Any, Any]):
    """One episode at a time.

    Parameters
    ----------
    observation_space, action_space : the spaces
    render_mode : one of `RENDER_MODES`, or None

    Raises
    ------
    InputError : an unknown render mode
    """

    metadata: dict[str, Any] = {"render_modes": list(RENDER_MODES), "render_fps": FPS}  # noqa: RUF012
    title: str
    """Name of the environment."""

    def __init__(
        self,
        observation_space: spaces.Space[Any],
        action_space: spaces.Space[Any],
        render_mode: str | None,
    ) -> None:
        super().__init__(observation_space, action_space, render_mode)
        self.observation_space, self.action_space = observation_space, action_space
        call = f"gym.make({self.title!r}, render_mode='rgb_array')"
        self._screen: Screen[Any] = Screen(render_mode, self._renderer(), call)
        self._episodes = self.blank(1)
        self._was_reset = False
        # The episode before the last step, and the step's `info`; None after a reset.
        self._last: tuple[Episodes, dict[str, Any] | None] = self._episodes, None

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Begin an episode.

        Parameters
        ----------
        seed : seed of all that is random
        options : see the environment

        Raises
        ------
        InputError : an invalid seed, or an unknown option, or an invalid value
        """
        super().reset(seed=None if seed is None else whole_number("seed", seed, least=0))
        asked = self.asked(options, 1)
        self._episodes = self.begun(self._episodes, ROW, [self.np_random], asked)
        self._was_reset = True
        self._last = self._episodes, None
        if self.render_mode is not None:
            self._screen.begin(self._clips())
        info = alone([(ROW, self.reported(self._episodes, ROW))])
        return self._observe(), self.returned(info)

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        """Make a step.

        Raises
        ------
        InputError : before the first reset, after the end of the episode, or an invalid action
        """
        self._check_begun()
        if self.are_over(self._episodes)[0]:
            raise InputError("the episode is over; call reset()")
        before = self._episodes
        episodes, rewards, parts = self.played(before, ROW, [self.np_random], [action])
        self._episodes = episodes
        info = alone([(ROW, self.reported(episodes, ROW)), *parts])
        self._last = before, info
        if self.render_mode is not None:
            self._screen.add(self._clips())
        over = bool(self.are_over(episodes)[0])
        return self._observe(), float(rewards[0]), over, False, self.returned(info)

    def render(self) -> Any:
        """Return the sheet from above as an RGB picture, with the paths of the last throw.

        With the render mode ``rgb_array_list`` return the frames of a film since the last call, at
        `metadata["render_fps"]` and four times the true speed.
        """
        return self._screen.render(self._clips()[-1])

    def frames(self, speed: float = 1.0) -> Iterator[Image]:
        """Yield the frames of a film of the last step, at `metadata["render_fps"]`.

        Parameters
        ----------
        speed : how many times faster than it happened it is shown

        Raises
        ------
        InputError : paths were not kept, because the environment has no render mode
        """
        yield from self._screen.frames(self._clips(), speed)

    def close(self) -> None:
        """Close the window, if any."""
        self._screen.close()

    # --- the parts ------------------------------------------------------------------------------

    @abstractmethod
    def _renderer(self) -> ClipRenderer[Any]:
        """Return the renderer of the clips of this environment."""

    @abstractmethod
    def _clips(self) -> Sequence[Any]:
        """Return the throws of the last reset or step, or the position without throws."""

    def _check_begun(self) -> None:
        if not self._was_reset:
            raise InputError("call reset() before the first step")

    def _observe(self) -> Any:
        return row_of(self.observed(self._episodes), 0)
