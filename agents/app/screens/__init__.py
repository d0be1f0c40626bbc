"""The screens, in the order of the navigation; a new one is a module with a `SCREEN`."""

from agents.app.screens import athletes, hand_or_ice, ice, practice, rink, stones, throw, throws

SCREENS = tuple(
    screen.SCREEN for screen in (practice, rink, throws, ice, throw, hand_or_ice, athletes, stones)
)
