"""Tuned numbers of tracking: physics, priors, settings of searches, and thresholds."""

from __future__ import annotations

import numpy as np

# --- physics --------------------------------------------------------------------------------------

DECELERATION, DECELERATION_SIGMA = 0.09, 0.03
"""Mean and standard deviation of a sliding stone's deceleration [m/s²]."""
ICE_SIGMA = 0.09
"""Standard deviation of the deceleration on unknown ice [m/s²]."""
CURL_SIGMA = 0.015
"""Standard deviation of its sideways acceleration [m/s²]."""
DECELERATION_MEMORY = 5.0
"""Half of the time in which its deceleration changes by about its standard deviation [s]."""
SPIN_CHANGE = 0.1
"""Standard deviation of the change of its spin [rad/s²]."""
CARRIED_ACCELERATION = 1.5
"""Standard deviation of the acceleration of a stone that someone holds [m/s²]."""
JUMP_SIGMA = 1.0
"""Standard deviation of each component of the change of velocity in a collision [m/s]."""
FASTEST = 5.0
"""Maximum speed of a stone [m/s]."""
COLLISION_TRANSFER, COLLISION_SIGMA = 0.93, 0.3
"""Fraction of the approach speed transferred in a collision, and standard error of either velocity
after it as a fraction of the speed."""
ICE = 0.05, 0.4
"""Minimum and maximum deceleration of stones on any ice [m/s²]."""
PEOPLE_HEIGHT = 2.0
"""Height up to which the surroundings of the sheet are kept, to include people completely [m]."""
HANDLE_RISE = 0.06
"""Approximate height of a handle above the body [m]."""
SPIN_CHANGE_AT_CONTACT = 2.5
"""Standard deviation of the change of spin by the friction of the rims in a contact [rad/s]."""
SPIN_DECAY_POWERS = (0.0, 0.15, 0.3, 0.5, 0.8)
"""Range of the power of the speed with which the spin falls."""
HEADING_WANDER = 0.25
"""Random drift of the heading from a steady law [rad/√s]."""

# --- priors, and measured errors ------------------------------------------------------------------

BIRTH = -6.0
"""Log probability that a stone enters the film at a given detection."""
LIES = -3.0
"""Log probability that a detection in the first frames is a stone at rest."""
RELEASED, STOPS, HIT = -2.0, -2.0, -7.0
"""Log probabilities that a stone is released, stops or is hit between two detections."""
STILL_THERE = 0.1
"""Increase of a stone's log odds by each frame in which it still rests."""
MISSED, HIDDEN = -1.2, -5.0
"""Log probability that a stone in view is not detected in a frame, and minimum for a gap."""
DETECTION_PX, DETECTION_M = 0.7, 0.03
"""Standard errors of a detection: pixels in the picture, and on the ice [m]."""
STUDENT_FREEDOM = 4.0
"""Degrees of freedom of the measurements' Student distribution."""
HEADING_DRIFT = 0.1
"""Standard error of the heading curve [rad]."""
REST_SPEED_SIGMA = 0.05
"""Error of the position of a stone that seems to have stopped, per time [m/s]."""
WALKING_SIGMA = 0.02
"""Standard deviation of the mean acceleration of walking people [m/s²]."""
UNUSUAL, HIT_RANGE, HALT_RANGE = 0.1, 1.0, 0.4
"""Shares of stones in contacts, and of people who change their speed; ranges of their mean
deceleration [m/s²]."""
WALKING_SPEED, WALKING_SPEED_SIGMA = 1.3, 0.35
"""Mean and standard deviation of the speed of walking people [m/s]."""
NOISE_AFTER_BLUR = 0.45
"""Share of the noise after a blur over three pixels; compressed grain is not white."""
BLOB_RIM_PX = 1.5
"""Width of the blurred rim of a blob that the threshold includes [px]."""
PLAIN_NOISE = 12.0
"""Standard error of a pixel in the comparison of pictures with stones; noisier pictures are blurred
before the search for blobs [grey levels]."""
GRANITE_SPREAD = (15.0, 4.0, 4.0)
"""Difference of another stone's granite from that of the thrown one, in brightness and two colour
differences [grey levels]: other granite, or other light at its place."""
USUAL_HANDLE, HANDLE_SPREAD = (110.0, 0.0, 0.0), (60.0, 60.0, 60.0)
"""Mean and standard deviation of the colours of handles [grey levels]."""
MIN_LOG_HEIGHT_SIGMA = 0.05
"""Minimum standard error of the logarithm of the height: it depends on the height of a stone's
widest place, which is known to 3 mm of 57."""
KNOWN_HEADING_SIGMA = 0.15
"""Standard error of a heading that is known at the beginning, as after a contact [rad]."""
REPEATED_WAY = 0.05
"""Minimum movement of a stone between pictures with independent model errors [m]."""
INDEPENDENT_VIEW = np.pi / 4
"""Minimum turn of a handle between pictures with independent model errors [rad]."""
MIN_INDEPENDENT_VIEWS = 3
"""Minimum assumed number of independent views."""
SMALL_STONE_ERROR_PX = 0.075
"""`camera.tuning.EDGE_ERROR_PX` for a stone with a radius of one pixel. It falls with the radius,
because the fewer pixels a stone has, the more of them are mixed with the ice."""
HIDDEN_ERROR_PX = 0.1
"""Error of a position in the picture due to partial occlusion, per root of the occluded share [px]:
in a single frame, and common to its neighbours. In addition to the median error of each film's free
rows, it was 0.05 px for a fifth and 0.09 px for a half."""
LARGER_COORDINATE_SHARE = 0.7
"""Minimum share of the larger coordinate's variance in the common `sigma_xy`, so that 95 % of all
coordinates are in their intervals even if the errors differ."""
HANDLE_ERROR_PX = 0.35
"""Systematic error of a handle's picture across its length [px], constant at rest. It was 0.34 px
(root mean square) for 16 stones in films of 405 to 720 lines."""
HANDLE_TILT_ERROR = 0.008
"""Error of the height of one end of a handle [m]. In a low view that looks like a rotation of the
handle."""
DROPPED_CHANGE = 6.0
"""Approximate maximum change that a codec drops when it repeats pixels [grey levels]. In fourteen
films, compressed in six ways, the lag of stones corresponded to 0 to 15 at their rim, with a median
of 6."""
BLOCK_ERROR = 5.0
"""Factor on the error of a stone with repeated pixels, whose errors are common, over that of
independent errors. It was 4 to 6 in films compressed at quality 23 to 33, at any speed, on any
paint, mostly along the line of sight."""
MISFIT_ERROR = 2.0
"""Standard error of positions off the path, as a share of their maximum distance from it."""

# --- numerics: sizes of samples, steps, and settings of searches ----------------------------------

LONGEST_GAP, LONGEST_GAP_FRAMES = 4.0, 10
"""Longest gap between two detections of one path [s], and in sampled frames."""
CONTACT_FITS = 8
"""Number of measurements of the extrapolation."""
DENSE_STEP, DENSE_BEFORE, DENSE_AFTER = 0.12, 1.0, 4.0
"""Time between frames around a contact, and their range before and after it [s]."""
END_FRAMES = 3
"""Number of last frames; a stone seen at rest in one of them stays."""
LINK_FITS = 5
"""Number of detections that guide a path to a contact."""
WINDOW = 45.0
"""Duration of film over which the ice is constant, and maximum one of a film that is tracked whole,
as one throw [s]."""
AFTER_THROW = 4.0
"""Duration of film that is tracked after the last motion of a stone [s]."""
HELD = 3.0
"""Maximum lead of a throw's film before the first sliding detection [s]."""
LONGEST_SLIDE = 30.0
"""Maximum duration of a slide [s]."""
ASKED_EVERY = 4
"""Number of looks per use of the network."""
JUDGED_ROWS = 60
"""Number of rows for the test of a track."""
LOOK_STEP = 0.4
"""Time between two looks at a long film with frequent key frames [s]."""
MAX_KEY_GAP = 1.05
"""Maximum gap between key frames without decoding of others [s]."""
FINE_LINES = 800
"""Maximum number of lines of a picture in a quick look; larger ones are halved."""
SQUARE_PX = 2
"""Side of the squares over which brightness is averaged [px]."""
LOOK_INTERVAL = 0.1
"""Minimum time between two looks at a stream [s]."""
LEVEL_STEP, LEVEL_SQUARES = 7, 2000
"""Distance between the squares for the common change and the noise, and minimum number of
squares."""
COMPARED_AFTER = 2.0
"""Time between two compared looks [s]: far from the camera, a stone on its last metre moves by a
pixel."""
SAMPLE_FRAMES = 40
"""Number of frames, spread over the film, for the first search."""
SAMPLE_BYTES = 375_000_000
"""Maximum memory of these frames: fifteen of a 4K film, forty of one of 1080 rows."""
LEAST_SAMPLE = 7
"""Minimum number of these frames, for a film of any size."""
BACKGROUND_FRAMES = 15
"""Number of these frames whose median is the empty ice."""
KNOWN_LENS_MARGIN_PX = 12
"""Margin around the sheet for a known lens [px]."""
UNKNOWN_LENS_MARGIN_PX = 48
"""Margin around the sheet for an unknown lens, with which the sheet may be displaced [px]."""
MAX_CORE_BOX_PX = 40_000
"""Maximum area of the box of a blob whose core is computed."""
LEAST_CLEAR = 8
"""Minimum number of pictures for an estimate; if fewer are clear, the clearest are added."""
COLOUR_ROUNDS = 3
"""Number of rounds of the fit of a resting stone's colours, each with fewer outliers."""
COARSE_HEIGHTS = 7
"""Number of heights tried first, evenly spaced in their inverse."""
FINE_HEIGHT_STEPS = (-0.5, -0.25, 0.25, 0.5)
"""Heights tried next, relative to the best, in coarse steps."""
SAME_HEIGHT_STEP = 0.2
"""Minimum difference of heights, in coarse steps."""
HEIGHT_PASSES = 3
"""Maximum number of rounds with the appearances of better heights, and of rounds with finer
steps."""
UNLIKELY_HEIGHT = 20.0
"""Maximum excess cost of heights that are tried again [squared standard errors]."""
LOW_HEIGHT = 4.0
"""Height of the camera whose pixels of the stone are used in the comparison [m]."""
HEIGHT_CROPS = 12
"""Approximate number of pictures of stones in comparisons of heights."""
SOLVING_FILMS = 3
"""Number of films from which a camera is solved."""
HEADING_VIEW_INTERVAL = 0.4
"""Time between the pictures that are compared at all headings [s]."""
SPINS_TRIED = np.linspace(-6.0, 6.0, 481)
"""Tried initial spins [rad/s]."""
HEADING_WAVES = 6
"""Maximum number of waves per revolution for the picture of a two-ended handle."""
HEADING_NEIGHBOURS = 1.5
"""Time within which pictures test the heading together [s]."""
HIDDEN_NEIGHBOURS = 0.3
"""Range of neighbouring frames, before and after [s]."""
AGE_MARGIN_PX = 2
"""Width of the ring around a stone whose pixels are monitored [px]."""
NEIGHBOURS = 0.5
"""Range of neighbouring frames, before and after, for ages of pixels and misfits [s]."""

# --- thresholds -----------------------------------------------------------------------------------

LEAST_SPEED = 0.05
"""Minimum speed of a moving stone in the association [m/s]."""
SURE = 8.0
"""Minimum log odds of a stone's path."""
GATE = 4.0
"""Maximum innovation of a fit, and distance of two detections at one place; minimum movement of a
stone that shows its direction [standard errors]."""
LOST = 0.5
"""Maximum standard error of the predicted position of a stone that is searched for [m]."""
CONTACT_WITHIN = 1.5
"""Maximum time of extrapolation to a contact [s]."""
SAME_PLACE = 0.2
"""Maximum distance between positions of the same stone, and addition to the gate of a fit around a
contact [m]; twice that for a coarse path of a stone that may have touched it."""
LEAST_VISIBLE = 0.6
"""Minimum visible share of a resting stone, and of one that shows its appearance among people."""
LINK_GATE = 20.0
"""Maximum squared distance of a detection from its stone [squared standard errors]."""
FROM_REST = 0.7
"""Maximum initial speed of a stone that starts from rest, as a share of its mean speed."""
APART = 0.5
"""Minimum time between two throws [s]."""
RETURNS_FROM = 0.8
"""Maximum distance between the start of a stone that is pushed back and the rest of the one before
it [m]."""
LEAST_THROW = 3.0
"""Minimum path of a throw in a recording, and of a stone that shows its appearance alone [m]."""
RESTED = 2.0
"""Minimum time at rest of a stone that has come to rest, and maximum time between a resting stone
and a start at its place for the same stone [s]."""
PUSHED = 0.3
"""Minimum gain of speed of a stone that is moved [m/s]."""
STANDING = 0.12
"""Maximum speed over three frames of a stone at rest [m/s]."""
MOVING_STONE_SHARE = 0.2
"""Minimum changed share of a stone's picture."""
MIN_CONTRAST = 14.0
"""Minimum difference of a moving object from the ice, of 255 grey levels."""
NOISE_TIMES = 5.0
"""Minimum multiple of what is usual in a film: of the camera's noise for a moving object, and of a
measurement's distance from the path through others for an outlier."""
CORE_CONTRAST_SHARE = 0.5
"""Minimum contrast of a blob's solid core, as a share of its maximum; shadows and reflections have
less.
"""
MAX_SHADOW_GROWTH = 2.5
"""Maximum enlargement of a stone's blob by shadow and reflection."""
MAX_SIZE_RATIO = 2.2
"""Maximum ratio of the sizes of a blob and a stone in its place, either way."""
MIN_LEARNING_LIKENESS = 0.3
"""Minimum similarity of sightings for the estimation of the appearance."""
MAX_UNEXPLAINED = 0.2
"""Maximum unexplained share of the difference from the empty ice. Stones have 0.04 to 0.1; people
have 0.3 to 0.5."""
PEOPLE_NEAR = 1.5
"""Maximum distance of a person who may be mistaken for a stone, or hide it [m]."""
CLEAR_PICTURE = 0.1
"""Maximum unexplained share of a clear picture."""
NEARLY_ALL = 0.95
"""Share that counts as all: of frames with a sighting for a stone that is alone all the way (films
with people have 1.0 if it is, and at most 0.66 with sweepers), and of the path of a stone that
moves."""
HEADING_MATCH = 0.7
"""Maximum deviation of a heading that agrees with the joint one, and maximum turn since its pixels
changed [rad]."""
LEAST_NEAR = 0.7
"""Minimum share of neighbouring frames near the joint heading; with fewer, they have strayed."""
CLEAR_HEADING = 3.0
"""Minimum advantage of a heading over its reverse, and over any other [standard errors]."""
MIN_FITS = 5
"""Minimum number of measurements for a throw, a track or a heading."""
SAME_HUE = np.radians(35.0)
"""Maximum difference of the hues of one handle [rad]."""
LONG = 1.0
"""Maximum time without measurements, or off the path, that is bridged without a remark [s]."""
