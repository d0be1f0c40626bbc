"""Tuned numbers of measuring a stone in pictures and of estimating its appearance.

They were set on films that `friction_estimation.synthetic` renders, from all of its named cameras.
The prior of shapes is in `prior`.
"""

import numpy as np

# --- physics --------------------------------------------------------------------------------------

HANDLE_RISES = (0.03, 0.045, 0.06)
"""Tried heights of the handle above the top [m]."""
HANDLE_COLLARS = (0.0, 0.04)
"""Tried radii of its round base [m]."""

# --- priors, and measured errors ------------------------------------------------------------------

PIXEL_CORRELATION = 4.0
"""Number of neighbouring pixels with correlated residuals (blur, compression) that count as one."""
MIN_NOISE = 1.0
"""Minimum standard deviation of residuals: one grey level, the resolution of films."""
COLOUR_NOISE_FACTOR = 5.0
"""Factor on the noise of colour, which films store at half resolution and shifted: colour helps to
find a handle, but must not move a stone."""
SHADOW_REACH = 0.05
"""Maximum distance of used pixels from a stone's edge if people are near [m]."""
SPIN_CHANGE = 0.05
"""Change of spin with the cost of one standard error of one crop [rad/s]."""
HEADING_SPREAD = 0.3
"""Standard deviation of a heading, found on a coarse grid, about steady rotation [rad]."""
HEADING_WEIGHT = PIXEL_CORRELATION / HEADING_SPREAD**2
"""Weight of the expected heading relative to the pixels [per rad²]."""
TRIAL_SHADOW = 0.1
"""Initial strength of shadow, contact shade and mirror image."""
ALIKE_PICTURES = 4.0
"""Number of pictures of a stone with common errors that count as one."""
ALIKE_AT_HEIGHTS = 12.0
"""The same in comparisons of camera heights: model errors vary along a path in the same way as
errors of the height, so that all pictures count as one."""
ALIKE_IN_FIT = 2.0
"""`ALIKE_PICTURES` in a fit: with more, the shape of stones in low views is biased to the prior."""
RISE_SIGMA = 0.0015
"""Standard error of the height of a stone from one appearance alone [m]."""
MAX_FOOT_BRIGHTNESS = 1.1
"""Brightness of the foot over that of the side: the foot overhangs and is lit by the ice alone."""

# --- numerics: sizes of samples, steps, and settings of searches ----------------------------------

MARGIN_PX = 4.0
"""Width of the ring of background around the stone in a fit: about three blurs."""
MAX_STEPS = 12
"""Number of Gauss-Newton steps between two paintings."""
MAX_PAINTINGS = 8
"""Maximum number of paintings in one fit."""
NEGLIGIBLE_STEP = 0.3
"""Step that ends the fit, as a share of a standard error."""
TURN_REPAINT_PX = 0.5
"""Movement after which the derivative by the heading is painted again [px]."""
REPAINT_PX = 0.7
"""Movement after which the stone is painted again [px]."""
REPAINT_TURN = 0.15
"""The same for its heading [rad]."""
LONGEST_STEP = 0.08
"""Maximum movement of a step [m]."""
LONGEST_TURN = 0.3
"""Maximum rotation of a step [rad]."""
TURN_DIFFERENCE = 0.05
"""Step of the derivative by the heading [rad]."""
FILL_ROUNDS = 3
"""Number of rounds in which hidden pixels are filled with the painted stone."""
CROPS_TO_LEARN_FROM = 30
"""Number of frames from which an appearance is estimated."""
HEADINGS_TRIED = 24
"""Number of headings that are tried in each frame during the estimation of an appearance."""
HEADINGS_COMPARED = 16
"""Number of headings that are compared in a frame with an uncertain heading."""
SPINS_TRIED = np.linspace(-4.0, 4.0, 33)
"""Rates of turning that are tried [rad/s]; a stone thrown to stay in play hardly turns faster."""
COLOUR_ROUNDS = 4
"""Number of rounds in which colours are fitted, each with fewer outliers."""
REFINEMENTS = ((3, 8), (2, 8), (1, 20))
"""Stages of the fit: the step between used crops, and the maximum number of rounds. Noise and
headings are estimated again from all crops after each."""
REFINED_WITH = 15
"""Approximate number of crops in the last stage, if there are twice that number or more."""
REFINED_AGAIN = (3, 5)
"""The same for the appearance with another handle."""
ADAPTING_ROUNDS = 20
"""Maximum number of rounds in which an appearance is fitted to other crops."""
ENOUGH_PIXELS = 24_000
"""Approximate maximum number of pixels of all crops; of large stones crops are dropped."""
ENOUGH_CROPS = 8
"""Minimum number of crops."""
RISES = (0.002, 0.004, 0.006, 0.01, 0.014)
"""Steps by which stones are raised and lowered along the line of sight until improbable [m]."""
RAISED = 10
"""Approximate maximum number of raised crops: the errors of neighbours are correlated."""
PLACED_ROUNDS = 8
"""Maximum number of rounds in which an appearance is fitted to raised stones."""
UNLIKELY_SHAPE = 12.0
"""Excess over the best fit beyond which stones are not raised further, and another kind of stone is
not considered [squared standard errors]."""
MIN_GAIN = 0.5
"""Gain below which a round is the last [squared standard errors]."""

# --- thresholds -----------------------------------------------------------------------------------

OUTLIER_AT = 4.0
"""Residuals with a quarter of the weight [standard deviations] (Geman-McClure); larger ones show
neither stone nor ice."""
MAX_HIDDEN = 0.7
"""Maximum hidden share of a stone that is measured."""
MAX_HIDDEN_HEADING = 0.2
"""Maximum hidden share of a stone whose heading is measured."""
MIN_STONE_SHARE = 0.05
"""Minimum share of a pixel that a stone covers; others count as ice, or as not hidden."""
STRANGE_PICTURE = 0.5
"""Maximum unexplained share of a picture that shows the stone, if most pictures do: theirs is 0.03
to 0.2, and of another stone about 0.7."""
MIN_HANDLE_CONTRAST = 15.0
"""Minimum contrast of a handle's colour with the rest of the stone [grey levels]: painted stones
without a handle came to 9 at most, with a red one to 26 or more."""
OTHER_HANDLE = 0.85
"""Maximum ratio of its squared misfit to the other's. If the first handle was correct, the ratio
was 0.92 or more, and 0.73 if that was shade."""
