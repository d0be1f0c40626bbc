"""Constants of the coaching functions that were chosen, not derived.

They were chosen on simulated clubs (`scripts/simulated_club.py`).
"""

from __future__ import annotations

# --- the release, read from a track --------------------------------------------------------------

RELEASE_WINDOW = 10.0
"""Stretch beyond the hog line from which the release is read [s]. Later events (a hair, a sweeper)
are not attributed to the hand.
"""
OWN_FRICTION = 0.03
"""Standard deviation of a throw's ln friction about the ice's while its release is read: stones
differ by 1 %, frost and swept ice by more.
"""
OWN_CURL = 0.3
"""The same for ln curl."""
WIDE_FRICTION = 0.3
"""The same when the friction of the throw itself is estimated."""
WIDE_CURL = 1.0
"""The same for ln curl."""
MAX_OWN_FRICTION, MAX_OWN_CURL = 0.6, 1.0
"""Bounds of these deviations, in ln: beyond them it is no curling stone."""
BIN = 0.125
"""Averaging time of rows before a fit [s]."""
WIDE_BIN = 0.25
"""Averaging time for the whole slide [s]."""
LASTING = 1.5
"""Duration of an error of a track that its σ states [s]."""
UNSEEN_SPIN = 0.6
"""Standard deviation of a spin that was not seen [rad/s]."""
LATEST_START = 1.2
"""Latest start of a track beyond the hog line for its release to be read [m]."""
MIN_BINS = 12
"""Minimum number of averaged rows from which a release is read: a second and a half."""

# --- causes ------------------------------------------------------------------------------------

DRAWS = 64
"""Number of sampled errors of the measurement and of the ice for the intervals."""
HABIT_THROWS = 3
"""Minimum number of throws for an athlete's usual rotation, or speed for a named weight."""
MIN_THROWS_TO_CORRECT_ICE = 4
"""Minimum number of throws whose unexplained parts correct the ice of all."""
MAX_REACH = 0.6
"""Longest distance before the target of a hit at which the free slide may end [m]: two radii, and a
frame.
"""

# --- athletes ----------------------------------------------------------------------------------

USUAL_SPREAD = (0.04, 0.25, 0.3)
"""Prior spread of speed [m/s], line at the far tee [m] and spin [rad/s]: slightly more than a club
player's, with little weight.
"""
USUAL_BIAS = (0.03, 0.15, 0.2)
"""Prior scale of a bias, in the same units."""
GROUP_WEIGHT = 8.0
"""Weight of the common covariance on an athlete's groups, in throws and four more."""
GIBBS_WARM_UP, GIBBS_DRAWS = 150, 600
"""Draws of an athlete's posterior: the first are discarded."""
TAILS = (2.2, 2.5, 3.0, 3.5, 4.0, 5.0, 6.0, 8.0, 12.0, 20.0)
"""Candidate degrees of freedom of Student's t for an athlete's errors."""
TAIL_EVIDENCE = 9.0
"""Twice the gain in log likelihood over normal errors from which an athlete has tails; about one
athlete in a thousand without tails exceeds it by chance.
"""

# --- stones ------------------------------------------------------------------------------------

ALIKE_FRICTION = 0.01
"""Difference in ln friction below which two stones are a pair: 30 cm on a draw."""
ALIKE_CURL = 0.1
"""The same for ln curl: a hand's breadth on a draw."""
MAX_CURL_SIGMA = 0.5
"""Standard error of a throw's ln curl above which it is ignored."""
STONE_DRAWS = 16
"""Number of ices sampled for the effect of a map's errors on single throws."""
MAX_MORE_THROWS = 50
"""Maximum number of further throws that is suggested."""
