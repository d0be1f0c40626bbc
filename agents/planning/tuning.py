"""Constants of the planner that were tuned, on draws and hits on the presets' ice."""

from __future__ import annotations

from curling_env.throw import SKILLS

# --- throws to a target --------------------------------------------------------------------------

SPINS = (1.0, -1.0, 0.8, -0.8, 1.3, -1.3, 0.5, -0.5, 1.6, -1.6)
"""Spins to try [rad/s], the usual one first: one to five turns during a draw, both handles."""
SWEEPS = ((0.0, 0.0), (0.0, 60.0), (8.0, 60.0))
"""Sweeping to try where the ice has the effect: never, all the way, late (start and end) [s]."""
GRID_SPEEDS, GRID_LINES = 13, 9
"""Speeds and lines of the grid for each spin and sweeping."""
GRID_HALF_WIDTH = 3.0
"""How far to each side of the target the grid aims [m]; a draw curls 1 to 2 m."""
NEWTON_STARTS = 3
"""Throws of the grid that Newton's method begins with, for each spin and sweeping."""
NEWTON_TOLERANCE = 1e-4
"""Distance from the target at which Newton's method stops [m]."""
REACHED = 5e-3
"""Distance from the target within which a throw counts as reaching it [m]."""

# --- throws for a task ---------------------------------------------------------------------------

GRID_THROWS = 30_000
"""Throws in the grid of the reward map, over all handles."""
PEAKS_PER_HANDLE = 2
"""Peaks of the reward map that are kept for each handle and sweeping."""
REFINED_PEAKS = 6
"""Peaks from which the cross-entropy method begins."""
CLOUD_SIZE, CLOUD_ELITE, CLOUD_ROUNDS = 16, 4, 4
"""Throws in a cloud, how many of the best make the next cloud, and the number of clouds."""
MIN_BLUR = SKILLS["elite"].sigma_speed / 4, SKILLS["elite"].sigma_angle / 4
"""Blur of the reward map for an exact player [m/s, rad]: it prefers the middle of a broad peak."""

# --- Monte-Carlo trials --------------------------------------------------------------------------

CLOUD_TRIALS, RANKING_TRIALS, FINAL_TRIALS = 32, 128, 1024
"""Trials that guide a cloud, that rank the candidates, and that describe the best two."""
SAMPLED_ICES = 64
"""Ices drawn from the standard errors of an ice: a miss that comes from them is known to 7 %."""
BELIEF_MATTERS = 0.01
"""A plan depends on an effect if the stone would end farther than this away without it [m]."""

# --- choosing ------------------------------------------------------------------------------------

USUAL_SPIN = 1.0
"""Spin of the standard draw [rad/s], about three turns; preferred among equally good throws."""
OTHER_WEIGHT = 0.1
"""Share by which weights differ for a throw to be another shot: a hit of another weight."""
EQUAL_MISS_RATIO = 1.03
"""Expected misses within this ratio count as equal: the ranking trials cannot tell them apart."""
EQUAL_VALUE_DIFFERENCE = 0.02
"""Expected rewards, or points, that differ by less than this count as equal."""
