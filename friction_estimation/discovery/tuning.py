"""The tuned numbers of discovery.

They were tuned on sessions of `scripts/blind` (seed 101), whose
generator shares no formula and no integrator with discovery. The results in docs/results.md come
from other seeds.
"""

from __future__ import annotations

import numpy as np

# --- what is a session ------------------------------------------------------------------------

MAX_SESSION_THROWS = 1000
"""More are not made on one ice between two floodings; a game has 160."""
MAX_THROW_ROWS = 20_000
"""Of one throw: 80 s of a camera that takes 240 frames a second."""
MAX_THROW_SECONDS = 900.0
"""Of one throw with all that a track shows before and after it [s]; a slide takes 30."""
MAX_MAP_CELLS = 25_000
"""Of the map that a fit begins with; a stone's band is wider than such a cell."""

# --- outliers and noise ------------------------------------------------------------------------

SLOWEST_NOISE_PERIOD = 2.0
"""Whatever swings slower than this may be physics [s]."""
OUTLIER_DEVIATIONS = 4.5
"""Robust standard deviations of the fast part beyond which a row is an outlier: one good row in
150 000."""
LEAST_ROWS = 20
"""Rows below which a series is left as it is."""
LEAST_NOISE = (2e-4, 2e-4)
"""Smallest noise of a coordinate and of the heading [m, rad]: simulated tracks are rounded, and no
other is perfect."""
LEAST_TRACK_NOISE = (1e-3, 5e-3)
"""The same for a track before any fit: slow cosines leave a little where it begins and ends."""
MEMORY_BOUNDS = (0.05, 0.7)
"""Shortest and longest memory of the noise [s]: a longer one looks like physics."""
NEARLY_LONGEST = 0.95
"""Part of the longest memory from which on it may be longer."""
FILM_MEMORY_BOUNDS = (0.05, 2.0)
"""The same for tracks from film."""
SLOW_HEADING_SHARE = 0.1
"""Share of the error that a film's heading claims which is taken to last for as long as
`FILM_MEMORY_BOUNDS` allow."""
SLOWEST_FILM_NOISE_PERIOD = 6.0
"""Whatever swings slower than this in a track from film may be physics [s]. A tracked point that
winds about the stone's centre is faster; it is found even so, because it winds in step in all
throws."""
SMOOTHED_PERIOD = 2.5
"""Whatever swings faster than this a smoother has flattened [s]."""
SMOOTHED_JITTER = 0.5
"""Jitter from row to row, over the standard error that a track claims, below which the track counts
as smoothed; above it the claim is the noise of single rows. Tracks from film have 0.01 to 0.13."""
SMOOTHED_SPACING = 1.0 / 3.0
"""Time between the rows that are kept of a smoothed track [s]: those between say nothing new."""
NOISE_THROWS = 24
"""Throws from which the noise is learnt at most, spread over the session. With eight throws its
slow part is good to 20 % only."""

# --- sessions ----------------------------------------------------------------------------------
LEAST_THROWS = 8
"""Throws below which nothing is named."""
HIGHEST_FRAME_RATE = 40.0
"""Rows a second that are kept of faster films [1/s]: a slide is smooth over 25 ms."""
LEAST_HEADINGS = 10
"""Rows with a heading from which a throw's spin counts as measured."""
USUAL_SPIN = 1.5
"""Spin of a throw whose heading was never measured [rad/s]."""
USUAL_SPIN_SIGMA = 0.6
"""Prior standard deviation of that spin [rad/s]: one to three turns. It is never less than two of
these below the usual one, on the side that the path's bend shows: where a spin near zero changes
its sign, the path changes at once, and a fit that steps over it gets lost."""

# --- references --------------------------------------------------------------------------------
LENGTH_ERROR = 0.02
"""Usual standard error of a length that is read off the tracks [m]: the width of a line."""
CLOCK_ERROR = 0.2
"""Usual standard error of an interval by a stopwatch [s]."""

# --- systematic errors of the camera -----------------------------------------------------------
SYSTEMATIC_LENGTH = 7.0
"""Distance along the sheet over which they change [m]: no lens, pose or outline bends faster."""
SYSTEMATIC_NODE_SPACING = 4.5
"""Distance between the nodes along the sheet that span them [m]."""
SYSTEMATIC_OVER_CLAIMED = (0.5, 3.0)
"""Least and largest amplitude over the standard error that the tracks claim. Whatever all throws
share looks like ice in part, so that the throws alone never rule it out."""
SYSTEMATIC_LIMITS = (2e-3, 8e-3)
"""Upper limits of the least and of the largest amplitude [m]. A tracker that notices that its lens
is wrong claims decimetres."""
SYSTEMATIC_AMPLITUDES = 6
"""Number of amplitudes that are tried."""

# --- ripple of the camera ----------------------------------------------------------------------
RIPPLE_NODE_SPACING = 0.75
"""Distance between its nodes along the sheet [m]; the spline between them follows waves from 2 m
on."""
USUAL_RIPPLE = 0.003
"""Scale of the half-Cauchy prior of its amplitude [m]."""
RIPPLE_AMPLITUDES = np.geomspace(3e-4, 0.02, 8)
"""Amplitudes that are tried [m]. A smaller one changes μ by one per cent at most."""
RIPPLE_LENGTHS = (0.8, 1.5, 3.0)
"""Distances over which it changes that are tried [m]; the second is the usual one."""
CLEAR_RIPPLE_GAIN = 30.0
"""Fall of −2 ln likelihood from which on a ripple is clear. Real ones of 2 mm bring hundreds; waves
of 1 mm in smoothed tracks bring up to 20."""
LEAST_LIKENESS_OF_HALVES = 0.6
"""Least correlation between the ripples that two halves of the throws find."""
LEAST_VARIETY = 0.2
"""Minimum variety of the signed v² at which throws pass the same places, for a ripple to be
distinguished from the ice. Equal draws one way have 0.03, one way at 1.3 to 2.4 m/s 0.35, both
ways 1."""

# --- fit ---------------------------------------------------------------------------------------
LEAST_SPREAD = 4e-4
"""Least throw-to-throw spread of ln μ. No two throws are alike; with a spread of exactly zero an
error of a tenth of a per mille would count as an effect."""
USUAL_SPREAD, LEAST_THROWS_FOR_SPREAD = 0.004, 4
"""Spread that is taken where throws are too few to show one, and from how many they are enough."""
SPREADS = np.geomspace(LEAST_SPREAD, 0.3, 80)
"""Throw-to-throw spreads of ln μ that are tried, and integrated over. All are equally likely
beforehand (Gelman, Prior distributions for variance parameters, Bayesian Analysis 1 (2006))."""
COUPLING_SIGMA = 0.15
"""Prior standard deviation of ln(m·r²/I), which turns friction into torque: inertia ±10 %, radius
of the band ±5 %."""
RELEASE_SIGMA = np.array([100.0, 100.0, 20.0, 20.0, 1e3, 50.0])
"""Weak prior standard deviations of a release [m, m/s, rad, rad/s], which keep a throw without
heading solvable."""
LARGEST_LN_FACTOR = 2.0
"""Largest |ln factor| of a throw's friction that a fit may try: seven times heavier or keener."""
CONVERGED = 0.05
"""Fall of the deviance in a step below which a fit has converged."""
LAST_STEPS = 40
"""Most steps of the fit to all throws, whose values are given out. Most sessions need five."""
PATH_STEP = 3e-3
"""Displacement of a path by a finite difference in a parameter [m]."""

# --- selection ---------------------------------------------------------------------------------
LEAST_GAIN = 16.0
"""Fall of −2 ln likelihood that an effect must bring. Chance brings as much once in three thousand
sessions, even for effects between throws, of which a dozen throws tell. What is worse than a named
effect by as much is ruled out in its place."""
GAIN_PER_PARAMETER = 4.0
"""More of it for every parameter beyond the first."""
LEAST_LINEAR_GAIN = 6.0
"""Linear gain below which a candidate is not fitted."""
MOST_TRIALS = 9
"""Candidates that are fitted in a round. Generous: an effect whose usual shape is wrong looks poor
until its shape is fitted."""
MOST_BETWEEN_THROWS_TRIALS = 2
"""Of these, effects between throws: where something else is missing they all look alike."""
MOST_EFFECTS = 4
"""Effects after which a selection goes on only where what is left is nearly noise: where much is
left it is something unknown, and further names would copy it."""
ASTRAY = 20.0
"""Slow misfit over that of noise from which on a selection counts as gone astray: what is missing,
if it has a name, leaves a few at most."""
STILL_BELIEVED = 0.7
"""Standard error over the prior's from which on a parameter counts as believed, not measured."""
CLEARLY_OFF = 3.0
"""Standard errors by which a given number must differ from the throws', or a calibration factor
from one, to be reported."""
CLEARLY_SEEN = 5.0
"""Standard errors from which an effect would have been named, and from which paths are taken to
bend with the rotation."""

# --- patches -----------------------------------------------------------------------------------
PATCH_CELL = (0.25, 1.0)
"""Width and length of the cells of the search for a patch [m]: stones rarely run closer than this
side by side. The length is also the standard deviation of a side from where it was placed, before
it is fitted."""
LONGEST_PATCH = 16.0
"""Longest rectangle that is tried [m]: a longer one is the sheet, not a patch."""
SIDE_SHIFTS = tuple(
    sign * shift for shift in (0.06, 0.12, 0.2, 0.3, 0.5, 0.8, 1.2, 1.7, 2.4) for sign in (-1, 1)
)
"""Shifts of a side of a patch that are tried for a better fit [m]. Between two lanes on which
stones ran there may be a place that fits worse than either, where the map had taken a part."""
NARROWEST_PATCH = 0.15
"""Narrowest patch [m]: a stone's running band."""

# --- what is left ------------------------------------------------------------------------------
WHITE_RATIO = 1.15
"""Slow residuals over what the noise foretells, up to which they count as white: the noise's own
spectrum is an estimate."""
WHITE_RATIO_WITH_MEMORY = 1.25
"""The same for noise with a memory, most of which is slower than the part it is learnt from: three
standard deviations of what 16 throws show of a memory of 0.3 s."""
WHITE_RATIO_OF_FILM = 2.0
"""The same for tracks from film, whose noise is learnt within seconds and carried on to what lasts
for a throw."""
NOT_WHITE = 4.0
"""Standard deviations of χ² beyond which residuals are not white."""

# --- evidence ----------------------------------------------------------------------------------
LARGEST_P = 0.05
"""p up to which all effects of a session together are proved: each of n up to an n-th of it; and up
to which the unknown follows a variable."""
LARGEST_P_BETWEEN_THROWS = 0.004
"""p below which an effect between throws is proved, and below which the throws' frictions follow
something. There are few throws and many such effects, and a wrong name is worse than none."""
LARGEST_SPREAD = 0.015
"""Scatter of ln μ between throws beyond which something unknown differs between them. Throws on one
ice scatter by up to 1 %, and blind sessions in which all was named left at most 1.2 %."""
LEAST_CLOSURE = 0.97
"""Part of the misfit that effects must close to be named where no push describes what is left: a
proxy closes up to 0.97."""
SURPRISING_THROW = 6.0
"""Standard deviations of χ² beyond which a throw differs from the model."""
EVENT_SHARE = 0.7
"""Part of all misfit that must go with the throws in which something may have happened once."""
MOST_EVENTS = 0.15
"""Largest part of the throws in which something may have happened once; more is no accident."""
LARGEST_IMPROVEMENT = 9.0
"""Largest improvement of a throw's score that counts."""
HELD_OUT_SHARE = 0.25
"""Part of the throws that is held out."""
FORECAST_SECONDS = 4.0
"""First part of a throw, from which its forecast is made [s]: a sweeper has called by then."""
RIVAL_GAIN = 0.8
"""Part of an effect's gain from which a candidate is fitted in its place."""

# --- what the unknown follows ------------------------------------------------------------------
MOST_VARIABLES = 3
"""Most variables that are named."""
FURTHER_VARIABLE_GAIN = 0.1
"""Part of the first variable's share that a further one must have."""
USUAL_PUSHES = np.array([0.04, 0.004, 0.01, 0.04, 0.004])
"""Prior standard deviations of the pushes along, left, turn, along and across the sheet [1, m/s²,
rad/s², 1, m/s²]: some per cent of friction."""
PUSH_SCALES = (0.1, 0.3, 1.0, 3.0)
"""Multiples of these that are tried; the best for throws not seen is taken."""
MOST_PUSHES = 4
"""Most pushes that are added to a model: an unknown that needs more is described by none."""
COPY_ERROR = 0.003
"""Part of what pushes explain that they may get wrong: they are no exact copy of what acts, and
paths respond to them linearly in part only. A term that explains less may correct just that."""
THE_SAME = 0.99
"""Part of what an effect does to the throws, squared, that pushes can do as well, above which they
are one thing. Of a slope across the sheet a constant push across it does 0.997."""
LEAST_SURVIVING = 0.5
"""Part of what an effect explains that must be left when the unknown may act otherwise as well."""
LARGEST_REST = 0.2
"""Unless it leaves no more than this part of what was left."""

# --- friction map ------------------------------------------------------------------------------
USUAL_MAP_SD, LOG_MAP_SD_SPREAD = 0.04, 1.0
"""Centre of the prior of the standard deviation of ln μ over the sheet, and the standard deviation
of its logarithm. Published measurements give 2 to 5 %."""
MAP_AMPLITUDES = np.geomspace(0.002, 0.16, 14)
"""Standard deviations of ln μ over the sheet that are tried."""
MAP_SHAPES = (
    *((length, 2.5) for length in (1.2, 2.0, 3.2, 5.0, 8.0)),
    *((length, np.inf) for length in (1.0, 1.5, 2.1, 3.0, 4.2, 6.0)),
)
"""Correlation lengths [m] and Matérn orders that are tried."""
MAP_SHARE = 0.9999
"""Part of the field's variance, where stones ran, that its patterns must hold."""
MOST_MAP_PATTERNS = 120
"""Most patterns of a field."""
BETTER_MAP = 1.0
"""Fall of −2 ln likelihood from which on a map of another length is taken."""
