"""Constants of the player `search`, tuned in its own games and positions."""

from __future__ import annotations

from itertools import product

import numpy as np

# --- the search ----------------------------------------------------------------------------------

BUDGET = 3000
"""Number of simulated throws before each delivery."""
ROUNDS = 4
"""Number of rounds that share the simulations equally; after each, fewer shots remain."""
KEPT_SHARE = 0.25
"""Share of the shots that a round passes on to the next."""
NEIGHBOURS = ((0.8, 0.0), (-0.8, 0.0), (0.0, 0.8), (0.0, -0.8))
"""Shots added near the best ones, in standard errors of weight and line."""
WIDENED_SHOTS = 8
"""Number of best shots with added neighbours, in each round but the last."""
CONCEDE_BELOW = 0.003
"""Win probability below which the player concedes."""
FIRST_RATE = 20_000.0
"""Assumed number of simulations a second until the player has measured its own."""
CHANGING_ICE_ERROR = np.array([0.006, 0.0005, 0.05])
"""Error that ice and stones add to the player's own in games that change them [m/s, rad, rad/s].

Matched stones differ by about 0.75 % in friction, and the ice changes during a game.
"""
MAX_MAP_ERROR = CHANGING_ICE_ERROR
"""Maximum error counted for a measured map [m/s, rad, rad/s].

These errors are the same in every throw. Counting larger ones as if they were independent makes the
player weaker.
"""
MIN_ERROR = np.array([0.0006, 0.00005, 0.005])
"""Error counted on exactly known ice [m/s, rad, rad/s]."""

# --- the opponent's reply ---------------------------------------------------------------------

REPLY_STONES = 1
"""Maximum number of stones to come after a delivery for which replies are simulated."""
REPLIES_ALWAYS = 20_000
"""Number of throws from which a search simulates replies before every delivery but the last."""
REPLY_FACTOR = 8
"""Factor on the throws of a smaller search where it simulates replies."""
MIN_REPLY_THROWS = 4000
"""Minimum number of throws for a search with replies."""
MIN_THROWS_BEFORE_REPLIES = 1000
"""Minimum number of throws simulated before the replies."""
REPLY_SHOTS, REPLY_MARGIN = 8, 0.1
"""Number of kinds of shots simulated with their replies, and maximum distance of their win
probability from the best.
"""
REPLY_ROUNDS = 3
"""Number of rounds of the replies; after each, half of the shots remain."""
REPLIES_ONCE, REPLIES_AGAIN, REPLY_REPEATS = 48, 6, 4
"""Number of replies simulated once, of best ones simulated again, and of repeats, which is even."""

# --- candidate shots -----------------------------------------------------------------------------

HIT_WEIGHTS = (1.1, 1.25, 1.5, 1.9)
"""Weights of hits relative to the draw to the button: control, board, normal and peel weight."""
IN_HOUSE = tuple(
    product((-1.2, -0.8, -0.4, 0.0, 0.4, 0.8, 1.2), (-1.1, -0.6, -0.15, 0.2, 0.7, 1.2))
)
"""Places to draw to, delivery frame [m]."""
IN_FRONT = tuple(product((-1.2, -0.6, 0.0, 0.6, 1.2), (-3.4, -2.6)))
"""Places for a guard, delivery frame [m]."""
BEHIND_GUARD = ((0.0, 1.0), (0.0, 2.2), (0.15, 1.6), (-0.15, 1.6))
"""Offset from a guard to a place behind it [m]."""
TAP_BACK = ((0.0, 0.6), (0.0, 1.3), (0.12, 0.8), (-0.12, 0.8))
"""Offset from a stone to the end of a draw that taps it back [m]."""
COVER = ((0.0, -1.6), (0.0, -2.6))
"""Offset from an own stone to a guard in front of it [m]."""
HIT_OFFSETS = (0.0, 0.07, -0.07, 0.14, -0.14, 0.21, -0.21)
"""Offsets from the centre at which a stone is hit [m]; beyond twice its radius, 0.29 m, it is
missed.
"""
THROUGH_HOUSE = (1.75, -1.75)
"""Crossing of the tee line by a stone that is thrown away [m]."""
FREEZE_GAP = 0.01
"""Gap to a stone in a freeze [m]."""

# --- the aiming table ----------------------------------------------------------------------------

MAX_ANGLE = 0.11
"""Maximum angle of lines to each side [rad]: three metres at the tee."""
TABLE_LINES, TABLE_SPEEDS = 15, 12
"""Number of lines of both tables, and of speeds of the table of draws."""
DRAW_WEIGHTS = 0.84, 1.09
"""Slowest and fastest draw of the table, relative to the draw to the button."""
HIT_LEVELS = np.linspace(-6.6, 1.8, 15)
"""Distances past the tee at which the path of a hit is tabulated [m]."""
DRAW_CORRECTIONS = 6
"""Number of corrections of a draw from the table; each makes the error about ten times smaller."""

# --- win probability -----------------------------------------------------------------------------

SCORE_SHARES = (0, 0, 0, 0.01, 0.05, 0.15, 0.20, 0.27, 0.21, 0.08, 0.02, 0.01, 0)
"""Assumed shares of the hammer team's scores in an end, −6 to 6.

They spread about as much as in games between people. In games of `search` against itself scores
spread less; a player that assumes that concedes games which weaker opponents would still lose.
"""
DOUBLES_SHARES = (0, 0, 0.003, 0.021, 0.065, 0.205, 0.002, 0.354, 0.211, 0.099, 0.031, 0.009, 0)
"""The same in mixed doubles, as in 2,577 ends of championships; see docs/championships.md."""
POWER_PLAY_SHARES = (0, 0, 0.002, 0.015, 0.051, 0.138, 0.003, 0.332, 0.262, 0.155, 0.033, 0.008, 0)
"""The same in 587 power plays."""
MIN_POWER_PLAY_GAIN = 0.001
"""Gain of a power play now over a later one below which it is kept: less than the error of the
shares.
"""
MAX_LEAD = 15
"""Maximum lead; larger ones count as this one."""
