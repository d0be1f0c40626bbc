"""The numbers of tracking: physics, priors, and how well pictures show a stone."""

from __future__ import annotations

import numpy as np

# --- physics --------------------------------------------------------------------------------------

DECELERATION, DECELERATION_SIGMA = 0.09, 0.03
"""Mean and standard deviation of a sliding stone's deceleration [m/s²]."""
ICE_SIGMA = 0.09
"""Standard deviation of the deceleration on ice that is not known yet [m/s²]."""
CURL_SIGMA = 0.015
"""Standard deviation of its acceleration sideways [m/s²]."""
DECELERATION_MEMORY = 5.0
"""Half the time in which its deceleration changes by about its standard deviation [s]."""
SPIN_CHANGE = 0.1
"""Standard deviation of the change of its spin [rad/s²]."""
CARRIED_ACCELERATION = 1.5
"""Standard deviation of the acceleration of a stone that someone holds [m/s²]."""
JUMP_SIGMA = 1.0
"""Standard deviation of each component of the change of velocity in a collision [m/s]."""
FASTEST = 5.0
"""Highest speed of a stone [m/s]."""

LEAST_SPEED = 0.05
"""A slower stone counts as resting in the association [m/s]."""

# --- priors of the association --------------------------------------------------------------------

BIRTH = -6.0
"""Log probability that a stone enters the film at a given detection."""
LIES = -3.0
"""Log probability that a detection in the first frames is a stone that lies there."""
RELEASED, STOPS, HIT = -2.0, -2.0, -7.0
"""Log probabilities that a stone is released, stops or is hit between two detections."""
STILL_THERE = 0.1
"""Log odds that a stone gains by each frame in which it still rests."""
MISSED, HIDDEN = -1.2, -5.0
"""Log probability that a stone in view is not detected in a frame, and least one for a gap."""
LONGEST_GAP, LONGEST_GAP_FRAMES = 4.0, 10
"""Longest gap between two detections of one path [s], and in sampled frames."""
SURE = 8.0
"""Log odds above which a path is a stone's."""
LEAST_WAY = 0.5
"""Shortest way of a stone that moves [m]."""

# --- measurements ---------------------------------------------------------------------------------

DETECTION_PX, DETECTION_M = 0.7, 0.03
"""Standard errors of a detection: pixels in the picture, and on the ice [m]."""
STUDENT_FREEDOM = 4.0
"""Degrees of freedom of the measurements' Student distribution."""
GATE = 4.0
"""Largest innovation of a fit [standard deviations]."""
LEAST_GATE, LEAST_GATE_PX = 0.03, 1.0
"""Smallest gate of a fit [m], and in the picture [px]."""
STILL_SCORE = 0.54
"""Least log odds of a stone on ice that does not change."""
LEAST_HEADINGS = 4
"""Fewest pictures whose headings make a curve."""
LOST = 0.5
"""A stone whose place is known no better is not looked for [m]."""
HEADING_DRIFT = 0.1
"""Standard error of the heading curve through all pictures [rad]."""

# --- contacts -------------------------------------------------------------------------------------

CONTACT_WITHIN = 1.5
"""Longest time over which a stone's way to a contact is extrapolated [s]."""
CONTACT_FITS = 8
"""Measurements by which it is extrapolated."""
GRAZES = 0.03
"""Error of a path that still counts as a contact [m]."""
DENSE_STEP, DENSE_BEFORE, DENSE_AFTER = 0.12, 1.0, 4.0
"""Time between frames around a contact, and how long before and after it [s]."""
SAME_PLACE = 0.2
"""Places nearer to each other than this are those of the same stone [m]."""
REACH = 0.4
"""A coarse path that passes by a stone this near may have touched it [m]."""
LEAST_RESTING_VISIBLE, MOST_UNEXPLAINED = 0.6, 0.85
"""Least share of a resting stone that is seen, and most that its look leaves unexplained."""
END_FRAMES = 3
"""A stone that is seen where it rests in one of the last frames stays."""
LINK_FITS = 5
"""Detections by which a path is led to a contact."""
LINK_GATE = 20.0
"""A detection that misses a stone by more is not its own [squared standard errors]."""
COLLISION_TRANSFER, COLLISION_SIGMA = 0.93, 0.3
"""Fraction of the approach speed transferred in a collision, and standard error of either velocity
after it as a fraction of the speed."""
REST_SPEED_SIGMA = 0.05
"""Error of the place of a stone that seems to have stopped, per time [m/s]."""
CONTACT_GATE = 0.1
"""Addition to the gate of a fit around a contact [m]."""

# --- recordings of many throws --------------------------------------------------------------------

WINDOW = 45.0
"""Length of film over which the ice stays the same [s]."""
AFTER_THROW = 4.0
"""Film that is tracked after a stone was last seen to move [s]."""
HELD = 3.0
"""Longest time before the first sliding detection from which on a throw is tracked [s]."""
LONGEST_SLIDE = 30.0
"""Longest time that a stone slides [s]."""
ASKED_EVERY = 4
"""The network is asked in one of this number of looks."""
TURNS_BACK = 0.3
"""Anything that goes back this far is pushed back [m]."""
LAY_UNTIL, FROM_REST = 2.5, 0.7
"""A stone that lay where one starts less than this before is the same one [s], if it is slower at
first than this share of its mean speed."""
APART = 0.5
"""Least time between two throws [s]."""
RETURNS_FROM = 0.8
"""A stone that starts this near to where the one before it rests may be slid back [m]."""
LEAST_SLIDES = 4
"""Fewest detections of a throw while it slides."""
ICE = 0.05, 0.4
"""Least and greatest deceleration of stones on any ice [m/s²]."""
LEAST_THROW = 3.0
"""Shortest way of a throw in a recording [m]."""
JUDGED_ROWS, MOVING_SHARE, RESTED = 60, 0.95, 2.0
"""Rows of a track by which it is judged, share of its way for which it counts as moving, and time
for which a stone that has come to rest is seen at rest [s]."""
WALKING_SIGMA = 0.02
"""Standard deviation of the mean acceleration of people who walk [m/s²]."""
UNUSUAL, HIT_RANGE, HALT_RANGE = 0.1, 1.0, 0.4
"""Share of stones that hit others or are hit, and of people who change their speed; ranges of the
mean deceleration then [m/s²]."""
WALKING_SPEED, WALKING_SPEED_SIGMA = 1.3, 0.35
"""Mean and standard deviation of the speed of people who walk [m/s]."""
PUSHED = 0.3
"""Gain of speed that no stone has that slides alone [m/s]."""
STANDING = 0.12
"""A stone that is slower over three frames rests [m/s]."""

ONE_THROW_SECONDS = 60.0
"""A film of one throw that is no longer than this is tracked as it is [s]."""
LOOK_STEP = 0.4
"""Time between two looks at a long film, where key frames come so often [s]."""
MAX_KEY_GAP = 1.05
"""Longest gap between key frames without decoding frames in between [s]."""
FINE_LINES = 800
"""Pictures are looked at in halves, quarters, ... until they have fewer lines."""

# --- motion on the ice ----------------------------------------------------------------------------

SQUARE_PX = 2
"""Brightness is averaged over squares of this many pixels."""
MIN_CHANGE = 12.0
"""Least change of brightness that counts, of 255, beyond the change that all of the ice shares."""
CHANGE_SIGMAS = 6.0
"""A change must also be this many times the camera's noise."""
MOVING_STONE_SHARE = 0.2
"""Share of a stone's picture that must change."""
MIN_CHANGED_SQUARES = 3
"""Number of squares that must change, however small a stone is there."""
LOOK_INTERVAL = 0.1
"""Least time between two looks at a stream [s]."""
LEVEL_STEP, LEVEL_SQUARES = 7, 2000
"""The change that all of the ice shares, and the noise, are taken from squares this far apart, and
from at least this number of them, or from all."""
COMPARED_AFTER = 2.0
"""A look is compared with the one this long before [s]: far from the camera, a stone on its last
metre has then moved by a pixel."""

# --- the frames looked at first, and blobs before the empty ice -----------------------------------

SAMPLE_FRAMES = 40
"""Number of frames, spread over the film, in which the stone is first looked for."""
SAMPLE_BYTES = 375_000_000
"""Memory of these frames: fifteen of a 4K film, forty of one of 1080 rows."""
LEAST_SAMPLE = 7
"""Minimum number of these frames, for a film of any size."""
BACKGROUND_FRAMES = 15
"""Number of these frames whose median is the empty ice."""
KNOWN_LENS_MARGIN_PX = 12
"""Pixels kept around the sheet where the lens is known."""
UNKNOWN_LENS_MARGIN_PX = 48
"""Pixels kept around the sheet where the lens is unknown, so that the sheet may be misplaced."""
PEOPLE_HEIGHT = 2.0
"""Height up to which the surroundings of the sheet are kept, so that people are seen whole [m]."""
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
HANDLE_RISE = 0.06
"""Rough height of a handle above the body [m]."""
MAX_SHADOW_GROWTH = 2.5
"""A stone's shadow and reflection make its blob at most this many times as wide or high."""
MAX_SIZE_RATIO = 2.2
"""Factor by which a blob may be larger or smaller than a stone in its place would look."""
BLOB_RIM_PX = 1.5
"""Width of the blurred rim of a blob that the threshold includes [px]."""

# --- the look of a stone --------------------------------------------------------------------------

MIN_LEARNING_LIKENESS = 0.3
"""The appearance of the stone is learnt from sightings at least this much like a stone."""
MAX_UNEXPLAINED = 0.2
"""Share of the difference from the empty ice that the learnt appearance may leave unexplained.
Stones leave 0.04 to 0.1; people who are taken for stones leave 0.3 to 0.5."""
PEOPLE_NEAR = 1.5
"""A person within this distance of a stone may pass for it, or hide it [m]."""
FRAMES_WITH_PEOPLE = 3
"""Track by appearance if people are near in at least this many sampled frames."""
PLAIN_NOISE = 12.0
"""Difference that counts as one standard error in judging what looks like a stone [grey levels]."""
CLEAR_PICTURE, LEAST_CLEAR = 0.1, 8
"""Maximum unexplained share of a clear picture, and minimum number of pictures to learn from; where
fewer are clear, the clearest of the whole path are added."""
AGREEING_SHARE = 0.95
"""Minimum share of the places of one path that are the other's, if both are of one stone. Of films
with people, those whose stone is always alone in the picture have 1.0, and those with sweepers 0.66
at most. A stone that is sighted in this share of the frames in which it should be is alone all the
way."""
HEADINGS_TRIED = 24
"""Headings at which the handle of a stone at rest is looked for."""
CLEAR_FRONT = 12.0
"""Squared standard errors by which every other heading of a handle must fit worse."""
COLOUR_ROUNDS = 3
"""Rounds in which the colours of a stone at rest are found, each with fewer strange pixels."""
GRANITE_SPREAD = (15.0, 4.0, 4.0)
"""Difference of another stone's granite from that of the thrown one, in brightness and two colour
differences [grey levels]: other granite, or other light where it lies."""
USUAL_HANDLE, HANDLE_SPREAD = (110.0, 0.0, 0.0), (60.0, 60.0, 60.0)
"""Mean and standard deviation of the colours of handles [grey levels]."""

# --- the camera, and the focal length that the paint leaves open ----------------------------------

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
"""Maximum number of times that heights are tried again with the looks of better ones, and that
finer ones are tried beside the best."""
UNLIKELY_HEIGHT = 20.0
"""Excess cost over the best above which heights are not tried again [squared standard errors]."""
MIN_LOG_HEIGHT_SIGMA = 0.05
"""The logarithm of the height is never claimed to be known better: it follows how high a stone's
widest place is, which is known to 3 mm of 57."""
LOW_HEIGHT = 4.0
"""Heights are compared on the pixels in which a camera at this height shows the stone [m]."""
HEIGHT_CROPS = 12
"""Approximate number of pictures of stones that are used to compare heights."""
STILL_PX = 0.5
"""A camera that has moved by less since it was solved counts as standing still [px]."""
SOLVING_FILMS = 3
"""Films from which a camera is solved."""

# --- heading --------------------------------------------------------------------------------------

MAX_CONTACT_DELAY = 0.4
"""A contact lies at most this long before a stone is seen to have left its place [s]."""
HEADING_VIEW_INTERVAL = 0.4
"""Time between the pictures that are compared with all headings [s]."""
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
HEADING_WANDER = 0.25
"""Drift of the heading from a steady law within a second [rad/√s]."""
HEADING_MATCH = 0.7
"""A heading further from the joint one than this is another heading [rad]."""
HEADING_NEIGHBOURS = 1.5
"""Pictures within this time of each other decide together whether the heading is right [s]."""
LEAST_NEAR = 0.7
"""Minimum share of the frames around one near the joint heading; with fewer, they have strayed."""
INDEPENDENT_VIEW = np.pi / 4
"""A handle that has turned by less repeats the same faults of its model [rad]."""
MIN_INDEPENDENT_VIEWS = 3
"""Least number of independent views that is assumed."""
CLEAR_HEADING = 3.0
"""Standard errors by which a heading must fit better than turned round, and than any other."""
MAX_HEADING_GAP = 2.0
"""Whole revolutions are not counted across a longer time without a heading [s]."""

# --- uncertainty of a track -----------------------------------------------------------------------

MIN_FITS = 5
"""Number of frames in which a stone must be measured to have a track."""
EDGE_ERROR_PX = 0.015
"""Error of a stone's place in the picture beyond noise and the uncertainty of its look, alike in
all frames [px]: no shape of the model is quite that of a stone. In 94 films of known throws that
uncertainty explained all of it; this much is kept for stones unlike those."""
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
"""Error of the height of one end of a handle [m]. Seen from low down, that looks as if the handle
were turned."""
AGE_NEIGHBOURS = 0.5
"""The age of a stone's pixels is the mean over frames this far before and after [s]."""
AGE_AIM_DISTANCE = 0.1
"""Minimum distance that a stone must go to show its direction [m]."""
AGE_MARGIN_PX = 2
"""Width of the ring around a stone whose pixels are watched [px]."""
DROPPED_CHANGE = 6.0
"""Approximate largest change that a codec drops when it repeats pixels [grey levels]. Stones in
fourteen films, compressed in six ways, lagged by what changes their rim by 0 to 15, by 6 in the
middle."""
BLOCK_ERROR = 5.0
"""Factor on the error where all pixels of a stone are repeated and err together, over that of
independent errors. It was 4 to 6 in films compressed at quality 23 to 33, at any speed, on any
paint, most along the line of sight."""
MAX_UNSEEN_TURN = 0.3
"""Stones that have turned by more since their pixels last changed show no heading [rad]."""

# --- which stone it is ----------------------------------------------------------------------------

MIN_CHROMA = 25.0
"""Handles whose colour is weaker are taken for grey [of 255]."""
SAME_HUE = np.radians(35.0)
"""Handles whose hues differ by more are of two stones [rad]."""

# --- what no stone does alone --------------------------------------------------------------------

MISFIT_AROUND, MISFIT_TIMES, LEAST_MISFIT = 0.5, 5.0, 0.02
"""Measurements this long before and after [s] are off the path if they are so by this many times
the median of the film, and by this much [m]."""
MISFIT_ERROR = 2.0
"""Standard error of places there, in parts of the most by which they are off."""
MISFIT_REPORTED = 1.0
"""A misfit that lasts longer is reported [s]."""
SUDDEN_LOSS = 0.35
"""A jump of the velocity that takes more speed is reported [m/s]..."""
OUT_OF_HAND = 10.0
"""... from this way along the sheet on, where no hand is at the stone [m]."""
DECELERATION_AROUND, MOST_DECELERATION = 1.2, 0.2
"""A stone that loses more speed in the first of these, before and after [s], than by the second
[m/s²] does not slide on."""
