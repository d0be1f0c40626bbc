"""The judgement of a team, which is not quite right: how it reads the ice, and when it sweeps."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from curling_env.errors import InputError
from curling_env.game.rules.teams import Team
from curling_env.ice import ActiveEffect, Ice
from curling_env.physics.slides import slide
from curling_env.sheet import Direction
from curling_env.throw import FROM_HOG_LINE, Delivery, Throw

_ICE, _SWEEP = 2**32 - 2, 2**32 - 3
"""Set the numbers of a judgement apart from others of the same seed."""


@dataclass(frozen=True, kw_only=True)
class TeamJudgement:
    """How far off teams are when they read the ice and judge a stone; zeros are never off.

    Both teams read the ice anew in every end, from what they saw until then, each for itself.

    Parameters
    ----------
    weight : relative standard deviation of μ as a team reads it
    curl : relative standard deviation of the strength of the curl as a team reads it
    sweep : standard deviation of the place at which sweepers expect an unswept stone to stop [m]

    Raises
    ------
    InputError : a standard deviation that no team has
    """

    weight: float = 0.0
    curl: float = 0.0
    sweep: float = 0.0

    def __post_init__(self) -> None:
        for name, limit in (("weight", 0.2), ("curl", 0.5), ("sweep", 5.0)):
            if not 0 <= getattr(self, name) <= limit:
                raise InputError(f"{name} must lie within 0 and {limit}, got {getattr(self, name)}")

    @property
    def misreads(self) -> bool:
        """Whether teams take the ice for another than it is."""
        return bool(self.weight or self.curl)

    def ice_as_read(self, ice: Ice, seed: int, team: Team, end: int) -> Ice:
        """The ice as a team takes it in an end.

        Parameters
        ----------
        ice : the ice as it is known without an error
        seed : seed of the game
        team, end : who reads it, and in which end
        """
        if not self.misreads:
            return ice
        slow, bend = np.random.default_rng((seed, end, int(team), _ICE)).standard_normal(2).tolist()
        friction = replace(ice.friction, mu=ice.friction.mu * float(np.exp(self.weight * slow)))
        factor = float(np.exp(self.curl * bend))
        effects = tuple(_curling(effect, factor) for effect in ice.effects)
        return replace(ice, friction=friction, effects=effects)

    def sweepers_error(self, seed: int, throw: int) -> float:
        """How much farther than it would, sweepers expect an unswept stone to go [m]."""
        if not self.sweep:
            return 0.0
        return self.sweep * float(np.random.default_rng((seed, throw, _SWEEP)).standard_normal())


NEVER_WRONG = TeamJudgement()
"""Teams that know the ice as well as their file of it, and sweepers who see where a stone stops."""


def _curling(effect: ActiveEffect, factor: float) -> ActiveEffect:
    if effect.name != "curl":
        return effect
    parameters = dict(effect.parameters)
    parameters["strength"] = factor * parameters["strength"]
    return replace(effect, parameters=parameters)


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
