"""What all environments share to show themselves: render modes, the drawn sheets, a window."""

from __future__ import annotations

from curling_env.errors import InputError
from curling_env.ice import Ice
from curling_env.render import SheetRenderer
from curling_env.render.window import PictureWindow
from curling_env.sheet import Direction

RENDER_MODES = ("rgb_array", "rgb_array_list", "human")
FPS = 30
"""Pictures a second of films and windows."""
FILM_SPEED = 4.0
"""How many times faster than it happened a film shows a throw, unless asked otherwise."""


def check_render_mode(render_mode: str | None) -> None:
    """Refuse a render mode that the environments do not have.

    Raises
    ------
    InputError : an unknown render mode
    """
    if render_mode not in (None, *RENDER_MODES):
        raise InputError(
            f"render_mode must be {', '.join(RENDER_MODES)} or None, got {render_mode!r}"
        )


def signed(value: float, unit: str) -> str:
    """A number of the panel with its sign and unit: ``−2.86°``."""
    return f"{value:+.2f}{unit}".replace("-", "−")


class EnvRenderer:
    """Draws the sheet of an environment, and shows it in a window if asked to.

    Parameters
    ----------
    ice : the ice under the lines
    title : title of the window
    """

    def __init__(self, ice: Ice, title: str) -> None:
        self._ice, self._title = ice, title
        self._sheets: dict[Direction, SheetRenderer] = {}
        self._window: PictureWindow | None = None

    @property
    def ice(self) -> Ice:
        """The ice under the lines; another may be set."""
        return self._ice

    @ice.setter
    def ice(self, ice: Ice) -> None:
        if ice is not self._ice:
            self._ice, self._sheets = ice, {}

    def sheet(self, direction: Direction) -> SheetRenderer:
        """What draws the sheet as played to an end; the empty sheet is painted once for each."""
        if direction not in self._sheets:
            self._sheets[direction] = SheetRenderer(self._ice, direction)
        return self._sheets[direction]

    def window(self) -> PictureWindow:
        """The window, opened at the first call."""
        if self._window is None:
            self._window = PictureWindow(SheetRenderer.size, self._title, FPS)
        return self._window

    def close(self) -> None:
        """Close the window, if there is one."""
        if self._window is not None:
            self._window.close()
            self._window = None
