"""Constants of the coaching functions that were chosen, not derived.

They were chosen on simulated clubs (`scripts/simulated_club.py`).
"""

from __future__ import annotations

# --- the release, read from a track --------------------------------------------------------------

RELEASE_WINDOW = 10.0
"""Stretch beyond the hog line from which the release is read [s]. What happens to a stone later
(a hair, a sweeper) is not laid to the hand."""
OWN_FRICTION = 0.03
"""How much the friction of one throw may differ from that of the ice, in ln, while its release is
read: stones differ by 1 %, frost and swept ice by more."""
OWN_CURL = 0.3
"""The same for its curl."""
WIDE_FRICTION = 0.3
"""The same where the friction of the throw itself is asked for."""
WIDE_CURL = 1.0
"""The same for its curl."""
MOST_FRICTION, MOST_CURL = 0.6, 1.0
"""How far these may go, in ln: further off it is no curling stone."""
BIN = 0.125
"""Rows are averaged over this time before a fit [s]."""
WIDE_BIN = 0.25
"""The same for the whole slide [s]."""
LASTING = 1.5
"""How long an error of a track lasts that its σ states [s]."""
UNSEEN_SPIN = 0.6
"""Standard deviation of a spin that was not seen [rad/s]."""
LATEST_START = 1.2
"""How far beyond the hog line a track may begin for its release to be told [m]."""
FEWEST_BINS = 12
"""Fewest averaged rows from which a release is read: a second and a half."""

# --- causes ------------------------------------------------------------------------------------

DRAWS = 64
"""Errors of the measurement and of the ice that are drawn for the intervals."""
HABIT_THROWS = 3
"""Throws from which an athlete's usual rotation, or speed for a named weight, is taken."""
FEWEST_TOGETHER = 4
"""Throws from which on what none of them explains corrects the ice of all."""
MAX_REACH = 0.6
"""How far before the target of a hit the free slide may end [m]: two radii, and a frame."""

# --- athletes ----------------------------------------------------------------------------------

USUAL_SPREAD = (0.04, 0.25, 0.3)
"""Spread of speed [m/s], line at the far tee [m] and spin [rad/s] that is believed of anybody
beforehand: a little more than a club player's, and held by little."""
USUAL_BIAS = (0.03, 0.15, 0.2)
"""How large a bias is believed to be beforehand, the same."""
GROUP_WEIGHT = 8.0
"""How firmly the spreads of an athlete's groups are held together, in throws and four more."""
GIBBS_WARM_UP, GIBBS_DRAWS = 150, 600
"""Draws of an athlete's posterior: the first are thrown away."""
TAILS = (2.2, 2.5, 3.0, 3.5, 4.0, 5.0, 6.0, 8.0, 12.0, 20.0)
"""Degrees of freedom of Student's t that are tried for an athlete's errors."""
TAIL_EVIDENCE = 9.0
"""Twice the gain in log likelihood over normal errors from which on an athlete has tails; about one
athlete in a thousand without tails gains as much by luck."""

# --- stones ------------------------------------------------------------------------------------

ALIKE_FRICTION = 0.01
"""Difference in ln friction below which two stones are a pair: 30 cm on a draw."""
ALIKE_CURL = 0.1
"""The same for the curl: a hand's breadth on a draw."""
KNOWN_CURL = 0.5
"""Standard error of a throw's ln curl above which it says nothing."""
STONE_DRAWS = 16
"""Ices drawn for what a map's errors do to single throws."""
MOST_MORE = 50
"""Throws beyond which nobody would go on."""
