"""Differences between actual and simulated throws of `search`, because ice and stones differ.

On ice that is known exactly and does not change, like Digital Curling's, they are zero. Estimated
ice has the standard errors of its map and of its curl; in a game the ice changes, and stones of a
set differ.
"""

from __future__ import annotations

import numpy as np

from agents.playing.search.tuning import CHANGING_ICE_ERROR, MAX_MAP_ERROR, MIN_ERROR
from curling_env.game import PlayerView
from curling_env.ice import Ice
from curling_env.sheet import HOG_LINE_Y, TEE_Y
from curling_env.typing import Floats

LANE = 1.5
"""Half-width of the lane of throws [m]."""
STRETCH = 6.0
"""Correlation length of errors of a map along a throw's path [m]."""
CURL = 1.2
"""Curl of a draw [m]."""


def ice_error(view: PlayerView, draw_speed: float) -> Floats:
    """Return standard errors that ice and stones add to a player's own: speed, angle and spin,
    (3,).

    Parameters
    ----------
    view : the game as the player sees it
    draw_speed : speed of the draw to the button [m/s]

    Returns
    -------
    (3,) [m/s, rad, rad/s]; never quite 0, because simulations near a throw must count for it
    """
    error = np.array(MIN_ERROR)
    if view.ice_changes:
        error = np.hypot(error, CHANGING_ICE_ERROR)
    if view.ice_is_estimated:
        weight = draw_speed / 2 * friction_error(view.ice)  # v² is in proportion to friction
        line = CURL * curl_error(view.ice) / -view.delivery.start_y
        error = np.hypot(error, np.minimum([weight, line, 0.0], MAX_MAP_ERROR))
    return error


def friction_error(ice: Ice) -> float:
    """Return the relative standard error of the mean friction on the path to the house, from the
    map's.

    The errors of its cells are assumed to be correlated over a few metres, as in a smooth map.
    """
    friction, sheet = ice.friction, ice.sheet
    near = (np.abs(sheet.y_centres) <= TEE_Y)[:, None] & (np.abs(sheet.x_centres) <= LANE)
    if (near & friction.observed).any():
        near &= friction.observed
    alone = STRETCH / (TEE_Y + HOG_LINE_Y)
    return float((friction.sigma / friction.mu)[near].mean() * alone**0.5)


def curl_error(ice: Ice) -> float:
    """Return the relative standard error of the curl of stones; 0 if unknown."""
    for effect in ice.effects:
        strength = effect.parameters.get("strength", 0.0)
        if effect.name == "curl" and strength:
            return abs(effect.sigma.get("strength", 0.0) / strength)
    return 0.0
