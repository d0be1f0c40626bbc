"""Constants of the inversion that were chosen, not derived.

Unless a constant says otherwise it was chosen on simulated sessions of two to thirty throws, with
the errors of tracks that were filmed from the end of the sheet, from its side and from above.
Lengths are in metres, times in seconds, and ln μ is the natural logarithm of the friction.
"""

from __future__ import annotations

# --- one throw ---------------------------------------------------------------------------------

PATH_KNOT_SPACING = 3.0
"""Distance between the knots of the smooth line through a track [m]; curl changes more slowly."""
MIN_HEADINGS = 20
"""Rows with a heading that are needed to estimate the spin."""
USUAL_SPIN = 0.9
"""Spin of a stone whose heading was not measured [rad/s]: three to four turns in 25 s."""

# --- effects fitted with the map ---------------------------------------------------------------

PARAMETER_PRIOR_SD = 0.25
"""Prior standard deviation of an effect's parameter, as a part of the width of its range."""
EFFECT_PRIOR_SD = 0.1
"""Change of ln μ to which a prior standard deviation of an effect's parameter is equated, where
the information on different unknowns is compared."""

# --- noise -------------------------------------------------------------------------------------

NOISE_GATE = 5.0
"""Standard deviations between a row and its prediction from which on the row is left out."""
SLOW_NOISE_GAIN = 6.0
"""Gain in 2·ln likelihood that the two parameters of correlated noise must bring (χ², 5 %)."""
SMOOTHED_CORRELATION = 0.2
"""Correlation of successive increments above which a track counts as smoothed."""
MAX_SMOOTHING_TIME = 1.0
"""Longest smoothing of a track that is considered [s]."""
MIN_NOISE = 1e-5
"""Smallest noise that is considered [m], so that exact tracks do not divide by zero."""
MAX_NOISE_TIME = 0.5
"""Longest correlation time of noise beside a map [s]: what lasts longer is ascribed to the ice."""

# --- prior of the friction ---------------------------------------------------------------------

LEVEL_PRIOR_SD = 1.0
"""Prior standard deviation of the level of ln μ: a factor e either way."""
USUAL_SPREAD, USUAL_LENGTH = 0.04, 3.0
"""Centres of the hyperprior: standard deviation of ln μ over the sheet, and the distance over
which it is alike [m]. Published measurements give 2 to 5 % at 1 to 3 m."""
LOG_SPREAD_SD, LOG_LENGTH_SD = 1.0, 0.7
"""Standard deviations of the logarithms of spread and length in the hyperprior."""
USUAL_SCATTER = 0.003
"""Scale of the half-Cauchy prior of the scatter of ln μ from throw to throw."""
MIN_THROWS_FOR_SMOOTHNESS = 6
"""Throws from which on the data choose the smoothness of the field; fewer cannot tell it."""
MIN_INFORMATION = 0.5
"""Directions of ln μ with less information (1/variance) than this are left out: at a spread of
0.1 they would explain 0.5 % of what is unknown."""
CLEAR_INFORMATION = 10.0
"""The same limit for the first, coarse search of the hyperparameters."""

# --- Gauss-Newton ------------------------------------------------------------------------------

UNIFORM_ROUNDS = 8
"""Most rounds of the fit of one friction."""
MAP_ROUNDS, MAP_AND_EFFECTS_ROUNDS, CAMERA_BIAS_ROUNDS = 4, 6, 5
"""Rounds of the fit of a map alone, with effects, and with a bias of the camera. Paths are nearly
linear in ln μ, less so in the parameters of effects."""
MAX_LOG_STEP = 0.7
"""Largest change of ln μ in one round: a factor of 2."""

# --- bias of the camera along the sheet --------------------------------------------------------

CAMERA_BIAS_NODE_SPACING = 0.75
"""Distance between the nodes of the bias [m]; the spline between them follows waves from 2 m on."""
USUAL_CAMERA_BIAS, USUAL_CAMERA_BIAS_LENGTH = 0.003, 1.5
"""Scale of the half-Cauchy prior of its amplitude [m], and centre of the prior of its correlation
length [m]."""
CAMERA_BIAS_UNIT = 0.1
"""Metres of bias equated to ln μ = 1 where information is compared: 10 mm is like a tenth of μ."""
MIN_CAMERA_BIAS_GAIN = 30.0
"""Gain in 2·ln evidence from which on a bias is clear. Real ones of 2 mm bring hundreds; waves of
1 mm in smoothed tracks bring up to 20."""
MIN_HALVES_CORRELATION = 0.6
"""Least correlation between the biases that two halves of the throws find."""
MIN_CAMERA_BIAS = 3e-4
"""Amplitude below which a bias is not followed up [m]: it changes μ by one per cent at most."""
MIN_THROWS_FOR_CAMERA_BIAS = 6
"""Throws from which on two halves can be compared."""
MIN_SPEED_VARIETY = 0.2
"""Least variety of the signed v² at which throws pass the same places, for a bias to be told from
the ice. Equal draws one way have 0.03, one way at 1.3 to 2.4 m/s 0.35, both ways 1."""

# --- systematic error that tracks state --------------------------------------------------------

STATED_ERROR_LENGTH = 5.0
"""Distance over which errors of pose, lens and outline are alike [m]. Chosen so that 95 % intervals
of sessions filmed from three places, with corners marked 3 px off, hold the true friction."""
