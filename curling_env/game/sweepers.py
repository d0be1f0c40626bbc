"""Scripted sweepers: they sweep a stone that is light, for as long as it takes."""

from __future__ import annotations

from curling_env.ice import ActiveEffect, Ice
from curling_env.physics.one_stone.slide import slide
from curling_env.sheet import Direction
from curling_env.throw import Throw

FIRST_LOOK = 4.0
"""Seconds after release before which sweepers cannot tell that a stone is light [s]: a choice."""
BISECTIONS = 6
"""Halvings of the sweep's length; the last is a fraction of a second."""
LIGHT = 0.15
"""Shortfall from which on it is worth sweeping [m]."""


def sweep_for(ice: Ice, meant: Throw, thrown: Throw, direction: Direction) -> tuple[float, float]:
    """When to sweep a stone, so that it carries as far as it was meant to.

    Both throws are thought through on the ice as the sweepers know it; other stones are not.

    Returns
    -------
    seconds after release at which sweeping begins and ends; equal for a stone that is not light
    """
    if ice.effect("sweeping") is None:
        ice = ice.with_effect(ActiveEffect(name="sweeping"))

    def carries(throw: Throw, until: float) -> tuple[float, float]:
        end = slide(ice, throw.release(direction, sweep=(FIRST_LOOK, max(until, FIRST_LOOK))))
        return direction * end.y, end.time

    aim, _ = carries(meant, 0.0)
    alone, time = carries(thrown, 0.0)
    if aim - alone < LIGHT:
        return (0.0, 0.0)
    longest = 1.2 * time
    if longest <= FIRST_LOOK:
        return (0.0, 0.0)
    low, high = FIRST_LOOK, longest
    for _ in range(BISECTIONS):
        middle = (low + high) / 2
        low, high = (middle, high) if carries(thrown, middle)[0] < aim else (low, middle)
    return (FIRST_LOOK, high)
