"""Constants of the player `search` that were tuned, in games and positions of its own."""

from __future__ import annotations

from itertools import product

import numpy as np

# --- the search ----------------------------------------------------------------------------------

BUDGET = 3000
"""Simulated throws before each delivery."""
ROUNDS = 4
"""Rounds among which the simulations are divided equally; after each, fewer shots remain."""
KEPT_SHARE = 0.25
"""Share of the shots that a round passes on to the next."""
NEIGHBOURS = ((0.8, 0.0), (-0.8, 0.0), (0.0, 0.8), (0.0, -0.8))
"""Shots that are added beside the best ones, in standard errors of weight and line."""
WIDENED_SHOTS = 8
"""The number of best shots beside which neighbours are added, in each round but the last."""
CONCEDE_BELOW = 0.003
"""Win probability below which the player concedes."""
FIRST_RATE = 20_000.0
"""Simulations a second that are assumed until the player has measured its own."""
CHANGING_ICE_ERROR = np.array([0.006, 0.0005, 0.05])
"""Error that ice and stones add to the player's own in games that change them [m/s, rad, rad/s].

Matched stones differ by about 0.75 % in friction, and the ice changes during a game.
"""
MOST_MAP_ERROR = CHANGING_ICE_ERROR
"""At most so much is counted for errors of a measured map [m/s, rad, rad/s].

They are the same in every throw. Who counts larger ones as if each throw had its own plays worse.
"""
LEAST_ERROR = np.array([0.0006, 0.00005, 0.005])
"""Error that is counted on ice which is known exactly [m/s, rad, rad/s]."""

# --- the opponent's reply ---------------------------------------------------------------------

REPLY_STONES = 1
"""Replies are looked up before deliveries after which at most so many stones are to come."""
REPLIES_ALWAYS = 20_000
"""A search with so many throws or more looks them up before every delivery but the last."""
REPLY_FACTOR = 8
"""One with fewer takes so many times its throws where it looks up replies."""
REPLY_LEAST = 4000
"""Fewer throws than this are better spent without replies."""
REPLY_ROOT = 1000
"""At least so many throws are simulated before the replies are."""
REPLY_SHOTS, REPLY_MARGIN = 8, 0.1
"""How many kinds of shots are looked at with their replies, and how far their win probability may
be from the best."""
REPLY_ROUNDS = 3
"""Rounds of the replies; after each, half of the shots remain."""
REPLIES_ONCE, REPLIES_AGAIN, REPLY_REPEATS = 48, 6, 4
"""Replies that are simulated once, how many of the best again, and how often; an even number."""

# --- candidate shots -----------------------------------------------------------------------------

HIT_WEIGHTS = (1.1, 1.25, 1.5, 1.9)
"""Weights of hits over the draw to the button: control, board, normal and peel weight."""
IN_HOUSE = tuple(
    product((-1.2, -0.8, -0.4, 0.0, 0.4, 0.8, 1.2), (-1.1, -0.6, -0.15, 0.2, 0.7, 1.2))
)
"""Places to draw to, delivery frame [m]."""
IN_FRONT = tuple(product((-1.2, -0.6, 0.0, 0.6, 1.2), (-3.4, -2.6)))
"""Places for a guard, delivery frame [m]."""
BEHIND_GUARD = ((0.0, 1.0), (0.0, 2.2), (0.15, 1.6), (-0.15, 1.6))
"""From a guard to a place behind it [m]."""
TAP_BACK = ((0.0, 0.6), (0.0, 1.3), (0.12, 0.8), (-0.12, 0.8))
"""From a stone to where a draw would end that taps it back [m]."""
COVER = ((0.0, -1.6), (0.0, -2.6))
"""From an own stone to a guard in front of it [m]."""
HIT_OFFSETS = (0.0, 0.07, -0.07, 0.14, -0.14, 0.21, -0.21)
"""How far beside its centre a stone is hit [m]; beyond twice its radius, 0.29 m, it is missed."""
THROUGH_HOUSE = (1.75, -1.75)
"""Where a stone that is thrown away crosses the tee line [m]."""
FREEZE_GAP = 0.01
"""Room left in front of a stone in a freeze [m]."""

# --- the aiming table ----------------------------------------------------------------------------

MAX_ANGLE = 0.11
"""Lines reach this far to each side [rad]: three metres at the tee."""
TABLE_LINES, TABLE_SPEEDS = 15, 12
"""Lines of both tables, and speeds of the table of draws."""
DRAW_WEIGHTS = 0.84, 1.09
"""Slowest and fastest draw of the table over the draw to the button."""
HIT_LEVELS = np.linspace(-6.6, 1.8, 15)
"""Distances past the tee at which the path of a hit is tabulated [m]."""
DRAW_CORRECTIONS = 6
"""Corrections of a draw from the table; each makes the error about ten times smaller."""

# --- win probability -----------------------------------------------------------------------------

SCORE_SHARES = (0, 0, 0, 0.01, 0.05, 0.15, 0.20, 0.27, 0.21, 0.08, 0.02, 0.01, 0)
"""Assumed shares of the hammer team's scores in an end, −6 to 6.

They spread about as far as in games between people. In games of `search` against itself scores
spread less; a player who believes that gives up games which weaker opponents would still lose.
"""
DOUBLES_SHARES = (0, 0, 0.003, 0.021, 0.065, 0.205, 0.002, 0.354, 0.211, 0.099, 0.031, 0.009, 0)
"""The same in mixed doubles, as in 2,577 ends of championships; see docs/championships.md."""
MAX_LEAD = 15
"""Larger leads count as this one."""
