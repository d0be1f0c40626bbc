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
"""No thrown stone is faster [m/s]; the hardest take-outs reach about 4."""
MIN_TRAVEL = 0.5
"""Something that moves less over the whole film is no thrown stone [m]."""
MIN_SIGHTINGS = 4
"""Sampled frames in which a stone must be seen to be one."""
ENOUGH_SIGHTINGS = 12
"""A stone seen in fewer sampled frames is looked for again in frames closer together."""
CLOSE_SAMPLE_STEP = 0.12
"""Time between those frames [s]."""
MISSED_FRAME_COST = 0.15
"""What a frame without a sighting costs a path; a perfect sighting is worth 1."""
SOMETHING_BESIDE = 0.12
"""Where they leave more and somebody is near, these are in the pictures that it is learnt from."""

# --- a stone that people are near ------------------------------------------------------------

LOOK_STEP = 0.2
"""Time between the frames in which that is done [s]."""
BAND = 60.0
"""A part of a blob is what differs from the ice by so much more or less [grey levels]."""
MIN_FILL = 0.5
"""Share of its box that such a part fills."""
SLIDE_SECONDS = (0.5, 1.7)
"""For so long a stone must be alone to be found [s]."""
SLIDE_SIGHTINGS = 4
"""In as many frames it must be sighted."""
SLIDE_PACE, SLIDE_ASIDE = 0.15, 0.12
"""It must go so fast then [m/s], and aside by no larger share of that."""
SLIDE_JITTER = 0.05
"""So far from the straight line a sighting may be, and a pixel [m]."""
REST_SEEN = 4.0
"""What has come to rest is looked for in the last frames, for so long [s]."""
SLIDES_TRIED = 5
"""As many things that slide steadily are compared with stones."""
CLEARLY_EXPLAINED = 0.08
"""A look that leaves a smaller share of the pictures unexplained is clearly a stone's."""
MAX_SLIDE_UNEXPLAINED = 0.12
"""One that leaves more is none. Of what slid steadily, or seemed to, stones left 0.01 to 0.11,
heads, coats, legs and brooms 0.25 to 0.5, shoes 0.13 and more."""
MAX_TOUCHED = 0.34
"""A stone that something touches left up to 0.29 at first, and the others 0.36 and more, mostly."""
LONG_SECONDS, LONG_WAY = 6.0, 6.0
"""What slides for so long [s] and so far [m] may be a stone that no second shows clearly."""
LONG_SLOWING = (0.03, 0.25)
"""It slows down so much all the way [m/s²]."""
LONG_UNSEEN = 1.5
"""It may be unseen for so long [s]."""
LONG_SLIDES_SOUGHT = 20
"""As many things that slide steadily are followed to see how far they go."""
LONG_PICTURES = 12
"""The look is learnt from about so many pictures of the whole way, or of a half of it."""
LONG_TOUCHED = 0.4
"""It may leave so much of the three clearest of them unexplained at first."""
MAX_LONG_UNEXPLAINED = 0.2
"""The corrected look may leave so much unexplained there. Stones of 5 by 3 px between sweepers left
0.02 to 0.19, and 0.23 and more what was followed by mistake: a stone with a broom, or a head."""
LEAST_FOLLOWED = 3.0
"""It must be followed so far along the sheet [m]."""
LOOKS_CORRECTED = 3
"""So often its look is then corrected by its clearest pictures."""
HOPELESS = 1.5
"""A look that leaves so many times the allowed share unexplained is not corrected again."""
CLEAREST = 3
"""By so many of them it is judged whether it is a stone's."""
LEAST_SEEN = 0.45
"""Share of a stone that must look like it."""
MAX_HIDDEN_SECONDS = 2.5
"""A stone that is hidden for longer is lost [s]."""
MOTION_SECONDS = 2.5
"""Its motion is taken from places so far back [s]."""
CURVING_SIGMA = 0.015
"""How fast stones are pushed aside, about [m/s²]."""
PLACE_SIGMA, PLACE_SIGMA_PX = 0.003, 0.15
"""Error of a place that is measured so, in metres and in pixels."""
PLACE_GATE, PACE_SIGMA = 0.04, 0.05
"""A place may be so far from where it should be [m], and so much for each second unseen [m/s]."""
PATH_PARTS, CLEAR_IN_PART = 10, 2
"""The look is learnt anew from so many pictures of each of so many parts of the path."""
LED_GATE = 0.1
"""Where the path was measured so, a frame's measurement may be so far from it [m]."""

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
"""The colours of a stone that was hit are learnt from so many pictures of its way. What every so
manyth of them shows alone is tried."""
SHADOW_WIDTH = 0.10
"""Distance beyond its edge to which a stone darkens the ice [m]."""

AROUND_PX = 12
"""The ice beneath a stone is compared with what is around it so far out [px]."""
LEAST_AROUND = 30
"""In so many pixels at least."""
MIRROR_DIFFERENCE = 6.0
"""The sheet's other side may differ there by so much, but for its brightness [grey levels]."""

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
"""Where fewer points are left, new ones are looked for."""
FLOW_RENEWAL = 8
"""Number of frames after which new points are looked for in any case."""
MAX_HEADING_MISS = 0.7
"""A heading further from its prediction is a misread handle [rad]."""
HEADING_SIGMA = 0.15
"""Standard error of a heading that is measured in one frame [rad]."""
SPIN_DRIFT = 0.5
"""How far the spin drifts within a second [rad/s/√s]."""
MIN_RETRY_DISTANCE = 0.02
"""A second start for the fit must be at least this far from the first [m]."""

# --- stones that hit each other ---------------------------------------------------------------

RECENT_FITS = 8
"""Number of latest measurements that extrapolate a stone's path."""
SEEN_AGAIN_AFTER = 1.0
"""A stone that was not seen for longer may be elsewhere than expected [s]."""
SEEN_AGAIN_SHARE = 0.6
"""Then at least this share of it must be seen: half of it fits beside somebody's foot as well."""
SLOWINGS = (0.06, 0.16)
"""Least and greatest deceleration that its way before may tell [m/s²]."""
SLOWING_SECONDS = 4.0
"""Its speed so long before the last sightings tells that [s]."""
SLID_ON_DOUBT = 0.3
"""It may have slid farther, or less far, by this share."""
LAST_SIGHTINGS = 2.5
"""Sightings of so long before the last one tell how fast it was then [s]."""
MAY_HIT_WITHIN = 3.0
"""When a stone leaves its place, what hit it, or set in motion what hit it, is so near [m]."""
WAKES_WITHIN = 1.0
"""A stone at rest is looked at from when a moving one is so near [m]."""
GIVEN_ON = 0.93
"""Share of its speed towards another stone that a stone gives on to it."""
STANDS = 0.05
"""A stone that is slower hits no other [m/s]."""
MIN_SEPARATION_RADII = 1.7
"""Measurements of two stones nearer than this many radii are one stone measured twice."""
MAX_HIT_GAP = 0.4
"""Largest gap between two stones one of which has just hit the other [m]."""
CONTACT_FITS = 8
"""Number of measurements after a hit whose straight line is followed back to the contact."""
CLEAR_OF_CONTACT = 0.03
"""Stones whose rims are so far apart have surely not touched yet [m]."""


# --- heading ----------------------------------------------------------------------------------

LATER_VIEW_INTERVAL = 0.2
"""The same after a contact, where there is less time to see how a stone turns [s]."""

# --- the smoothed path and its uncertainty ----------------------------------------------------

JERK_DENSITIES = (0.003, 0.01, 0.03, 0.1, 0.3, 1.0, 3.0)
"""Square roots of the jerk's spectral density among which a film chooses [m/s³/√Hz]; 0.003 is that
of a stone left alone."""
OUTLIER_SIGMAS = 4.0
"""Measurements this many standard errors from what all others say are left out."""
SMOOTHING_PASSES = 4
"""How often jerk, noise and outliers are found in turn."""


# --- what video compression leaves out --------------------------------------------------------


# --- which stone it is --------------------------------------------------------------------------

# --- motion of a stone that is followed by its look ----------------------------------------------

SLOWING, SLOWING_SIGMA = 0.09, 0.03
"""How fast stones slow down, and how much that differs [m/s²]."""
SCATTER_TOLD = 1.0
"""Scatter that lasts longer is reported [s]."""
