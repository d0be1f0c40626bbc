"""Imperfect judgement of a team: its reading of the ice, and its sweeping."""

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
"""Keys that separate the random numbers of a judgement from others of the same seed."""


@dataclass(frozen=True, kw_only=True)
class TeamJudgement:
    """Errors of teams in reading the ice and judging a stone; zeros mean no error.

    Each team reads the ice again in every end, from its observations up to then.

    Parameters
    ----------
    weight : relative standard deviation of a team's reading of μ
    curl : relative standard deviation of a team's reading of the curl's strength
    sweep : standard deviation of the sweepers' prediction of an unswept stone's place of rest [m]

    Raises
    ------
    InputError : a standard deviation out of range
    """

    weight: float = 0.0
    curl: float = 0.0
    sweep: float = 0.0

    def __post_init__(self) -> None:
        for name, limit in (("weight", 0.2), ("curl", 0.5), ("sweep", 5.0)):
            if not 0 <= getattr(self, name) <= limit:
                raise InputError(f"{name} must be between 0 and {limit}, got {getattr(self, name)}")

    @property
    def misreads(self) -> bool:
        """Return whether teams read the ice with errors."""
        return bool(self.weight or self.curl)

    def ice_as_read(self, ice: Ice, seed: int, team: Team, end: int) -> Ice:
        """Return the ice as a team reads it in an end.

        Parameters
        ----------
        ice : ice as read without errors
        seed : seed of the game
        team, end : the team, and number of the end
        """
        if not self.misreads:
            return ice
        slow, bend = np.random.default_rng((seed, end, int(team), _ICE)).standard_normal(2).tolist()
        friction = replace(ice.friction, mu=ice.friction.mu * float(np.exp(self.weight * slow)))
        factor = float(np.exp(self.curl * bend))
        effects = tuple(_curling(effect, factor) for effect in ice.effects)
        return replace(ice, friction=friction, effects=effects)

    def sweepers_error(self, seed: int, throw: int) -> float:
        """Return the sweepers' error of an unswept stone's distance, positive if too far [m]."""
        if not self.sweep:
            return 0.0
        return self.sweep * float(np.random.default_rng((seed, throw, _SWEEP)).standard_normal())


PERFECT_JUDGEMENT = TeamJudgement()
"""Judgement of teams that know the ice as well as their file of it, with perfect sweepers."""


def _curling(effect: ActiveEffect, factor: float) -> ActiveEffect:
    if effect.name != "curl":
        return effect
    parameters = dict(effect.parameters)
    parameters["strength"] = factor * parameters["strength"]
    return replace(effect, parameters=parameters)


# Chosen, not measured.
SWEEP_START = 4.0
"""Time after release from which sweepers can see that a stone is light, and sweep [s]."""
MIN_SHORTFALL = 0.15
"""Minimum shortfall for which they sweep [m]."""
BISECTIONS = 6
"""Number of bisections of the sweep's end, to a fraction of a second."""


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
    """Return the interval of sweeping with which a stone reaches its intended distance.

    Both throws are simulated on the ice as the sweepers know it, without other stones.

    Parameters
    ----------
    ice : ice as the sweepers know it
    meant : called throw
    thrown : executed throw
    direction : the end played to
    delivery : start of the throws
    read : ice for which the throw was called, if it is another one
    misjudged : their error of the unswept stone's distance, positive if too far [m]

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
    if wanted - unswept < MIN_SHORTFALL or longest <= SWEEP_START:
        return (0.0, 0.0)
    low, high = SWEEP_START, longest
    for _ in range(BISECTIONS):
        middle = (low + high) / 2
        too_short = distance_and_time(ice, thrown, middle)[0] < wanted
        low, high = (middle, high) if too_short else (low, middle)
    return (SWEEP_START, high)


def _sweepable(ice: Ice) -> Ice:
    return ice if ice.effect("sweeping") else ice.with_effect(ActiveEffect(name="sweeping"))
