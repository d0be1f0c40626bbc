"""Display of environments: render modes, pictures, films since the last call, a window."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Iterator, Sequence
from typing import Any, Generic, TypeVar

import gymnasium

from curling_env.errors import InputError
from curling_env.ice import Ice
from curling_env.render import SheetRenderer
from curling_env.render.window import PictureWindow
from curling_env.sheet import Direction
from curling_env.typing import Image

RENDER_MODES = ("rgb_array", "rgb_array_list", "human")
FPS = 30
"""Frames per second of films and windows."""
FILM_SPEED = 4.0
"""Default playback speed of a film."""

Clip = TypeVar("Clip")
"""Throw with the positions before and after it, or a position alone."""


def signed(value: float, unit: str) -> str:
    """Format a number of the panel with its sign and unit: ``−2.86°``."""
    return f"{value:+.2f}{unit}".replace("-", "−")


class ClipRenderer(ABC, Generic[Clip]):
    """Renderer of the clips of an environment."""

    title: str
    """Title of the window."""
    window_speed: float
    """Playback speed of a window."""

    def __init__(self) -> None:
        self._ice: Ice | None = None
        self._sheets: dict[Direction, SheetRenderer] = {}

    @abstractmethod
    def picture(self, clip: Clip) -> Image:
        """Return the sheet after a throw with its paths, (720, 1280, 3) RGB."""

    @abstractmethod
    def frames(self, clip: Clip, speed: float) -> Iterator[Image]:
        """Yield the frames of a throw at `speed` times the true speed."""

    def sheet(self, ice: Ice, direction: Direction) -> SheetRenderer:
        """Return the renderer of an ice as played to an end; it paints the sheet only once."""
        if ice is not self._ice:
            self._ice, self._sheets = ice, {}
        if direction not in self._sheets:
            self._sheets[direction] = SheetRenderer(ice, direction)
        return self._sheets[direction]


class Screen(Generic[Clip]):
    """Display of an environment according to its render mode.

    Parameters
    ----------
    render_mode : one of `RENDER_MODES`, or None
    renderer : draws the clips
    call : how an environment with a render mode is made, for the warning of one without

    Raises
    ------
    InputError : an unknown render mode
    """

    def __init__(self, render_mode: str | None, renderer: ClipRenderer[Clip], call: str) -> None:
        if render_mode not in (None, *RENDER_MODES):
            raise InputError(
                f"render_mode must be {', '.join(RENDER_MODES)} or None, got {render_mode!r}"
            )
        self._mode, self._renderer, self._call = render_mode, renderer, call
        self._film: list[Clip] = []
        self._window: PictureWindow | None = None

    def begin(self, clips: Iterable[Clip]) -> None:
        """Show the beginning of an episode; pending frames are dropped."""
        self._film = []
        self.add(clips)

    def add(self, clips: Iterable[Clip]) -> None:
        """Show clips in the window, or keep them for a film."""
        if self._mode == "rgb_array_list":
            self._film += clips
        if self._mode != "human":
            return
        if self._window is None:
            self._window = PictureWindow(SheetRenderer.size, self._renderer.title, FPS)
        for clip in clips:
            for frame in self._renderer.frames(clip, self._renderer.window_speed):
                if not self._window.is_open:
                    return
                self._window.show(frame)

    def render(self, now: Clip) -> Any:
        """Return the picture or the film of the render mode; None without one.

        Parameters
        ----------
        now : the last throw, or the position where there was none
        """
        if self._mode is None:
            gymnasium.logger.warn(f"render() needs a render_mode: {self._call}")
        if self._mode == "rgb_array_list":
            film, self._film = self._film, []
            return list(self.frames(film, FILM_SPEED))
        return self._renderer.picture(now) if self._mode == "rgb_array" else None

    def frames(self, clips: Sequence[Clip], speed: float) -> Iterator[Image]:
        """Yield the frames of clips as one film."""
        for clip in clips:
            yield from self._renderer.frames(clip, speed)

    def close(self) -> None:
        """Close the window, if any."""
        if self._window is not None:
            self._window.close()
            self._window = None
