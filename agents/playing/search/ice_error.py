"""How far throws may go otherwise than `search` simulates them, because ice and stones differ.

On ice that is known exactly and does not change, as Digital Curling's, they go as simulated. Ice
that was estimated has the standard errors of its map and of its curl; in a game the ice changes,
and stones of a set differ.
"""

from __future__ import annotations

import numpy as np

from agents.playing.search.tuning import CHANGING_ICE_ERROR, LEAST_ERROR, MOST_MAP_ERROR
from curling_env.game import PlayerView
from curling_env.ice import Ice
from curling_env.sheet import HOG_LINE_Y, TEE_Y
from curling_env.typing import Floats

LANE = 1.5
"""Throws keep within so far of the centre line [m]."""
STRETCH = 6.0
"""Errors of a map go together over so much of a throw's way [m]."""
CURL = 1.2
"""How far a draw curls [m]."""


def ice_error(view: PlayerView, draw_speed: float) -> Floats:
    """Standard errors that ice and stones add to a player's own: speed, angle and spin, (3,).

    Parameters
    ----------
    view : the game as the player sees it
    draw_speed : speed of the draw to the button [m/s]

    Returns
    -------
    (3,) [m/s, rad, rad/s]; never quite 0, because simulations near a throw must count for it
    """
    error = np.array(LEAST_ERROR)
    if view.ice_changes:
        error = np.hypot(error, CHANGING_ICE_ERROR)
    if view.ice_is_estimated:
        weight = draw_speed / 2 * friction_error(view.ice)  # v² is in proportion to friction
        line = CURL * curl_error(view.ice) / -view.delivery.start_y
        error = np.hypot(error, np.minimum([weight, line, 0.0], MOST_MAP_ERROR))
    return error


def friction_error(ice: Ice) -> float:
    """Relative standard error of the mean friction on the way to the house, by the map's own.

    The errors of its cells are taken to go together over a few metres, as those of a smooth map do.
    """
    friction, sheet = ice.friction, ice.sheet
    near = (np.abs(sheet.y_centres) <= TEE_Y)[:, None] & (np.abs(sheet.x_centres) <= LANE)
    if (near & friction.observed).any():
        near &= friction.observed
    alone = STRETCH / (TEE_Y + HOG_LINE_Y)
    return float((friction.sigma / friction.mu)[near].mean() * alone**0.5)


def curl_error(ice: Ice) -> float:
    """Relative standard error of how far stones curl; 0 where it is not told."""
    for effect in ice.effects:
        strength = effect.parameters.get("strength", 0.0)
        if effect.name == "curl" and strength:
            return abs(effect.sigma.get("strength", 0.0) / strength)
    return 0.0
