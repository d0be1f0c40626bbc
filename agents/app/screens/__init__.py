"""The screens, in the order of the navigation; a new one is a module with a `SCREEN`."""

from agents.app.screens import ice, practice, throw, throws
from agents.app.screens.screen import Screen

SCREENS: tuple[Screen, ...] = (
    practice.SCREEN,
    throws.SCREEN,
    ice.SCREEN,
    throw.SCREEN,
)
