"""Constants for measured tracks that were chosen, not derived.

They were chosen on simulated and filmed draws, at 10 to 120 frames a second.
"""

from __future__ import annotations

# --- wild rows ---------------------------------------------------------------------------------

WILD_DEVIATIONS = 6.0
"""Robust standard deviations from its neighbours beyond which a row is an outlier. Gaussian noise
exceeds it twice in 10⁹ rows; a wrong match is centimetres to metres away.
"""
MIN_NOISE = 5e-4
"""Minimum noise of a coordinate [m], so that exact tracks have no outliers."""

# --- free slide --------------------------------------------------------------------------------

MIN_MOVING_SPEED = 0.05
"""Maximum speed of a stone that is held or at rest, averaged over half a second [m/s]."""
MIN_TRAVEL = 1.0
"""Minimum length of a free slide [m]; a shorter one is no evidence on friction."""
MIN_SAMPLES = 20
"""Minimum number of samples of a free slide."""
BEFORE_PUSH_ENDS, AFTER_PUSH_ENDS = 1.5, 4.0
"""Time before and after the end of a push from which it is estimated [s]."""
PUSHED_DECELERATION = 0.5
"""Share of the deceleration of the free slide below which a stone is still pushed. Ice varies by
some per cent; a hand removes the deceleration altogether.
"""
CLEAR_DEVIATIONS = 6.0
"""Minimum significance of the end of a push, or a contact [standard errors]."""
DECELERATION_RANGE = (0.5, 3.0)
"""Range of the deceleration of a slide between two contacts, over that of the longest slide of the
same stone, within which ice alone slows it.
"""

# --- what a coach reads ------------------------------------------------------------------------

CROSSING_WINDOW = 0.3
"""Half-width of the window around a line for its crossing [s]."""
MAX_CROSSING_GAP = 2.0
"""Longest time without rows in which a line may have been crossed [s]; a parabola bridges it."""
MAX_EXTRAPOLATION = 0.25
"""Maximum start of a track past a line for its crossing to be estimated [m]."""
MAX_LATE_RELEASE = 0.5
"""Maximum apparent delay of the free slide after the hog line for the line to be read [s]: the end
of a push is found to some tenths of a second.
"""
LINE_WINDOW = 3.0
"""Time after the hog line within which the line of delivery is read [s]: longer, and the change of
the curl bends it; shorter, and the noise of single rows dominates.
"""
SPIN_WINDOW = 3.0
"""Time after the hog line within which the spin is read [s]."""
STILL_SECONDS, STILL_WITHIN = 0.7, 0.05
"""Minimum time [s] and maximum movement [m] of a stone at rest."""
MIN_TURN = 0.3
"""Minimum turn of a stone from which its handle is named [rad]."""

# --- spin ----------------------------------------------------------------------------------------

MIN_HEADINGS = 20
"""Minimum number of rows with a heading for an estimate of the spin."""
USUAL_SPIN = 0.9
"""Spin of a stone whose heading was not measured [rad/s]: three to four turns in 25 s."""

# --- contacts between stones -------------------------------------------------------------------

TOUCHING_SLACK = 0.03
"""Maximum apparent gap between two touching stones [m]."""
CONTACT_TIME_MARGIN = 0.2
"""Half-width of the window around a contact in which rows are not used [s]: that of some frames,
and of the corner that a smoother rounds off.
"""
JUMP_WINDOWS = (0.25, 0.5, 1.0, 2.0)
"""Half-widths of the windows for a jump of the velocity [s]: a hard hit is found in the shortest, a
glancing one or that of a slow camera in the longest.
"""
JUMP_ROWS = 6
"""Minimum number of rows in the shortest of these on either side."""
MIN_JUMP = 0.03
"""Minimum jump of the velocity that is searched [m/s]."""
MAX_JUMP_BY_ICE = 0.5
"""Maximum jump of the velocity due to ice, over the usual deceleration and the window. Friction
that changes to zero or doubles within the window causes 0.2.
"""
HARD_HIT = 4.0
"""Minimum size of a hard hit, over the smallest jump that counts in its window."""
MIN_CONTACT_SPEED = 0.15
"""Minimum speed before a contact that matters [m/s]."""
MIN_THROWN_DISTANCE = 5.0
"""Minimum path along the sheet of a stone that was thrown in that direction [m]."""

# --- cameras joined into one track -------------------------------------------------------------

JOIN_KNOT_STEP = 0.25
"""Distance between the knots of the joint path [s]."""
JOIN_ROWS_PER_SECOND = 8.0
"""Number of rows of each camera that are used [1/s]: tracks are smooth, and more rows add
nothing.
"""
SLIDING_JERKS = (0.008, 0.025, 0.08)
"""Candidates for the square root of the spectral density of the jerk of a sliding stone
[m/s³/√Hz]. Ice that differs by 5 % every few metres changes the deceleration of a draw by
0.005 m/s² within a second or two, and friction that depends on speed adds to it."""
PUSHED_JERK = 1.0
"""The same while the stone is pushed or stopped."""
MIN_ROW_SIGMA = 0.001
"""Minimum standard error of a row [m]."""
UNKNOWN_ROW_SIGMA = 0.005
"""Standard error of the rows of a track that states none [m]."""
MIN_HANDOVER_SPEED = 0.1
"""Mean speed below which a stone cannot synchronise two cameras [m/s]."""
MAX_SPEED_GAIN = 0.15
"""Maximum apparent gain of speed of a sliding stone from one camera to the next [m/s]."""
END_WINDOW = 1.0
"""Stretch of a track from which the speed at its end is taken [s]."""
MAX_CAMERA_DEVIATIONS = 6.0
"""Maximum difference between cameras [standard errors]."""
MAX_CAMERA_DISTANCE = 0.1
"""Difference that is allowed in any case [m]; another throw would be farther away."""
SAME_STONE_DISTANCE = 0.2
"""Maximum distance between tracks of one stone from two cameras [m]."""
SAME_THROW_SECONDS = 8.0
"""Maximum difference between the starts of one throw in two cameras, once their clocks agree on
average [s]: travel times from one view to the next differ by this much.
"""

# --- light gates ---------------------------------------------------------------------------------

GATE_WIDTH = 0.27
"""Length of a stone at the height of a beam [m]: 0.29 at the striking band, less above and below
(rule book: circumference at most 0.914 m).
"""
GATE_PLACE_SIGMA = 0.01
"""Standard error of the place at which an edge of a stone breaks a beam [m], the same for all
throws: the height of the beam and the distance of the gate from its line.
"""
GATE_TIME_SIGMA = 0.003
"""Standard error of a time without a stated one [s]."""
NEAR_LINE = 0.3
"""Maximum distance from a line for a time to be that of its gate [m]."""
MAX_GATE_SPEED = 5.0
"""Maximum speed of a stone at a gate [m/s]."""
HOG_TO_HOG_SECONDS = (5.0, 30.0)
"""Time of a throw from hog line to hog line [s]."""
SPLIT_SECONDS = (1.5, 4.5)
"""Time of a throw from the near tee line to the near hog line [s]."""
LENGTH_TOLERANCE = 0.3
"""Maximum relative deviation of a stone's length from the usual one where the beams cross it."""
SPEED_TOLERANCE = 0.15
"""Maximum relative deviation of a sliding stone's speeds from the times between gates."""
