"""Scripted sweepers: they sweep a stone that is light, for as long as it takes."""

from __future__ import annotations

from curling_env.ice import ActiveEffect, Ice
from curling_env.physics.slides import slide
from curling_env.sheet import Direction
from curling_env.throw import FROM_HOG_LINE, Delivery, Throw

# Choices, not measurements.
SWEEP_START = 4.0
"""Time after release from which sweepers can tell that a stone is light, and sweep [s]."""
WORTH_SWEEPING = 0.15
"""Smallest shortfall for which they sweep [m]."""
BISECTIONS = 6
"""Number of times the range of the sweep's end is halved, to a fraction of a second."""


def sweep_for(
    ice: Ice,
    meant: Throw,
    thrown: Throw,
    direction: Direction,
    *,
    delivery: Delivery = FROM_HOG_LINE,
    read: Ice | None = None,
    misjudged: float = 0.0,
) -> tuple[float, float]:
    """When to sweep a stone, so that it goes as far as it was meant to.

    Both throws are simulated on the ice as the sweepers know it, without other stones.

    Parameters
    ----------
    ice : the ice as the sweepers know it
    meant : the throw that was called
    thrown : the throw as it left the hand
    direction : the end played to
    delivery : where throws begin
    read : the ice for which the throw was called, where it is another one
    misjudged : how much farther than it would they expect the stone to go unswept [m]

    Returns
    -------
    times after release at which sweeping begins and ends [s]; equal for a stone that is not light
    """
    planned = _sweepable(ice if read is None else read)
    ice = _sweepable(ice)

    def distance_and_time(on: Ice, throw: Throw, until: float) -> tuple[float, float]:
        sweep = (SWEEP_START, max(until, SWEEP_START))
        end = slide(on, throw.release(direction, sweep=sweep, delivery=delivery))
        return direction * end.y, end.time

    wanted, _ = distance_and_time(planned, meant, 0.0)
    wanted -= misjudged
    unswept, time = distance_and_time(ice, thrown, 0.0)
    longest = 1.2 * time
    if wanted - unswept < WORTH_SWEEPING or longest <= SWEEP_START:
        return (0.0, 0.0)
    low, high = SWEEP_START, longest
    for _ in range(BISECTIONS):
        middle = (low + high) / 2
        too_short = distance_and_time(ice, thrown, middle)[0] < wanted
        low, high = (middle, high) if too_short else (low, middle)
    return (SWEEP_START, high)


def _sweepable(ice: Ice) -> Ice:
    return ice if ice.effect("sweeping") else ice.with_effect(ActiveEffect(name="sweeping"))
