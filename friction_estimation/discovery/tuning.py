"""The numbers of discovery, by what they state: physics, priors, numerics and thresholds.

Only thresholds decide what is named. They were tuned on sessions of `scripts/blind` (seed 101),
whose generator shares no formula and no integrator with discovery; the results in docs/results.md
come from other seeds.
"""

from __future__ import annotations

import numpy as np

# --- physics: limits that stones, ice and cameras keep -------------------------------------------

SLOWEST_NOISE_PERIOD = 2.0
"""Minimum period of physical motion in raw tracks [s]."""
SLOWEST_FILM_NOISE_PERIOD = 6.0
"""Minimum period of physical motion in tracks from film [s]. A tracked point that winds about the
stone's centre is faster; it is found all the same, because its phase is the same in all throws."""
SMOOTHED_PERIOD = 2.5
"""Longest period that a smoother flattens [s]."""
NARROWEST_PATCH = 0.15
"""Minimum width of a patch [m]: a stone's running band."""
LONGEST_PATCH = 16.0
"""Maximum length of a patch [m]."""
LARGEST_LN_FACTOR = 2.0
"""Largest |ln factor| of a throw's friction that a fit may try: seven times heavier or keener."""

# --- priors: what is usual, before any throw -----------------------------------------------------

MEMORY_BOUNDS = (0.05, 0.7)
"""Shortest and longest correlation time of the noise [s]: a longer one looks like physics."""
FILM_MEMORY_BOUNDS = (0.05, 2.0)
"""The same for tracks from film."""
SLOW_HEADING_SHARE = 0.1
"""Share of the stated error of a film's heading that lasts for the time of `FILM_MEMORY_BOUNDS`."""
USUAL_SPIN = 1.5
"""Spin of a throw whose heading was never measured [rad/s]."""
USUAL_SPIN_SIGMA = 0.6
"""Prior standard deviation of that spin [rad/s]: one to three turns. The spin is at least the usual
one less two of these, on the side of the path's bend: if a spin near zero changes its sign, the
path changes abruptly, and the fit may not converge."""
USUAL_FRICTION = 0.009
"""Initial μ of a plain baseline: that of a draw of 25 s."""
COUPLING_SIGMA = 0.15
"""Prior standard deviation of ln(m·r²/I), which turns friction into torque: inertia ±10 %, radius
of the band ±5 %."""
RELEASE_SIGMA = np.array([100.0, 100.0, 20.0, 20.0, 1e3, 50.0])
"""Weak prior standard deviations of a release [m, m/s, rad, rad/s], which make a throw without
heading solvable."""
LEAST_SPREAD = 4e-4
"""Minimum throw-to-throw spread of ln μ. With a spread of exactly zero an error of a tenth of a per
mille would count as an effect."""
USUAL_SPREAD = 0.004
"""Throw-to-throw spread of ln μ that is assumed for few throws."""
LENGTH_ERROR = 0.02
"""Usual standard error of a length in the tracks [m]: the width of a line."""
CLOCK_ERROR = 0.2
"""Usual standard error of an interval by a stopwatch [s]."""
SYSTEMATIC_LENGTH = 7.0
"""Distance along the sheet over which systematic errors of a camera change [m]: no lens, pose or
outline bends faster."""
SYSTEMATIC_OVER_CLAIMED = (0.5, 3.0)
"""Minimum and maximum amplitude of these errors over the stated standard error of the tracks. An
error that all throws share partly looks like ice, so that throws alone never exclude it."""
SYSTEMATIC_LIMITS = (2e-3, 8e-3)
"""Upper limits of the minimum and of the maximum amplitude [m]. A tracker that detects a wrong lens
states decimetres."""
USUAL_RIPPLE = 0.003
"""Scale of the half-Cauchy prior of the amplitude of a camera's ripple [m]."""
RIPPLE_LENGTHS = (0.8, 1.5, 3.0)
"""Distances over which a ripple changes that are tried [m]; the second is the usual one."""
USUAL_PUSHES = np.array([0.04, 0.004, 0.01, 0.04, 0.004])
"""Prior standard deviations of the pushes along, left, turn, along and across the sheet [1, m/s²,
rad/s², 1, m/s²]: some per cent of friction."""
USUAL_MAP_SD, LOG_MAP_SD_SPREAD = 0.04, 1.0
"""Centre of the prior of the standard deviation of ln μ over the sheet, and the standard deviation
of its logarithm. Published measurements give 2 to 5 %."""
MAP_SHAPES = (
    *((length, 2.5) for length in (1.2, 2.0, 3.2, 5.0, 8.0)),
    *((length, np.inf) for length in (1.0, 1.5, 2.1, 3.0, 4.2, 6.0)),
)
"""Correlation lengths [m] and Matérn orders that are tried."""

# --- numerics: grids, steps, and limits of a search ----------------------------------------------

LEAST_NOISE = (2e-4, 2e-4)
"""Minimum noise of a coordinate and of the heading [m, rad]: simulated tracks are rounded."""
LEAST_TRACK_NOISE = (1e-3, 5e-3)
"""The same for a track before any fit: slow cosines leave residuals at its beginning and end."""
SMOOTHED_SPACING = 1.0 / 3.0
"""Time between the kept rows of a smoothed track [s]: rows between add no information."""
HIGHEST_FRAME_RATE = 40.0
"""Rows per second kept of faster films [1/s]: a slide is smooth over 25 ms."""
NOISE_THROWS = 24
"""Maximum number of throws from which the noise is estimated, spread over the session. With eight
throws its slow part is known to 20 % only."""
SYSTEMATIC_NODE_SPACING = 4.5
"""Distance between the nodes of systematic errors along the sheet [m]."""
SYSTEMATIC_AMPLITUDES = 6
"""Number of amplitudes of systematic errors that are tried."""
SPREADS = np.geomspace(LEAST_SPREAD, 0.3, 80)
"""Throw-to-throw spreads of ln μ that are tried, and integrated over, with a uniform prior (Gelman,
Prior distributions for variance parameters, Bayesian Analysis 1 (2006))."""
RELATIVE_AMPLITUDES = 2.0 ** np.arange(-4.0, 2.5, 0.5)
"""Amplitudes of a ripple or push that are tried, as multiples of the usual one."""
MAP_AMPLITUDES = np.geomspace(0.002, 0.16, 14)
"""Standard deviations of ln μ over the sheet that are tried."""
MAP_SHARE = 0.9999
"""Minimum share of the field's variance, where stones ran, in its patterns."""
MOST_MAP_PATTERNS = 120
"""Maximum number of patterns of a field."""
PATCH_CELL = (0.25, 1.0)
"""Width and length of the cells of the search for a patch [m]: paths of stones are rarely closer to
each other. The length is also the prior standard deviation of a side about its placed position."""
SIDE_SHIFTS = tuple(
    sign * shift for shift in (0.06, 0.12, 0.2, 0.3, 0.5, 0.8, 1.2, 1.7, 2.4) for sign in (-1, 1)
)
"""Shifts of a side of a patch that are tried [m]. Between two lanes on which stones ran the fit may
be worse than on either, if the map has absorbed a part."""
PATH_STEP = 3e-3
"""Displacement of a path by a finite difference in a parameter [m]."""
CONVERGED = 0.05
"""Fall of the deviance in a step below which a fit has converged."""
BETTER_MAP = 1.0
"""Minimum fall of −2 ln likelihood for a map of another length."""
LAST_STEPS = 40
"""Maximum number of steps of the final fit to all throws. Most sessions need five."""
MOST_TRIALS = 4
"""Number of candidates that are fitted in a round. It is large because an effect with a wrong usual
shape scores low until its shape is fitted."""
MOST_ADDITIONS = 6
"""Maximum number of effects that a selection adds. Early ones may turn out to be copies of others
and are dropped again, so more are added than named."""
MOST_VARIABLES = 3
"""Maximum number of pushes in a model, and of named variables: an unknown that needs more is not
described."""
HELD_OUT_SHARE = 0.25
"""Share of held-out throws."""
FORECAST_SECONDS = 4.0
"""Duration of the first part of a throw, on which its forecast is based [s]."""

# --- thresholds: what counts as shown, proved or alike -------------------------------------------

OUTLIER_DEVIATIONS = 4.5
"""Robust standard deviations of the fast part beyond which a row is an outlier: one good row in
150,000."""
CLEARLY_OFF = 3.0
"""Minimum significance of a correction of the given model, or of the lengths or times of the tracks
[standard errors]."""
CLEARLY_SEEN = 5.0
"""Minimum significance of an effect that would have been named, of residuals that are no noise, and
of an exceptional throw [standard errors]."""
LEAST_ROWS = 20
"""Minimum number of rows of a series that is filtered."""
LEAST_HEADINGS = 10
"""Minimum number of rows with a heading for a measured spin."""
LEAST_THROWS = 8
"""Minimum number of throws for naming an effect."""
LEAST_THROWS_FOR_SPREAD = 4
"""Minimum number of throws that can show a spread."""
SMOOTHED_JITTER = 0.5
"""Jitter from row to row, over the stated standard error, below which a track counts as smoothed;
above it the stated error is the noise of single rows. Tracks from film have 0.01 to 0.13."""
LEAST_LIKENESS_OF_HALVES = 0.6
"""Minimum correlation between the ripples from two halves of the throws."""
LEAST_VARIETY = 0.2
"""Minimum variety of the signed v² at which throws pass the same places, for a ripple to be
distinguished from the ice. Equal draws one way have 0.03, one way at 1.3 to 2.4 m/s 0.35, both
ways 1."""
LEAST_GAIN = 16.0
"""Required fall of −2 ln likelihood for an effect. Chance gives as much once in three thousand
sessions, even for effects between throws with a dozen throws. An alternative that is worse by as
much is ruled out."""
GAIN_PER_PARAMETER = 4.0
"""Additional required fall for every parameter beyond the first, and minimum linear gain of a
candidate that is fitted."""
MOST_EFFECTS = 4
"""Number of effects after which a selection continues only if the residuals are nearly noise:
larger ones belong to an unknown effect, which further names would copy."""
RIVAL_GAIN = 0.8
"""Minimum gain of an alternative, as a share of the effect's, for it to be fitted."""
STILL_BELIEVED = 0.7
"""Standard error over the prior's above which a parameter counts as assumed, not measured."""
WHITE_RATIO = 1.25
"""Maximum ratio of slow residuals to the prediction from the noise at which they count as white:
the spectrum of the noise is an estimate."""
WHITE_RATIO_OF_FILM = 2.0
"""The same for tracks from film, whose noise is estimated over seconds and extrapolated to the
duration of a throw."""
LARGEST_P = 0.05
"""Maximum p of all proved effects of a session together (each of n effects: an n-th of it), and of
a variable that the unknown follows."""
LARGEST_P_BETWEEN_THROWS = 0.004
"""Maximum p of a circumstance that the throws' frictions follow. There are few throws and many
circumstances, and a wrong name is worse than none."""
LARGEST_SPREAD = 0.015
"""Maximum scatter of ln μ between throws without an unknown effect. Throws on one ice scatter by up
to 1 %, and blind sessions in which all effects were named by at most 1.2 %."""
LARGEST_IMPROVEMENT = 9.0
"""Maximum improvement of a throw's score that counts."""
EVENT_SHARE = 0.7
"""Share of the misfit that exceptional throws must explain."""
MOST_EVENTS = 0.15
"""Maximum share of exceptional throws."""
FURTHER_VARIABLE_GAIN = 0.1
"""Minimum share of a further variable, relative to the first one's."""
COPY_ERROR = 0.003
"""Relative error of pushes: they are not an exact copy of the cause, and the response of paths is
only partly linear. A term that explains less may merely correct that."""
LARGEST_REST = 0.2
"""Maximum share of the remaining misfit at which this rule is not applied."""
THE_SAME = 0.99
"""Share of an effect's squared response that pushes can reproduce above which the two are
equivalent. A constant push across the sheet reproduces 0.997 of a slope across it."""
LEAST_SURVIVING = 0.5
"""Minimum share of an effect's gain that must remain if the unknown may act in another way."""
