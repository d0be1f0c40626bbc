"""The tuned numbers of tracking, in the order in which a film meets them.

Unless a line says otherwise, they were set on films that `friction_estimation.synthetic` renders:
cameras behind, beside and above the sheet, 540 to 1080 lines, with people and without.
"""

from __future__ import annotations

import numpy as np

# --- frames looked at before the stone is followed ---------------------------------------------

SAMPLE_FRAMES = 40
"""Number of frames, spread over the film, in which the stone is first looked for."""
SAMPLE_BYTES = 375_000_000
"""Memory of these frames: fifteen of a 4K film, forty of one of 1080 rows."""
LEAST_SAMPLE = 7
"""As many are looked at of a film of any size."""
BACKGROUND_FRAMES = 15
"""Number of these frames whose median is the empty ice."""
KNOWN_LENS_MARGIN_PX = 12
"""Pixels kept around the sheet where the lens is known."""
UNKNOWN_LENS_MARGIN_PX = 48
"""Pixels kept around the sheet where the lens is unknown, so that the sheet may be misplaced."""
PEOPLE_HEIGHT = 2.0
"""Height up to which the surroundings of the sheet are kept, so that people are seen whole [m]."""

# --- blobs in front of the empty ice ----------------------------------------------------------

MIN_CONTRAST = 14.0
"""Least difference from the empty ice that counts as a blob, of 255 grey levels."""
NOISY = 12.0
"""Pictures with more noise than this are blurred before blobs are looked for [grey levels]."""
NOISE_AFTER_BLUR = 0.45
"""Share of the noise that a blur over three pixels leaves; compressed grain is not white."""
CORE_CONTRAST_SHARE = 0.5
"""Share of a blob's strongest contrast that its solid core has; shadows and reflections have less.
"""
MAX_CORE_BOX_PX = 40_000
"""Area of a blob's box above which it is no stone, and its core is not looked for."""

# --- which blob is the thrown stone -----------------------------------------------------------

MAX_THROW_SPEED = 5.0
"""No thrown stone is faster [m/s]; the hardest take-outs reach about 4."""
MAX_PUSH = 3.0
"""Nobody sets a stone going faster than this [m/s²]; what seems to has taken its place."""
MIN_TRAVEL = 0.5
"""Something that moves less over the whole film is no thrown stone [m]."""
MIN_SIGHTINGS = 4
"""Sampled frames in which a stone must be seen to be one."""
ENOUGH_SIGHTINGS = 12
"""A stone seen in fewer sampled frames is looked for again in frames closer together."""
CLOSE_SAMPLE_STEP = 0.12
"""Time between those frames [s]."""
HANDLE_RISE = 0.06
"""Rough height of a handle above the body [m]."""
MAX_SHADOW_GROWTH = 2.5
"""A stone's shadow and reflection make its blob at most this many times as wide or high."""
MAX_SIZE_RATIO = 2.2
"""Factor by which a blob may be larger or smaller than a stone in its place would look."""
BLOB_RIM_PX = 1.5
"""What the threshold takes in of the blurred rim of a blob."""
MISSED_FRAME_COST = 0.15
"""What a frame without a sighting costs a path; a perfect sighting is worth 1."""
MIN_LEARNING_LIKENESS = 0.3
"""The appearance of the stone is learnt from sightings at least this much like a stone."""
MAX_UNEXPLAINED = 0.2
"""Share of the difference from the empty ice that the learnt appearance may leave unexplained.
Stones leave 0.04 to 0.1; people who are taken for stones leave 0.3 to 0.5."""
SOMETHING_BESIDE = 0.12
"""Where they leave more and somebody is near, these are in the pictures that it is learnt from."""

# --- a stone that people are near ------------------------------------------------------------

PEOPLE_NEAR = 1.5
"""Somebody within this of a stone may pass for it, or hide it [m]."""
FRAMES_WITH_PEOPLE = 3
"""Where it is so in as many sampled frames, the stone is followed by its look."""
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
PLAIN_NOISE = 12.0
"""Differences of so many grey levels count as one when it is judged what looks like a stone."""
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
SLOWING, SLOWING_SIGMA = 0.09, 0.03
"""How fast stones slow down, and how much that differs [m/s²]."""
CURVING_SIGMA = 0.015
"""How fast stones are pushed aside, about [m/s²]."""
PLACE_SIGMA, PLACE_SIGMA_PX = 0.003, 0.15
"""Error of a place that is measured so, in metres and in pixels."""
PLACE_GATE, PACE_SIGMA = 0.04, 0.05
"""A place may be so far from where it should be [m], and so much for each second unseen [m/s]."""
PATH_PARTS, CLEAR_IN_PART = 10, 2
"""The look is learnt anew from so many pictures of each of so many parts of the path."""
CLEAR_PICTURE, LEAST_CLEAR = 0.1, 8
"""Of them those of which less is unexplained; where these are fewer, so many of the whole path."""
LED_GATE = 0.1
"""Where the path was measured so, a frame's measurement may be so far from it [m]."""

# --- focal length from the stone, where the paint leaves it open --------------------------------

OPEN_FOCAL_SIGMA = 0.02
"""Standard error of the log focal length above which the stone's picture is used."""
CAMERA_HEIGHTS = (2.5, 25.0)
"""Heights between which cameras above a rink hang [m]."""
COARSE_HEIGHTS = 7
"""Number of heights tried first, evenly spaced in their inverse."""
FINE_HEIGHT_STEPS = (-0.5, -0.25, 0.25, 0.5)
"""Heights tried next, as parts of a coarse step away from the best."""
SAME_HEIGHT_STEP = 0.2
"""Heights nearer to each other than this part of a coarse step count as one."""
HEIGHT_PASSES = 3
"""How often heights are tried again with the looks of better ones, at most, and how often finer
ones are tried beside the best."""
UNLIKELY_HEIGHT = 20.0
"""Heights that cost so much more than the best are not tried again [squared standard errors]."""
MIN_LOG_HEIGHT_SIGMA = 0.05
"""The logarithm of the height is never claimed to be known better: it follows how high a stone's
widest place is, which is known to 3 mm of 57."""
LOW_HEIGHT = 4.0
"""Heights are compared on the pixels in which a camera at this height shows the stone [m]."""
HEIGHT_CROPS = 12
"""About so many pictures of stones are used to compare heights."""

# --- one camera for many films ------------------------------------------------------------------

STILL_PX = 0.5
"""A camera that has moved by less since it was solved counts as standing still [px]."""
SOLVING_FILMS = 3
"""Films from which a camera is solved."""

# --- stones at rest ---------------------------------------------------------------------------

SAME_PLACE = 0.2
"""Candidates nearer to each other than this are one stone [m]."""
AGREEING_SHARE = 0.95
"""Paths are those of one stone where so many places of one are the other's. Of films with people,
those whose stone is always alone in the picture have 1.0, and those with sweepers 0.66 at most. A
stone that is sighted in so many of the frames in which it should be is alone all the way."""
NEIGHBOURS = 3.0
"""Stones farther from each other than this do not overlap in a picture [m]."""
HEADINGS_TRIED = 24
"""Headings at which the handle of a stone at rest is looked for."""
REST_TOLERANCE = 0.04
"""A stone is where it lay if it is found within this, and a pixel, of it [m]."""
CLEARLY_MOVED = 8.0
"""Standard errors by which two stones lie apart that lay at about the same place in turn."""
END_FRAMES = 3
"""Sampled frames at each end of the film that show what lies there."""
MIN_PRESENCE = 0.6
"""Share of the frames in which a stone at rest must be found; people stand before it in others."""
CLEAR_FRONT = 12.0
"""Squared standard errors by which every other heading of a handle must fit worse."""
COLOUR_ROUNDS = 3
"""Rounds in which the colours of a stone at rest are found, each with fewer strange pixels."""
COLOUR_PICTURES, COLOURS_EVERY = 20, 4
"""The colours of a stone that was hit are learnt from so many pictures of its way. What every so
manyth of them shows alone is tried."""
GRANITE_SPREAD = (15.0, 4.0, 4.0)
"""How much the granite of another stone differs from that of the thrown one, in brightness and two
colour differences [grey levels]: other granite, or other light where it lies."""
USUAL_HANDLE, HANDLE_SPREAD = (110.0, 0.0, 0.0), (60.0, 60.0, 60.0)
"""What colours handles have, and how much they differ [grey levels]."""
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
HIDDEN_DECELERATION = 0.12
"""Deceleration of a stone while it is hidden, if it is not known how it slowed before [m/s²]."""
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
MAX_CONTACT_DELAY = 0.4
"""A contact lies at most this long before a stone is seen to have left its place [s]."""

SUDDEN_LOSS, SURE_LOSS = 0.35, 6.0
"""A stone that loses so much speed at once [m/s], by so many standard errors, hit something..."""
SUDDEN_LOSS_PX, LOST_FOR = 1.0, 1.0
"""... if it is so many pixels from where it would be, so long after it [s]."""
STOPS_WITHIN, MOST_SLOWING, SURELY_SLOWS = 1.2, 0.2, 3.0
"""What slows down by more than the second of these [m/s²] from so many seconds to so many after, by
so many standard errors, is no stone that slides on..."""
LEFT_PX = 1.5
"""... if a stone would be so many pixels ahead. Stones beside brooms were up to 0.9."""
BESIDE_SECONDS, LEAST_BESIDE = 0.4, 4
"""Its speed before and after is that of so long a time [s], with so many measurements at least."""
OUT_OF_HAND = 10.0
"""From so far on along the sheet no hand is at it [m]."""

# --- heading ----------------------------------------------------------------------------------

HEADING_VIEW_INTERVAL = 0.4
"""Time between the pictures that are compared with all headings [s]."""
LATER_VIEW_INTERVAL = 0.2
"""The same after a contact, where there is less time to see how a stone turns [s]."""
MIN_HEADING_VIEWS = 5
"""Least number of such pictures that show a heading."""
MIN_LATER_VIEWS = 3
"""The same where the heading is known at the beginning, as after a contact."""
KNOWN_HEADING_SIGMA = 0.15
"""Standard error of that heading [rad]."""
SPIN_CHANGE_AT_CONTACT = 2.5
"""Standard deviation of what the rims' friction adds to the spin of stones that touch [rad/s]."""
REPEATED_WAY = 0.05
"""Pictures of a stone that has moved by less count as one [m]."""
SPINS_TRIED = np.linspace(-6.0, 6.0, 481)
"""Spins at the beginning of the track that are tried [rad/s]."""
SPIN_DECAY_POWERS = (0.0, 0.15, 0.3, 0.5, 0.8)
"""Powers of the speed with which the spin may fall; real stones lie in between."""
HEADING_WAVES = 6
"""Number of waves per revolution that describe the picture of a two-ended handle."""
MAX_VIEW_COST = 25.0
"""The most that a single picture may count against a heading: it may show a sweeper's foot."""
HEADING_DRIFT = 0.25
"""How far the heading drifts from a steady law within a second [rad/√s]."""
HEADING_MATCH = 0.7
"""A heading further from the joint one than this is another heading [rad]."""
HEADING_NEIGHBOURS = 1.5
"""Pictures within this time of each other decide together whether the heading is right [s]."""
LEAST_NEAR = 0.7
"""Where a smaller share of the frames around one is near the joint heading, they have strayed."""
INDEPENDENT_VIEW = np.pi / 4
"""A handle that has turned by less repeats the same faults of its model [rad]."""
MIN_INDEPENDENT_VIEWS = 3
"""Least number of independent views that is assumed."""
CLEAR_HEADING = 3.0
"""Standard errors by which a heading must fit better than turned round, and than any other."""
MAX_HEADING_GAP = 2.0
"""Whole revolutions are not counted across a longer time without a heading [s]."""

# --- the smoothed path and its uncertainty ----------------------------------------------------

MIN_FITS = 5
"""Number of frames in which a stone must be measured to have a track."""
JERK_DENSITIES = (0.003, 0.01, 0.03, 0.1, 0.3, 1.0, 3.0)
"""Square roots of the jerk's spectral density among which a film chooses [m/s³/√Hz]; 0.003 is that
of a stone left alone."""
OUTLIER_SIGMAS = 4.0
"""Measurements this many standard errors from what all others say are left out."""
SMOOTHING_PASSES = 4
"""How often jerk, noise and outliers are found in turn."""
EDGE_ERROR_PX = 0.015
"""Error of a stone's place in the picture that neither noise nor the doubt about its look tells,
alike in all frames [px]: no shape of the model is quite that of a stone. In 94 films of known
throws the doubt told all of it; so much is left for stones unlike those."""
SMALL_STONE_ERROR_PX = 0.075
"""The same for a stone with a radius of one pixel. It falls with the radius: the fewer pixels a
stone has, the more of them mix it with the ice."""
HIDDEN_ERROR_PX = 0.1
"""Error of a place in the picture where something hides a part of the stone, by the root of that
part [px]: in a single frame, and alike in its neighbours. Less the median error of the free rows of
each film, rows of which a fifth is hidden were 0.05 px off, of which a half 0.09 px."""
HIDDEN_NEIGHBOURS = 0.3
"""Neighbours are frames this far before and after [s]."""
LARGER_COORDINATE_SHARE = 0.7
"""Share of the larger coordinate's variance that the common `sigma_xy` has at least, so that 95 %
of all coordinates lie in their intervals even where only one of the two is off."""
HANDLE_ERROR_PX = 0.35
"""Systematic error of a handle's picture across its length [px]; a stone at rest repeats it. It was
0.34 px (root mean square) for 16 stones in films of 405 to 720 lines."""
HANDLE_TILT_ERROR = 0.008
"""How much higher one end of a handle may stand than its look has it [m]. Seen from low down, that
looks as if it were turned."""

SCATTER_AROUND, LEAST_SCATTERED = 0.5, 6
"""How much places scatter is seen so far before and after [s], in so many of them at least."""
SCATTER_PX, SCATTER_TIMES, LEAST_SCATTER = 0.2, 5.0, 0.02
"""They scatter where that is so many pixels, so many times as much as in the middle of the film,
and so much [m]. Stones between sweepers scattered by 0.03 px in the middle and by 0.3 at most;
where now a stone and now a broom was measured, by 0.2 to 1.3."""
SCATTER_APART = 2.0
"""What lies between two stretches that scatter is no better if it is shorter [s]."""
SCATTER_ERROR = 2.0
"""Standard error of places there, in parts of the most that they scatter."""
SCATTER_TOLD = 1.0
"""It is told where it lasts longer [s]."""
WILD_SCATTER, WILD_SECONDS = 0.15, 1.5
"""Places that scatter by more than a stone's radius for so long are left out [m, s]."""

# --- what video compression leaves out --------------------------------------------------------

AGE_NEIGHBOURS = 0.5
"""The age of a stone's pixels is the mean over frames this far before and after [s]."""
AGE_AIM_DISTANCE = 0.1
"""Where a stone is going shows once it has gone so far [m]."""
AGE_MARGIN_PX = 2
"""Width of the ring around a stone whose pixels are watched [px]."""
DROPPED_CHANGE = 6.0
"""A codec that repeats pixels leaves out changes of about so much [grey levels]. Stones in fourteen
films, compressed in six ways, lagged by what changes their rim by 0 to 15, by 6 in the middle."""
BLOCK_ERROR = 5.0
"""Where all pixels of a stone are repeated, they err together: by so many times what they would
if each had an error of its own. It was 4 to 6 in films compressed at quality 23 to 33, at any
speed, on any paint, most along the line of sight."""
MAX_UNSEEN_TURN = 0.3
"""Stones that have turned by more since their pixels last changed show no heading [rad]."""

# --- which stone it is --------------------------------------------------------------------------

MIN_CHROMA = 25.0
"""Handles whose colour is weaker are taken for grey [of 255]."""
SAME_HUE = np.radians(35.0)
"""Handles whose hues differ by more are of two stones [rad]."""
