"""Window that shows pictures; needs the extra `viewer`."""

# pygame's stubs leave parts untyped.
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false
# pyright: reportUnknownArgumentType=false, reportMissingImports=false

from __future__ import annotations

import os
from typing import Any

from curling_env.typing import Image


class PictureWindow:
    """Window that shows one picture after another at a steady rate.

    Parameters
    ----------
    size : width and height [pixels]
    title : title of the window
    fps : pictures per second

    Raises
    ------
    ModuleNotFoundError : pygame is not installed; the message has the command to install it
    """

    def __init__(self, size: tuple[int, int], title: str, fps: float) -> None:
        os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")
        try:
            import pygame
        except ModuleNotFoundError as error:
            raise ModuleNotFoundError(
                "a window needs pygame: pip install 'curling-sheet[viewer]'", name="pygame"
            ) from error
        self._pygame: Any = pygame
        pygame.display.init()
        pygame.display.set_caption(title)
        self._surface = pygame.display.set_mode(size)
        self._clock = pygame.time.Clock()
        self._fps = fps
        self.is_open = True

    def show(self, image: Image) -> None:
        """Show a picture and wait until the next is due; do nothing once the window is closed."""
        if not self.is_open:
            return
        pygame = self._pygame
        for event in pygame.event.get():
            if event.type == pygame.QUIT:
                self.close()
                return
        pygame.surfarray.blit_array(self._surface, image.swapaxes(0, 1))
        pygame.display.flip()
        self._clock.tick(self._fps)

    def close(self) -> None:
        """Close the window."""
        if self.is_open:
            self.is_open = False
            self._pygame.display.quit()
