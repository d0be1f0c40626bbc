"""Constants of the planner, tuned on draws and hits on the presets' ice."""

from __future__ import annotations

from curling_env.throw import SKILLS

# --- throws to a target --------------------------------------------------------------------------

SPINS = (1.0, -1.0, 0.8, -0.8, 1.3, -1.3, 0.5, -0.5, 1.6, -1.6)
"""Spins to try [rad/s], the usual one first: one to five turns during a draw, both handles."""
SWEEPS = ((0.0, 0.0), (0.0, 60.0), (8.0, 60.0))
"""Sweeping to try if the ice has the effect: never, all the way, late (start and end) [s]."""
REACHED = 1e-4
"""Distance from the target within which a throw reaches it [m]."""

# --- throws for a task ---------------------------------------------------------------------------

WEIGHTS_TO_TRY = (0.9, 1.08)
"""Range of the weights of the reward map, relative to a straight draw to the target."""
GRID_THROWS = 30_000
"""Number of throws in the grid of the reward map, over all handles."""
PEAKS_PER_HANDLE = 2
"""Number of peaks of the reward map kept for each handle and sweeping."""
REFINED_PEAKS = 6
"""Number of peaks refined by the cross-entropy method."""
CLOUD_SIZE, CLOUD_ELITE, CLOUD_ROUNDS = 16, 4, 4
"""Number of throws in a cloud, of best throws that make the next cloud, and of clouds."""
MIN_BLUR = SKILLS["elite"].sigma_speed / 4, SKILLS["elite"].sigma_angle / 4
"""Blur of the reward map for an exact player [m/s, rad]: it prefers the middle of a broad peak."""

# --- Monte-Carlo trials --------------------------------------------------------------------------

CLOUD_TRIALS, RANKING_TRIALS, FINAL_TRIALS = 32, 128, 1024
"""Number of trials that guide a cloud, rank the candidates, and describe the best two."""
SAMPLED_ICES = 64
"""Number of ices sampled within the standard errors; the miss due to them is then known to 7 %."""
MIN_EFFECT_ON_REST = 0.01
"""Minimum change of the end without an assumed effect for a plan to depend on it [m]."""

# --- choosing ------------------------------------------------------------------------------------

USUAL_SPIN = 1.0
"""Spin of the standard draw [rad/s], about three turns; preferred among equally good throws."""
DISTINCT_WEIGHT = 0.1
"""Relative difference of weight from which a throw is another shot: a hit of another weight."""
EQUAL_MISS_RATIO = 1.03
"""Ratio within which expected misses count as equal: the ranking trials cannot resolve it."""
EQUAL_VALUE_DIFFERENCE = 0.02
"""Difference below which expected rewards, or points, count as equal."""
