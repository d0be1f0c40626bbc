"""The positions that observations tell, as a player sees them.

An observation tells of the ice what an agent is told. Where nothing else is known of it, the
`standard` ice with the mean friction that the observation tells stands for it, played on by the
usual rules, from the hog line, by `elite` players.
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
"""What stands for what an observation does not tell."""
AGENT = Team.HOME
SAME = 1e-4
"""Means of friction that differ by less of themselves are one."""


def views_of(
    observations: ArrayLike, simulator: GameSimulator | None = None, *, seed: int = 0
) -> list[PlayerView]:
    """What the player who throws sees of positions.

    Parameters
    ----------
    observations : (n, k) flat observations of `CurlingEnd-v0`
    simulator : ice, rules and hands of the game that they are of; by default the usual ones
    seed : seed of the player's random numbers; each position has others

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
        game = simulator or _simulator_on(round(float(np.log(friction)) / SAME))
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
    """The usual game on ice of a mean friction: its logarithm over `SAME`."""
    ice = load_ice(ICE)
    mu = ice.friction.mu
    ratio = float(np.exp(SAME * friction) / mu.mean())
    if abs(ratio - 1) > SAME:
        ice = replace(ice, friction=replace(ice.friction, mu=mu * ratio))
    return GameSimulator(ice, skills=SKILL)
