"""The tuned numbers of finding a stone in pictures and of learning its look.

They were set on films that `friction_estimation.synthetic` renders, from all of its named cameras.
What stones are like, the prior of a learnt shape, stands in `profile`.
"""

import numpy as np

# --- the fit in one frame -------------------------------------------------------------------------

MARGIN_PX = 4.0
"""Width of the ring of background around the stone that the fit looks at: about three blurs."""
OUTLIER_AT = 4.0
"""Residuals of this many standard deviations count half (Geman-McClure weights)."""
EDGE_DISTANCE_PX = 40.0
"""A stone this near to the image's edge may be cut off."""
PIXEL_CORRELATION = 4.0
"""Residuals of neighbouring pixels agree (blur, compression): this many count as one."""
MAX_STEPS = 12
"""Gauss-Newton steps between two paintings."""
MAX_PAINTINGS = 8
"""Paintings of the stone in one fit."""
NEGLIGIBLE_STEP = 0.3
"""A step of less than this share of a standard error ends the fit."""
TURN_REPAINT_PX = 0.5
"""The derivative by the heading is repainted when the stone has moved by more than this [px]."""
REPAINT_PX = 0.7
"""The stone is painted again when it has moved by more than this [px]."""
REPAINT_TURN = 0.15
"""The same for its heading [rad]."""
LONGEST_STEP = 0.08
"""A step moves the stone no farther [m]."""
LONGEST_TURN = 0.3
"""A step turns the stone no farther [rad]."""
TURN_DIFFERENCE = 0.05
"""Turn for the derivative by the heading [rad]."""

# --- a stone among others -------------------------------------------------------------------------

HIDDEN_SHARE = 0.05
"""A pixel is hidden where a nearer stone covers more than this share of it."""
MAX_HIDDEN = 0.7
"""A stone of which others hide a larger share is not measured."""
MAX_HIDDEN_HEADING = 0.2
"""A stone of which others hide a larger share shows no heading."""
STRANGE_WEIGHT = 0.25
"""A pixel with less robust weight shows neither stone nor ice."""
FILL_ROUNDS = 3
"""Rounds in which hidden pixels are filled with what the stone would show there."""

# --- crops of a film ------------------------------------------------------------------------------

CROPS_TO_LEARN_FROM = 30
"""Frames that a look is learnt from; more only take time."""
MIN_NOISE = 1.0
"""Residuals are never trusted better than one grey level, which is how films are stored."""
MIN_STONE_SHARE = 0.05
"""Pixels of which the stone covers less count as ice."""
STRANGE_PICTURE = 0.5
"""A picture of which the look leaves more unexplained does not show the stone, if most pictures do:
they leave 0.03 to 0.2, and those of another stone about 0.7."""
COLOUR_NOISE_FACTOR = 5.0
"""Factor on the noise of colour, which films store at half resolution and shifted: colour may find
a handle, but not move a stone."""

SHADOW_REACH = 0.05
"""Maximum distance from a stone's edge at which pixels are learnt from if people are near [m]."""

# --- the handle and the headings ------------------------------------------------------------------

HEADINGS_TRIED = 24
"""Headings that are tried in each frame when a look is learnt."""
HEADINGS_COMPARED = 16
"""Headings that are compared in a frame whose heading is doubtful."""
SPINS_TRIED = np.linspace(-4.0, 4.0, 33)
"""Rates of turning that are tried [rad/s]; a stone thrown to stay in play hardly turns faster."""
SPIN_CHANGE = 0.05
"""Change of spin that costs as much as one standard error of one crop [rad/s]."""
HANDLE_RISES = (0.03, 0.045, 0.06)
"""Heights above the top at which a handle is looked for [m]."""
HANDLE_COLLARS = (0.0, 0.04)
"""Radii of the round base with which it is looked for [m]."""
HEADING_SPREAD = 0.3
"""Standard deviation of a heading about that of a stone that turns steadily, found on a coarse grid
[rad]."""
HEADING_WEIGHT = PIXEL_CORRELATION / HEADING_SPREAD**2
"""Weight of what is expected of a heading beside the pixels' [per rad²]."""
MIN_HANDLE_CONTRAST = 10.0
"""Minimum contrast of a handle's colour with the rest of the stone [grey levels]."""
SOLVED_CONTRAST = 15.0
"""Minimum contrast of a handle's colour with that of the top where no pixel shows it alone, and it
is solved [grey levels]: painted stones without a handle came to 9 at most, with a red one to 26 or
more."""
COLOUR_ROUNDS = 4
"""Rounds in which colours are solved, each with fewer strange pixels."""

# --- learning shape and colours -------------------------------------------------------------------

TRIAL_SHADOW = 0.1
"""Strength of shadow, contact shade and mirror image where the search begins."""
REFINEMENTS = ((3, 8), (2, 8), (1, 20))
"""Stages of the fit: the step between the crops that are used, and the maximum number of rounds.
Noise and headings are found again from all crops after each."""
REFINED_WITH = 15
"""Approximate number of crops in the last stage, if there are twice that number or more."""
REFINED_AGAIN = (3, 5)
"""The same for the look whose handle is sought again."""
OTHER_HANDLE = 0.85
"""Its squared misfit must be less than this share of the other's. Where the first handle was right,
it came to 0.92 or more, and to 0.73 where that was shade."""
ADAPTING_ROUNDS = 20
"""Greatest number of rounds in which a look is fitted to other crops."""
ENOUGH_PIXELS = 24_000
"""Of large stones, crops are dropped until about this many pixels remain."""
ENOUGH_CROPS = 8
"""At least this many crops are kept."""
ALIKE_PICTURES = 4.0
"""Number of pictures of a stone that repeat each other's faults, and count as one."""
ALIKE_AT_HEIGHTS = 12.0
"""The same where heights of a camera are compared: what no look can paint changes along a path as
the picture does when the height is wrong, so that all pictures count as one."""
ALIKE_IN_FIT = 2.0
"""`ALIKE_PICTURES` in a fit: with more, stones seen from low down get too typical a shape."""
UNLIKELY_KIND = 0.05
"""A kind of stones that is less likely is not looked into."""
RISES = (0.002, 0.004, 0.006, 0.01, 0.014)
"""Heights by which stones are raised and lowered along the line of sight until unlikely [m]."""
RISE_SIGMA = 0.0015
"""Standard error of the height at which a look shows a stone, before others are asked [m]."""
RAISED = 10
"""Of more crops, about this many are raised: neighbours repeat each other's faults."""
PLACED_ROUNDS = 8
"""Greatest number of rounds in which a look is fitted to raised stones."""
UNLIKELY_RISE = 12.0
"""Excess over the best fit at which a stone is raised no further [squared standard errors]."""
MIN_GAIN = 0.5
"""A round that lowers the squared standard errors by less is the last."""
CLEAR_GAIN = 2.0
"""Minimum gain of a fit that was begun again: smaller ones depend on rounding."""
MAX_FOOT_BRIGHTNESS = 1.1
"""Brightness of the foot over that of the side: it overhangs and is lit by the ice alone."""
