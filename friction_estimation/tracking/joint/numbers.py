"""The numbers of the joint tracker: physics, priors, and how well pictures show a stone."""

from __future__ import annotations

# --- physics --------------------------------------------------------------------------------------

DECELERATION, DECELERATION_SIGMA = 0.09, 0.03
"""Mean and standard deviation of a sliding stone's deceleration [m/s²]."""
CURL_SIGMA = 0.015
"""Standard deviation of its acceleration sideways [m/s²]."""
DECELERATION_MEMORY = 5.0
"""Half the time in which its deceleration changes by about its standard deviation [s]."""
CARRIED_ACCELERATION = 1.5
"""Standard deviation of the acceleration of a stone that someone holds [m/s²]."""
JUMP_SIGMA = 1.0
"""Standard deviation of each component of the change of velocity in a collision [m/s]."""
FASTEST = 5.0
"""Highest speed of a stone [m/s]."""

LEAST_PACE = 0.05
"""A slower stone counts as resting in the association [m/s]."""

# --- priors of the association --------------------------------------------------------------------

BIRTH = -6.0
"""Log probability that a stone enters the film at a given detection."""
LIES = -3.0
"""Log probability that a detection in the first frames is a stone that lies there."""
RELEASED, STOPS, HIT = -2.0, -2.0, -7.0
"""Log probabilities that a stone is released, stops or is hit between two detections."""
STILL_THERE = 0.1
"""Log odds that a stone gains by each frame in which it still rests."""
MISSED, HIDDEN = -1.2, -5.0
"""Log probability that a stone in view is not detected in a frame, and least one for a gap."""
LONGEST_GAP, LONGEST_GAP_FRAMES = 4.0, 10
"""Longest gap between two detections of one path [s], and in sampled frames."""
SURE = 8.0
"""Log odds above which a path is a stone's."""
LEAST_WAY = 0.5
"""Shortest way of a stone that moves [m]."""

# --- measurements ---------------------------------------------------------------------------------

DETECTION_PX, DETECTION_M = 0.7, 0.03
"""Standard errors of a detection: pixels in the picture, and on the ice [m]."""
STUDENT_FREEDOM = 4.0
"""Degrees of freedom of the measurements' Student distribution."""
GATE = 4.0
"""Largest innovation of a fit [standard deviations]."""
LEAST_GATE, LEAST_GATE_PX = 0.03, 1.0
"""Smallest gate of a fit [m], and in the picture [px]."""
STILL_SCORE = 0.54
"""Least log odds of a stone on ice that does not change."""
LEAST_HEADINGS = 4
"""Fewest pictures whose headings make a curve."""
LOST = 0.5
"""A stone whose place is known no better is not looked for [m]."""
HEADING_DRIFT = 0.1
"""Standard error of the heading curve through all pictures [rad]."""

# --- contacts -------------------------------------------------------------------------------------

CONTACT_WITHIN = 1.5
"""Longest time over which a stone's way to a contact is extrapolated [s]."""
CONTACT_FITS = 8
"""Measurements by which it is extrapolated."""
GRAZES = 0.03
"""Error of a path that still counts as a contact [m]."""
DENSE_STEP, DENSE_BEFORE, DENSE_AFTER = 0.12, 1.0, 4.0
"""Time between frames around a contact, and how long before and after it [s]."""
SAME_PLACE = 0.2
"""Places nearer to each other than this are those of the same stone [m]."""
REACH = 0.4
"""A coarse path that passes by a stone this near may have touched it [m]."""
LEAST_RESTING_VISIBLE, MOST_UNEXPLAINED = 0.6, 0.85
"""Least share of a resting stone that is seen, and most that its look leaves unexplained."""
END_FRAMES = 3
"""A stone that is seen where it rests in one of the last frames stays."""
LINK_FITS = 5
"""Detections by which a path is led to a contact."""
LINK_GATE = 20.0
"""A detection that misses a stone by more is not its own [squared standard errors]."""
COLLISION_TRANSFER, COLLISION_DOUBT = 0.93, 0.3
"""Fraction of the approach speed transferred in a collision, and standard error of either velocity
after it as a fraction of the speed."""
REST_DOUBT = 0.05
"""Error of the place of a stone that seems to have stopped, per time [m/s]."""
CONTACT_GATE = 0.1
"""Addition to the gate of a fit around a contact [m]."""

# --- recordings of many throws --------------------------------------------------------------------

WINDOW = 45.0
"""Length of film over which the ice stays the same [s]."""
BEFORE_THROW, AFTER_THROW = 1.0, 4.0
"""Film that is tracked before a stone comes into view, and after it was last seen to move [s]."""
HELD = 5.0
"""Longest time for which a thrower holds a stone before the release that is tracked [s]."""
LONGEST_SLIDE = 30.0
"""Longest time that a stone slides [s]."""
ASKED_EVERY = 3
"""The network is asked in one of this number of looks."""
TURNS_BACK = 0.3
"""What goes back this far is pushed back [m]."""
FROM_REST = 0.7
"""What is slower at first than this share of its mean speed is pushed."""
APART = 0.5
"""Least time between two throws [s]."""
RETURNS_FROM = 0.8
"""A stone that starts this near to where the one before it rests may be slid back [m]."""
LEAST_SLIDES = 4
"""Fewest detections of a throw while it slides."""
LEAST_THROW = 3.0
"""Shortest way of a throw in a recording [m]."""
JUDGED_ROWS, MOVING_SHARE, RESTED = 60, 0.95, 2.0
"""Rows of a track by which it is judged, share of its way for which it counts as moving, and time
for which a stone that has come to rest is seen at rest [s]."""
WALKING_SIGMA = 0.02
"""Standard deviation of the mean acceleration of people who walk [m/s²]."""
UNUSUAL, HIT_RANGE, HALT_RANGE = 0.2, 1.0, 0.4
"""Share of stones that hit others or are hit, and of people who change their pace; ranges of the
mean deceleration then [m/s²]."""
WALKING_PACE, WALKING_PACE_SIGMA = 1.3, 0.35
"""Mean and standard deviation of the pace of people who walk [m/s]."""
PUSHED = 0.3
"""Gain of speed that no stone has that slides alone [m/s]."""
STANDING = 0.12
"""A stone that is slower over three frames rests [m/s]."""
