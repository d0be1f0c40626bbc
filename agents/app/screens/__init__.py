"""The screens, in the order of the navigation; a new one is a module with a `SCREEN`."""

from agents.app.pages import Screen
from agents.app.screens import (
    athletes,
    hand_or_ice,
    ice,
    practice,
    rink,
    stones,
    throw,
    throws,
)

SCREENS: tuple[Screen, ...] = (
    practice.SCREEN,
    rink.SCREEN,
    throws.SCREEN,
    ice.SCREEN,
    throw.SCREEN,
    hand_or_ice.SCREEN,
    athletes.SCREEN,
    stones.SCREEN,
)
