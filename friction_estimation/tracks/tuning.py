"""Constants for measured tracks that were chosen, not derived.

They were chosen on simulated and filmed draws, at 10 to 120 frames a second.
"""

from __future__ import annotations

# --- wild rows ---------------------------------------------------------------------------------

WILD_DEVIATIONS = 6.0
"""Robust standard deviations from its neighbours beyond which a row is wild. Gaussian noise gets
there twice in 10⁹ rows; a wrong match is centimetres to metres away."""
MIN_NOISE = 5e-4
"""Smallest noise of a coordinate that is believed [m]; keeps exact tracks from looking wild."""

# --- free slide --------------------------------------------------------------------------------

MIN_MOVING_SPEED = 0.05
"""A stone slower than this, averaged over half a second, is held or at rest [m/s]."""
MIN_TRAVEL = 1.0
"""Shortest free slide that is used [m]; less says nothing about friction."""
MIN_SAMPLES = 20
"""Fewest samples of a free slide that is used."""
BEFORE_PUSH_ENDS, AFTER_PUSH_ENDS = 1.5, 4.0
"""Time before and after the end of a push that tells of it [s]."""
PUSHED_DECELERATION = 0.5
"""Part of the deceleration of the free slide below which a stone is still pushed. Ice varies by
some per cent; a hand takes the deceleration away altogether."""
CLEAR_DEVIATIONS = 6.0
"""Standard errors by which the end of a push, or a contact, must stand out."""
SLOWED_ALIKE = (0.5, 3.0)
"""Deceleration of a slide between two contacts, over that of the longest slide of the same stone,
within which ice alone slows it."""

# --- what a coach reads ------------------------------------------------------------------------

CROSSING_WINDOW = 0.3
"""Time on either side of a line within which rows tell when the stone crosses it [s]."""
MAX_CROSSING_GAP = 2.0
"""Longest time without rows in which a line may have been crossed [s]; a parabola bridges it."""
MAX_EXTRAPOLATION = 0.25
"""How far past a line a track may begin for its crossing to be told [m]."""
MAX_LATE_RELEASE = 0.5
"""How much later than the hog line the free slide may seem to begin for the line to be read [s]:
the end of a push is found to some tenths of a second."""
LINE_WINDOW = 3.0
"""Time after the hog line within which the line of delivery is read [s]: longer, and the change of
the curl bends it; shorter, and the noise of single rows does."""
SPIN_WINDOW = 3.0
"""Time after the hog line within which the spin is read [s]."""
STILL_SECONDS, STILL_WITHIN = 0.7, 0.05
"""A stone lies where it stays for so long [s], within so much [m]."""
MIN_TURN = 0.3
"""Least turn of a stone from which its handle is named [rad]."""

# --- spin ----------------------------------------------------------------------------------------

MIN_HEADINGS = 20
"""Rows with a heading that are needed to estimate the spin."""
USUAL_SPIN = 0.9
"""Spin of a stone whose heading was not measured [rad/s]: three to four turns in 25 s."""

# --- contacts between stones -------------------------------------------------------------------

TOUCHING_SLACK = 0.03
"""How much farther apart than a diameter two touching stones may seem to be [m]."""
CONTACT_TIME_MARGIN = 0.2
"""Time on either side of a contact in which rows are not used [s]: that of some frames, and of the
corner that a smoother rounds off."""
JUMP_WINDOWS = (0.25, 0.5, 1.0, 2.0)
"""Times before and after a jump of the velocity in which it is sought [s]: a hard hit is found in
the shortest, a glancing one or that of a slow camera in the longest."""
JUMP_ROWS = 6
"""Fewest rows that the shortest of these holds on either side."""
LEAST_JUMP = 0.03
"""Smallest jump of the velocity that is sought [m/s]."""
ICE_CHANGES_VELOCITY = 0.5
"""Jump of the velocity that ice may feign, over the usual deceleration and the window. Friction
that changes to nought or to the double somewhere within the window feigns 0.2."""
HARD_HIT = 4.0
"""Size of a jump, over the smallest that counts in its window, from which on it is a hard hit."""
LEAST_CONTACT_SPEED = 0.15
"""Speed before a contact from which on it matters [m/s]."""
LONG_WAY = 5.0
"""Way along the sheet from which on a stone was thrown in that direction [m]."""

# --- cameras joined into one track -------------------------------------------------------------

JOIN_KNOT_STEP = 0.25
"""Distance between the knots of the joint path [s]."""
JOIN_ROWS_PER_SECOND = 8.0
"""Rows of each camera that are used [1/s]: tracks are smooth, and more rows tell no more."""
SLIDING_JERKS = (0.008, 0.025, 0.08)
"""Candidates for the square root of the spectral density of the jerk of a sliding stone
[m/s³/√Hz]. Ice that differs by 5 % every few metres changes the deceleration of a draw by
0.005 m/s² within a second or two, and friction that depends on speed adds to it."""
PUSHED_JERK = 1.0
"""The same while the stone is pushed or stopped by something."""
MIN_ROW_SIGMA = 0.001
"""Smallest standard error of a row that is believed [m]."""
UNKNOWN_ROW_SIGMA = 0.005
"""Standard error of the rows of a track that states none [m]."""
MIN_HANDOVER_SPEED = 0.1
"""Mean speed below which a stone cannot tell the time between two cameras [m/s]."""
MAX_SPEED_GAIN = 0.15
"""Speed that a sliding stone may seem to gain from one camera to the next [m/s]."""
END_WINDOW = 1.0
"""Stretch of a track from which the speed at its end is taken [s]."""
MAX_CAMERA_DEVIATIONS = 6.0
"""Standard errors by which cameras may differ."""
MAX_CAMERA_DISTANCE = 0.1
"""Distance by which they may differ in any case [m]; another throw would be farther off."""
SAME_STONE_DISTANCE = 0.2
"""Tracks of two cameras that stay nearer to each other than this are of one stone [m]."""
SAME_THROW_SECONDS = 8.0
"""Two cameras see one throw begin within this time of each other, once their clocks agree on
average [s]: a stone takes that much more or less from one view to the next."""

# --- light gates ---------------------------------------------------------------------------------

GATE_WIDTH = 0.27
"""Length of a stone where a beam crosses it [m]: 0.29 at the striking band, less above and below
(rule book: circumference at most 0.914 m)."""
GATE_PLACE_SIGMA = 0.01
"""Standard error of the place at which an edge of a stone breaks a beam [m], for all throws alike:
the height of the beam and the distance of the gate from its line."""
GATE_TIME_SIGMA = 0.003
"""Standard error of a time where none is given [s]."""
NEAR_LINE = 0.3
"""Distance from a line within which a time is that of the gate there [m]."""
FASTEST_AT_GATE = 5.0
"""No stone passes a gate faster [m/s]."""
HOG_TO_HOG_SECONDS = (5.0, 30.0)
"""Time of a throw from hog line to hog line [s]."""
SPLIT_SECONDS = (1.5, 4.5)
"""Time of a throw from the near tee line to the near hog line [s]."""
OTHER_BEAM = 0.3
"""Part by which a stone may be longer or shorter than usual where the beams cross it."""
SAME_SPEED = 0.15
"""Part by which the speeds of a sliding stone may differ from what the times between gates say."""
