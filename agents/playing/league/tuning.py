"""Constants of a league that were tuned, for strong play within minutes of one core."""

from __future__ import annotations

ENDS_SIDE_BY_SIDE = 128
"""Ends that are played at once."""
SIMULATED_SHOTS, REPEATED_SHOTS, REPEATS = 32, 6, 3
"""Shots simulated once before a delivery; how many of the best are repeated, and how often."""
MAX_ENDS_LEFT, LEAD_SPREAD = 8, 1.7
"""Ends are played as if up to so many were left, with leads of this standard deviation."""
NETWORK_WIDTHS = (48, 32, 96, 64)
"""Units of the hidden layers: two for a stone, two for the position."""
ROWS_PER_STEP = 8
"""So many times as many positions as ends are played at once make one step of the optimiser."""
HEURISTIC_RADIUS = 0.7
"""Distance from the tee at which the heuristic counts a stone as 1/e [m]."""
POWER_PLAY_SHARE = 0.2
"""Share of mixed doubles' ends that are power plays: each team may have one in a game of eight."""
