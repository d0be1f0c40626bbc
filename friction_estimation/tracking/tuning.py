"""The tuned numbers of tracking, in the order in which a film meets them.

Unless a line says otherwise, they were set on films that `friction_estimation.synthetic` renders:
cameras behind, beside and above the sheet, 540 to 1080 lines, with people and without.
"""

from __future__ import annotations

from friction_estimation.tracking.joint.numbers import (
    AGE_AIM_DISTANCE as AGE_AIM_DISTANCE,
)
from friction_estimation.tracking.joint.numbers import (
    AGE_MARGIN_PX as AGE_MARGIN_PX,
)
from friction_estimation.tracking.joint.numbers import (
    AGE_NEIGHBOURS as AGE_NEIGHBOURS,
)
from friction_estimation.tracking.joint.numbers import (
    AGREEING_SHARE as AGREEING_SHARE,
)
from friction_estimation.tracking.joint.numbers import (
    BACKGROUND_FRAMES as BACKGROUND_FRAMES,
)
from friction_estimation.tracking.joint.numbers import (
    BLOB_RIM_PX as BLOB_RIM_PX,
)
from friction_estimation.tracking.joint.numbers import (
    BLOCK_ERROR as BLOCK_ERROR,
)
from friction_estimation.tracking.joint.numbers import (
    CAMERA_HEIGHTS as CAMERA_HEIGHTS,
)
from friction_estimation.tracking.joint.numbers import (
    CLEAR_FRONT as CLEAR_FRONT,
)
from friction_estimation.tracking.joint.numbers import (
    CLEAR_HEADING as CLEAR_HEADING,
)
from friction_estimation.tracking.joint.numbers import (
    CLEAR_PICTURE as CLEAR_PICTURE,
)
from friction_estimation.tracking.joint.numbers import (
    COARSE_HEIGHTS as COARSE_HEIGHTS,
)
from friction_estimation.tracking.joint.numbers import (
    COLOUR_ROUNDS as COLOUR_ROUNDS,
)
from friction_estimation.tracking.joint.numbers import (
    CORE_CONTRAST_SHARE as CORE_CONTRAST_SHARE,
)
from friction_estimation.tracking.joint.numbers import (
    DROPPED_CHANGE as DROPPED_CHANGE,
)
from friction_estimation.tracking.joint.numbers import (
    EDGE_ERROR_PX as EDGE_ERROR_PX,
)
from friction_estimation.tracking.joint.numbers import (
    FINE_HEIGHT_STEPS as FINE_HEIGHT_STEPS,
)
from friction_estimation.tracking.joint.numbers import (
    FRAMES_WITH_PEOPLE as FRAMES_WITH_PEOPLE,
)
from friction_estimation.tracking.joint.numbers import (
    GRANITE_SPREAD as GRANITE_SPREAD,
)
from friction_estimation.tracking.joint.numbers import (
    HANDLE_ERROR_PX as HANDLE_ERROR_PX,
)
from friction_estimation.tracking.joint.numbers import (
    HANDLE_RISE as HANDLE_RISE,
)
from friction_estimation.tracking.joint.numbers import (
    HANDLE_SPREAD as HANDLE_SPREAD,
)
from friction_estimation.tracking.joint.numbers import (
    HANDLE_TILT_ERROR as HANDLE_TILT_ERROR,
)
from friction_estimation.tracking.joint.numbers import (
    HEADING_MATCH as HEADING_MATCH,
)
from friction_estimation.tracking.joint.numbers import (
    HEADING_NEIGHBOURS as HEADING_NEIGHBOURS,
)
from friction_estimation.tracking.joint.numbers import (
    HEADING_VIEW_INTERVAL as HEADING_VIEW_INTERVAL,
)
from friction_estimation.tracking.joint.numbers import (
    HEADING_WAVES as HEADING_WAVES,
)
from friction_estimation.tracking.joint.numbers import (
    HEADINGS_TRIED as HEADINGS_TRIED,
)
from friction_estimation.tracking.joint.numbers import (
    HEIGHT_CROPS as HEIGHT_CROPS,
)
from friction_estimation.tracking.joint.numbers import (
    HEIGHT_PASSES as HEIGHT_PASSES,
)
from friction_estimation.tracking.joint.numbers import HIDDEN_DECELERATION as HIDDEN_DECELERATION
from friction_estimation.tracking.joint.numbers import (
    HIDDEN_ERROR_PX as HIDDEN_ERROR_PX,
)
from friction_estimation.tracking.joint.numbers import (
    HIDDEN_NEIGHBOURS as HIDDEN_NEIGHBOURS,
)
from friction_estimation.tracking.joint.numbers import (
    INDEPENDENT_VIEW as INDEPENDENT_VIEW,
)
from friction_estimation.tracking.joint.numbers import (
    KNOWN_HEADING_SIGMA as KNOWN_HEADING_SIGMA,
)
from friction_estimation.tracking.joint.numbers import (
    KNOWN_LENS_MARGIN_PX as KNOWN_LENS_MARGIN_PX,
)
from friction_estimation.tracking.joint.numbers import (
    LARGER_COORDINATE_SHARE as LARGER_COORDINATE_SHARE,
)
from friction_estimation.tracking.joint.numbers import (
    LEAST_CLEAR as LEAST_CLEAR,
)
from friction_estimation.tracking.joint.numbers import (
    LEAST_NEAR as LEAST_NEAR,
)
from friction_estimation.tracking.joint.numbers import (
    LEAST_SAMPLE as LEAST_SAMPLE,
)
from friction_estimation.tracking.joint.numbers import (
    LOW_HEIGHT as LOW_HEIGHT,
)
from friction_estimation.tracking.joint.numbers import (
    MAX_CONTACT_DELAY as MAX_CONTACT_DELAY,
)
from friction_estimation.tracking.joint.numbers import (
    MAX_CORE_BOX_PX as MAX_CORE_BOX_PX,
)
from friction_estimation.tracking.joint.numbers import (
    MAX_HEADING_GAP as MAX_HEADING_GAP,
)
from friction_estimation.tracking.joint.numbers import (
    MAX_PUSH as MAX_PUSH,
)
from friction_estimation.tracking.joint.numbers import (
    MAX_SHADOW_GROWTH as MAX_SHADOW_GROWTH,
)
from friction_estimation.tracking.joint.numbers import (
    MAX_SIZE_RATIO as MAX_SIZE_RATIO,
)
from friction_estimation.tracking.joint.numbers import (
    MAX_UNEXPLAINED as MAX_UNEXPLAINED,
)
from friction_estimation.tracking.joint.numbers import (
    MAX_UNSEEN_TURN as MAX_UNSEEN_TURN,
)
from friction_estimation.tracking.joint.numbers import (
    MAX_VIEW_COST as MAX_VIEW_COST,
)
from friction_estimation.tracking.joint.numbers import (
    MIN_CHROMA as MIN_CHROMA,
)
from friction_estimation.tracking.joint.numbers import (
    MIN_CONTRAST as MIN_CONTRAST,
)
from friction_estimation.tracking.joint.numbers import (
    MIN_FITS as MIN_FITS,
)
from friction_estimation.tracking.joint.numbers import (
    MIN_HEADING_VIEWS as MIN_HEADING_VIEWS,
)
from friction_estimation.tracking.joint.numbers import (
    MIN_INDEPENDENT_VIEWS as MIN_INDEPENDENT_VIEWS,
)
from friction_estimation.tracking.joint.numbers import (
    MIN_LATER_VIEWS as MIN_LATER_VIEWS,
)
from friction_estimation.tracking.joint.numbers import (
    MIN_LEARNING_LIKENESS as MIN_LEARNING_LIKENESS,
)
from friction_estimation.tracking.joint.numbers import (
    MIN_LOG_HEIGHT_SIGMA as MIN_LOG_HEIGHT_SIGMA,
)
from friction_estimation.tracking.joint.numbers import (
    NOISE_AFTER_BLUR as NOISE_AFTER_BLUR,
)
from friction_estimation.tracking.joint.numbers import (
    NOISY as NOISY,
)
from friction_estimation.tracking.joint.numbers import (
    OPEN_FOCAL_SIGMA as OPEN_FOCAL_SIGMA,
)
from friction_estimation.tracking.joint.numbers import (
    PEOPLE_HEIGHT as PEOPLE_HEIGHT,
)
from friction_estimation.tracking.joint.numbers import (
    PEOPLE_NEAR as PEOPLE_NEAR,
)
from friction_estimation.tracking.joint.numbers import (
    PLAIN_NOISE as PLAIN_NOISE,
)
from friction_estimation.tracking.joint.numbers import (
    REPEATED_WAY as REPEATED_WAY,
)
from friction_estimation.tracking.joint.numbers import (
    SAME_HEIGHT_STEP as SAME_HEIGHT_STEP,
)
from friction_estimation.tracking.joint.numbers import (
    SAME_HUE as SAME_HUE,
)
from friction_estimation.tracking.joint.numbers import (
    SAME_PLACE as SAME_PLACE,
)
from friction_estimation.tracking.joint.numbers import (
    SAMPLE_BYTES as SAMPLE_BYTES,
)
from friction_estimation.tracking.joint.numbers import (
    SAMPLE_FRAMES as SAMPLE_FRAMES,
)
from friction_estimation.tracking.joint.numbers import (
    SMALL_STONE_ERROR_PX as SMALL_STONE_ERROR_PX,
)
from friction_estimation.tracking.joint.numbers import (
    SOLVING_FILMS as SOLVING_FILMS,
)
from friction_estimation.tracking.joint.numbers import (
    SPIN_CHANGE_AT_CONTACT as SPIN_CHANGE_AT_CONTACT,
)
from friction_estimation.tracking.joint.numbers import (
    SPIN_DECAY_POWERS as SPIN_DECAY_POWERS,
)
from friction_estimation.tracking.joint.numbers import (
    SPINS_TRIED as SPINS_TRIED,
)
from friction_estimation.tracking.joint.numbers import (
    STILL_PX as STILL_PX,
)
from friction_estimation.tracking.joint.numbers import (
    UNKNOWN_LENS_MARGIN_PX as UNKNOWN_LENS_MARGIN_PX,
)
from friction_estimation.tracking.joint.numbers import (
    UNLIKELY_HEIGHT as UNLIKELY_HEIGHT,
)
from friction_estimation.tracking.joint.numbers import (
    USUAL_HANDLE as USUAL_HANDLE,
)

# --- frames looked at before the stone is followed ---------------------------------------------


# --- blobs in front of the empty ice ----------------------------------------------------------


# --- which blob is the thrown stone -----------------------------------------------------------

MAX_THROW_SPEED = 5.0
"""No thrown stone is faster [m/s]; the hardest takeouts reach about 4."""
MIN_TRAVEL = 0.5
"""Something that moves less over the whole film is no thrown stone [m]."""
MIN_SIGHTINGS = 4
"""Sampled frames in which a stone must be seen to be one."""
ENOUGH_SIGHTINGS = 12
"""A stone seen in fewer sampled frames is looked for again in frames closer together."""
CLOSE_SAMPLE_STEP = 0.12
"""Time between those frames [s]."""
MISSED_FRAME_COST = 0.15
"""Cost to a path of a frame without a sighting; a perfect sighting is worth 1."""
SOMETHING_BESIDE = 0.12
"""Unexplained share above which people who are near are in the pictures used for learning."""

# --- a stone that people are near ------------------------------------------------------------

LOOK_STEP = 0.2
"""Time between the frames in which that is done [s]."""
BAND = 60.0
"""Width of the range of differences from the ice in one part of a blob [grey levels]."""
MIN_FILL = 0.5
"""Share of its box that such a part fills."""
SLIDE_SECONDS = (0.5, 1.7)
"""Minimum and maximum time that a stone must be alone to be found [s]."""
SLIDE_SIGHTINGS = 4
"""Minimum number of frames in which it must be sighted."""
SLIDE_PACE, SLIDE_ASIDE = 0.15, 0.12
"""Minimum speed then [m/s], and maximum share of it aside."""
SLIDE_JITTER = 0.05
"""Maximum distance of a sighting from the straight line, in addition to a pixel [m]."""
REST_SEEN = 4.0
"""Time before the end of the film in which stones that have come to rest are sought [s]."""
SLIDES_TRIED = 5
"""Maximum number of steadily sliding candidates to test."""
CLEARLY_EXPLAINED = 0.08
"""A look that leaves a smaller share of the pictures unexplained is clearly a stone's."""
MAX_SLIDE_UNEXPLAINED = 0.12
"""One that leaves more is none. Of what slid steadily, or seemed to, stones left 0.01 to 0.11,
heads, coats, legs and brooms 0.25 to 0.5, shoes 0.13 and more."""
MAX_TOUCHED = 0.34
"""A stone that something touches left up to 0.29 at first, and the others 0.36 and more, mostly."""
LONG_SECONDS, LONG_WAY = 6.0, 6.0
"""Minimum time [s] and distance [m] of a slide that may be a stone that no second shows clearly."""
LONG_SLOWING = (0.03, 0.25)
"""Minimum and maximum deceleration over its whole way [m/s²]."""
LONG_UNSEEN = 1.5
"""Longest gap between sightings [s]."""
LONG_SLIDES_SOUGHT = 20
"""Maximum number of steadily sliding candidates that are followed to see how far they go."""
LONG_PICTURES = 12
"""Approximate number of pictures of the whole way, or of half of it, to learn the look from."""
LONG_TOUCHED = 0.4
"""Maximum share of the three clearest of them that it leaves unexplained at first."""
MAX_LONG_UNEXPLAINED = 0.2
"""Maximum share that the corrected look leaves unexplained there. Stones of 5 by 3 px between
sweepers left 0.02 to 0.19, and false positives 0.23 and more: a stone with a broom, or a head."""
LEAST_FOLLOWED = 3.0
"""Minimum distance along the sheet over which it must be followed [m]."""
LOOKS_CORRECTED = 3
"""Maximum number of times that its look is then corrected by its clearest pictures."""
HOPELESS = 1.5
"""Multiple of the allowed unexplained share from which a look is not corrected again."""
CLEAREST = 3
"""Number of the clearest pictures by which it is judged whether it is a stone's."""
LEAST_SEEN = 0.45
"""Share of a stone that must look like it."""
MAX_HIDDEN_SECONDS = 2.5
"""A stone that is hidden for longer is lost [s]."""
MOTION_SECONDS = 2.5
"""Time before now over which its motion is fitted [s]."""
CURVING_SIGMA = 0.015
"""Standard deviation of the sideways acceleration of stones [m/s²]."""
PLACE_SIGMA, PLACE_SIGMA_PX = 0.003, 0.15
"""Error of a place that is measured so, in metres and in pixels."""
PLACE_GATE, PACE_SIGMA = 0.04, 0.05
"""Gate on the prediction error: a distance [m], plus one for each second unseen [m/s]."""
PATH_PARTS, CLEAR_IN_PART = 10, 2
"""Number of parts of the path, and of pictures of each, from which the look is learnt again."""
LED_GATE = 0.1
"""Gate on a frame's measurement around a path that was measured so [m]."""

# --- focal length from the stone, where the paint leaves it open --------------------------------


# --- one camera for many films ------------------------------------------------------------------


# --- stones at rest ---------------------------------------------------------------------------

NEIGHBOURS = 3.0
"""Stones farther from each other than this do not overlap in a picture [m]."""
REST_TOLERANCE = 0.04
"""A stone is where it lay if it is found within this, and a pixel, of it [m]."""
CLEARLY_MOVED = 8.0
"""Standard errors by which two stones lie apart that lay at about the same place in turn."""
END_FRAMES = 3
"""Sampled frames at each end of the film that show what lies there."""
MIN_PRESENCE = 0.6
"""Share of the frames in which a stone at rest must be found; people stand before it in others."""
COLOUR_PICTURES, COLOURS_EVERY = 20, 4
"""Maximum number of frames used to learn the colours of a struck stone, and step between those that
also give a starting guess."""
SHADOW_WIDTH = 0.10
"""Distance beyond its edge to which a stone darkens the ice [m]."""

AROUND_PX = 12
"""Width of the surroundings with which the ice beneath a stone is compared [px]."""
LEAST_AROUND = 30
"""Minimum number of pixels to compare."""
MIRROR_DIFFERENCE = 6.0
"""Maximum mean difference of the sheet's other side there, beyond its brightness [grey levels]."""

# --- where to look for a stone in the next frame ------------------------------------------------

FLOW_LEVELS = 3
"""Halvings of the picture in pyramidal optical flow: motions of up to some 40 px a frame."""
FLOW_WINDOW_PX = 9
"""Width of the window that optical flow compares."""
FLOW_RETURN_PX = 0.5
"""A point must come back to within this of its start when the flow is reversed."""
FLOW_MARGIN_PX = 32
"""Width of the surroundings of a stone in which flow looks."""
MIN_FLOW_POINTS = 6
"""Minimum number of points; with fewer, new ones are sought."""
FLOW_RENEWAL = 8
"""Number of frames after which new points are looked for in any case."""
MAX_HEADING_MISS = 0.7
"""A heading further from its prediction is a misread handle [rad]."""
HEADING_SIGMA = 0.15
"""Standard error of a heading that is measured in one frame [rad]."""
SPIN_DRIFT = 0.5
"""Drift of the spin within a second [rad/s/√s]."""
MIN_RETRY_DISTANCE = 0.02
"""A second start for the fit must be at least this far from the first [m]."""

# --- stones that hit each other ---------------------------------------------------------------

RECENT_FITS = 8
"""Number of latest measurements that extrapolate a stone's path."""
SEEN_AGAIN_AFTER = 1.0
"""A stone that was not seen for longer may be elsewhere than expected [s]."""
SEEN_AGAIN_SHARE = 0.6
"""Then at least this share of it must be seen: half of it fits beside a person's foot as well."""
SLOWINGS = (0.06, 0.16)
"""Least and greatest deceleration that its way before may tell [m/s²]."""
SLOWING_SECONDS = 4.0
"""Time before the last sightings at which its speed gives that deceleration [s]."""
SLID_ON_DOUBT = 0.3
"""It may have slid farther, or less far, by this share."""
LAST_SIGHTINGS = 2.5
"""Time before the last sighting over which its final speed is fitted [s]."""
MAY_HIT_WITHIN = 3.0
"""Maximum distance from a stone that leaves its place to the one that set it in motion [m]."""
WAKES_WITHIN = 1.0
"""Distance of a moving stone from which on a stone at rest is watched [m]."""
GIVEN_ON = 0.93
"""Fraction of the approach speed transferred in a collision."""
STANDS = 0.05
"""A stone that is slower hits no other [m/s]."""
MIN_SEPARATION_RADII = 1.7
"""Measurements of two stones nearer than this many radii are one stone measured twice."""
MAX_HIT_GAP = 0.4
"""Largest gap between two stones one of which has just hit the other [m]."""
CONTACT_FITS = 8
"""Number of measurements after a hit whose straight line is followed back to the contact."""
CLEAR_OF_CONTACT = 0.03
"""Distance between the rims of stones that have surely not touched yet [m]."""


# --- heading ----------------------------------------------------------------------------------

LATER_VIEW_INTERVAL = 0.2
"""The same after a contact, where there is less time to see how a stone turns [s]."""

# --- the smoothed path and its uncertainty ----------------------------------------------------

JERK_DENSITIES = (0.003, 0.01, 0.03, 0.1, 0.3, 1.0, 3.0)
"""Square roots of the jerk's spectral density among which a film chooses [m/s³/√Hz]; 0.003 is that
of a stone left alone."""
OUTLIER_SIGMAS = 4.0
"""Measurements this many standard errors from the fit to all others are dropped."""
SMOOTHING_PASSES = 4
"""Number of times that jerk, noise and outliers are found in turn."""


# --- what video compression leaves out --------------------------------------------------------


# --- which stone it is --------------------------------------------------------------------------

# --- motion of a stone that is followed by its look ----------------------------------------------

SLOWING, SLOWING_SIGMA = 0.09, 0.03
"""Mean and standard deviation of the deceleration of stones [m/s²]."""
SCATTER_TOLD = 1.0
"""Scatter that lasts longer is reported [s]."""
