"""Films of episodes: every slide from release to rest, as H.264 for browsers and phones.

Gymnasium's own `RecordVideo` keeps one frame per step, which here is a whole throw; its
`save_video` keeps all frames of an episode in memory, 9 GB for an end.
"""

# av comes without complete types.
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false
# pyright: reportUnknownArgumentType=false

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import av
import gymnasium
import numpy as np
from gymnasium.utils import RecordConstructorArgs

from curling_env.envs.options import number
from curling_env.envs.rendering import FILM_SPEED, FPS
from curling_env.errors import InputError
from curling_env.infrastructure.files.writing import atomic_path, fitted, make_directory
from curling_env.typing import Image

HELD = FPS
"""Number of frames of the initial position of a film."""


class RecordVideo(gymnasium.Wrapper[Any, Any, Any, Any], RecordConstructorArgs):
    """Wrapper that films whole episodes into ``FOLDER/PREFIX-episode-N.mp4``, throw by throw.

    A film appears under its name when its episode is over, begins again or is closed.

    Parameters
    ----------
    env : `CurlingSheet-v0` or `CurlingEnd-v0`, made with ``render_mode="rgb_array"``
    video_folder : folder for the films; it is made if it is missing
    episode_trigger : which episodes are filmed, by their number from 0; by default 0, 1, 8, 27, …,
        and then every thousandth, as Gymnasium has it
    name_prefix : how the names of the films begin
    speed : how many times faster than it happened a throw is shown

    Raises
    ------
    InputError : an environment that cannot be filmed
    """

    def __init__(
        self,
        env: gymnasium.Env[Any, Any],
        video_folder: str | Path,
        *,
        episode_trigger: Callable[[int], bool] | None = None,
        name_prefix: str = "curling",
        speed: float = FILM_SPEED,
    ) -> None:
        RecordConstructorArgs.__init__(
            self,
            video_folder=str(video_folder),
            episode_trigger=episode_trigger,
            name_prefix=name_prefix,
            speed=speed,
        )
        super().__init__(env)
        if not hasattr(env.unwrapped, "frames") or env.render_mode != "rgb_array":
            raise InputError(
                "a film needs an environment of curling_env made with render_mode='rgb_array', got "
                f"{env} with {env.render_mode!r}"
            )
        self._folder = make_directory(video_folder)
        self._trigger = episode_trigger or _is_filmed_by_default
        self._prefix = name_prefix
        self._speed = number("speed", speed, above=0.0, most=1000.0)
        self._episode = -1
        self._film: _Film | None = None

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Begin an episode, and its film if it is to be filmed."""
        self._finish()
        seen = self.env.reset(seed=seed, options=options)
        self._episode += 1
        if self._trigger(self._episode):
            path = self._folder / fitted(self._prefix, f"-episode-{self._episode}.mp4")
            self._film = _Film(path)
            picture: Any = self.env.render()
            self._film.write([picture] * HELD)
        return seen

    def step(self, action: Any) -> tuple[Any, Any, bool, bool, dict[str, Any]]:
        """Make a step, and film it completely."""
        result = self.env.step(action)
        if self._film is not None:
            unwrapped: Any = self.env.unwrapped
            frames: Iterator[Image] = unwrapped.frames(self._speed)
            self._film.write(frames)
            if result[2] or result[3]:
                self._finish()
        return result

    def close(self) -> None:
        """Finish the current film, and close the environment."""
        self._finish()
        super().close()

    def _finish(self) -> None:
        if self._film is not None:
            film, self._film = self._film, None
            film.close()


def _is_filmed_by_default(episode: int) -> bool:
    """Return whether an episode is filmed by default."""
    return round(episode ** (1 / 3)) ** 3 == episode if episode < 1000 else episode % 1000 == 0


class _Film:
    """MP4 file in progress.

    Parameters
    ----------
    path : where it appears when it is closed
    """

    def __init__(self, path: Path) -> None:
        self._stack = ExitStack()
        draft = self._stack.enter_context(atomic_path(path))
        options = {"movflags": "+faststart"}
        self._container = self._stack.enter_context(
            av.open(str(draft), "w", format="mp4", options=options)
        )
        self._stream: Any = None

    def write(self, frames: Iterable[Image]) -> None:
        """Append pictures (height, width, 3) RGB, of even sizes."""
        for frame in frames:
            if self._stream is None:
                stream: Any = self._container.add_stream("libx264", rate=FPS)
                stream.height, stream.width = frame.shape[:2]
                stream.pix_fmt = "yuv420p"
                stream.options = {"crf": "20", "preset": "superfast"}
                self._stream = stream
            stored = av.VideoFrame.from_ndarray(np.ascontiguousarray(frame), "rgb24")
            self._container.mux(self._stream.encode(stored))

    def close(self) -> None:
        """Write the rest; the film then has its final name."""
        if self._stream is not None:
            self._container.mux(self._stream.encode(None))
        self._stack.close()
