"""Positions of observations from a player's view.

An observation has only what an agent knows of the ice. If nothing else is known, it is replaced by
the `standard` ice with the observed mean friction, played on by the usual rules, from the hog line,
by `elite` players.
"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike

from agents.playing.learned.features import (
    checked,
    delivered_in,
    friction_in,
    hammer_in,
    positions_of,
)
from curling_env.game import GameSimulator, PlayerView
from curling_env.game.rules.teams import STONES_PER_TEAM, RestingStone, Team
from curling_env.ice import load_ice

ICE, SKILL = "standard", "elite"
"""Defaults for what an observation does not contain."""
AGENT = Team.HOME
SAME_FRICTION = 1e-4
"""Relative difference below which mean frictions count as one."""


def views_of(
    observations: ArrayLike, simulator: GameSimulator | None = None, *, seed: int = 0
) -> list[PlayerView]:
    """Return the thrower's views of positions.

    Parameters
    ----------
    observations : (n, k) flat observations of `CurlingEnd-v0`
    simulator : ice, rules and skills of their game; by default the usual ones
    seed : seed of the player's random numbers, which differ between positions

    Raises
    ------
    InputError : observations of another kind
    """
    seen = checked(observations)
    facts = zip(
        positions_of(seen), delivered_in(seen), hammer_in(seen), friction_in(seen), strict=True
    )
    views: list[PlayerView] = []
    for k, (places, delivered, hammer, friction) in enumerate(facts):
        game = simulator or _simulator_on(round(float(np.log(friction)) / SAME_FRICTION))
        state = game.new_game(seed + k, last_stone=AGENT if hammer else AGENT.other)
        state = game.begin_end(state)
        stones = tuple(
            RestingStone(
                AGENT if slot < STONES_PER_TEAM else AGENT.other,
                slot % STONES_PER_TEAM,
                *places[slot].tolist(),
            )
            for slot in np.flatnonzero(np.isfinite(places[:, 0])).tolist()
        )
        end = state.game.end
        assert end is not None
        end = replace(end, stones=stones, delivered=int(delivered))
        views.append(game.view(replace(state, game=replace(state.game, end=end)), AGENT))
    return views


@lru_cache(maxsize=16)
def _simulator_on(friction: int) -> GameSimulator:
    """Return the usual game on ice with a mean friction: its logarithm over `SAME_FRICTION`."""
    ice = load_ice(ICE)
    mu = ice.friction.mu
    ratio = float(np.exp(SAME_FRICTION * friction) / mu.mean())
    if abs(ratio - 1) > SAME_FRICTION:
        ice = replace(ice, friction=replace(ice.friction, mu=mu * ratio))
    return GameSimulator(ice, skills=SKILL)
