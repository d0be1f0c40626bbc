"""Constants of a league, tuned for strong play within minutes on one core."""

from __future__ import annotations

PARALLEL_ENDS = 128
"""Number of ends played in parallel."""
SIMULATED_SHOTS, REPEATED_SHOTS, REPEATS = 32, 6, 3
"""Number of shots simulated once before a delivery, of best shots that are repeated, and of
repeats.
"""
MAX_ENDS_LEFT, LEAD_SPREAD = 8, 1.7
"""Maximum number of ends left in the games played, and standard deviation of the leads."""
NETWORK_WIDTHS = (48, 32, 96, 64)
"""Units of the hidden layers: two for a stone, two for the position."""
BATCH_SIZE_FACTOR = 8
"""Batch size, as a multiple of the number of ends played in parallel."""
HEURISTIC_RADIUS = 0.7
"""Distance from the tee at which the heuristic counts a stone as 1/e [m]."""
POWER_PLAY_SHARE = 0.2
"""Share of mixed doubles' ends that are power plays: each team may have one in a game of eight
ends.
"""
