"""The tuned numbers of finding a camera: from known points, boards and the painted lines.

They were set on films that `friction_estimation.synthetic` renders, from all of its named cameras
and with clicks of 3 px, and checked on photos of clubs. What concerns the kind of lens stands in
`lens`.
"""

# --- the pose from known points -------------------------------------------------------------------

MAX_AXIS_OFFSET = 0.2
"""Share of the image by which no lens is off its middle, unless the image was cut."""
MAX_MISFIT = 0.02
"""Points that are missed by more than this share of the image's diagonal contradict each other."""

# --- the lens from pictures of a board ------------------------------------------------------------

BOARD_MIN_VIEWS = 3
"""Fewer pictures of a plane do not fix focal length, principal point and distortion together."""
BOARD_SEARCH_PX = 3_000_000
"""Pixels of the picture in which a chessboard is searched; a larger one is made smaller for it."""
BOARD_MIN_CORNERS = 6
"""Fewer corners of a ChArUco board are no view of it."""
BOARD_MAX_RMS_PX = 3.0
"""A board that is missed by more is not the board that was described."""
BOARD_MAX_FOCAL_SIGMA = 0.03
"""Largest standard error of the focal length, as a share of it."""
BOARD_FOCAL_RANGE = (0.2, 20.0)
"""Focal lengths of cameras, in image widths."""
BOARD_MIN_TILT_DEG = 5.0
"""Boards that are all held square to the camera cannot tell focal length from distance."""
BOARD_LAST_TERM_GAIN = 0.95
"""The last radial term is kept only where it lowers the misfit to this share or less."""

# --- measuring the painted lines in an image ------------------------------------------------------

EDGE_BLUR_PX = 1.0
"""Scale at which edges are looked for, about that of a film's own blur."""
MIN_LINE_WIDTH_PX = 1.6
"""A line that is narrower than this looks this wide."""
MAX_LINE_WIDTH_PX = 24.0
"""Lines that look wider are not measured as lines."""
MIN_CLEARANCE_PX = 4.5
"""Nothing else may be painted so near to a point that is measured."""
MIN_RADIUS_PX = 8.0
"""Rings are not measured where they are seen to bend more closely: there a blur of 0.7 px moves an
edge by more than 0.03 px."""
MIN_CONTRAST = 4.0
"""Least contrast of a marking that counts [grey levels]."""
POINT_SEARCH_PX = 2.5
"""Maximum distance of a single point from where its group is seen [px]."""
PROFILE_STEP_PX = 0.5
"""Distance between the samples along a normal."""
GROUP_SIZE = 12
"""Neighbouring points that are searched for together first."""

# --- the fit of a camera to the painted lines -----------------------------------------------------

CLICK_SIGMA_PX = 3.0
"""Standard error of a point that was marked by hand."""
MARKING_SIGMA_PX = 0.15
"""Standard error of one measured point with which a fit weighs it, beside what other things are
known; what the fit leaves then tells how far points are off."""
MARKING_CORRELATION = 6.0
"""Neighbouring points share their errors: this many count as one."""
PAINT_PLACEMENT_SIGMA = 0.002
"""Standard error of the painted radius of a ring, or place of a whole line [m]."""
PLACEMENT_SPREAD = 0.7
"""Spread of that from one sheet to another, in log."""
ALIKE_REACH = 12
"""Maximum number of neighbours on either side with which points of a curve share their errors."""
CURVE_ERROR_PX = 0.03
"""Error with which a whole ring or line is seen, alike all along it [px]: of 36 films by another
renderer, borders were off by 0.01, rings by 0.02 and lines by 0.02 to 0.1."""
MIN_SCALE_PX = 0.1
"""Measured points are never taken to agree better than this."""
OUTLIER_AT = 3.0
"""Residuals of this many times their scale count a quarter (Geman-McClure weights)."""
NARROW_SEARCHES_PX = (4.0, 3.0, 2.0, 2.0, 2.0)
"""Search radius of each round once the camera is nearly right."""
WIDE_SEARCHES_PX = (16.0, 10.0, 6.0)
"""Search radius of the rounds before."""
SPREAD_SIGMAS = (2.0, -2.0, 4.0, -4.0, 6.0, -6.0)
"""Steps to other starts, along what marks leave open most [standard errors of the marks]."""
SEARCHED_SIDE = 1280
"""Longer side of the pictures for which that is right; in smaller ones it is smaller [px]."""
WORKING_SIDE = 1920
"""Longer side of the pictures to which cameras are fitted [px]; larger ones are reduced."""
TOLERANCE_PX = 2.0
"""Largest distance at which a curve is where a camera puts it."""
SAME_MISFIT = 10.0
"""Cameras whose misfits differ by less are the same [squared standard errors]."""
MAX_STARTS = 12
"""Starting cameras that are followed at most."""
DISPLACED_SEARCH_PX = 6.0
"""Maximum distance from its place at which paint is sought where a camera may have moved [px]."""
MIN_MARKINGS = 60
"""Fewer measured points do not outweigh what was marked by hand."""
MIN_MARKINGS_SHARE = 0.25
"""Share of the points in view that must be found; fewer are chance."""
CAMERA_HEIGHT_PRIOR = (8.0, 0.5)
"""Median height of rink cameras [m] and its spread (in log): halls, galleries and tripods. It
decides only where the paint cannot, as for a camera that looks straight down."""
FOCAL_PRIOR = (1.1, 0.5)
"""Median focal length of cameras, in half diagonals of their picture, and its spread (in log).
Main cameras of phones have 1.1 to 1.3 (24 to 28 mm on the 35 mm scale), wide ones 0.6 to 0.75. To
see the whole sheet from low down takes a wider lens."""
MEASURED_HEIGHT_SIGMA = 0.01
"""Standard error of a measured height, in log."""
RIM_SHIFT_PX = 1.0
"""Outward error of paint where a lens squeezes the picture's rim to half its scale [px]:
colours part there, edges blur, and no formula of distortion is exact."""
RIM_SHIFT_POWER = 4
"""Power of the squeeze with which that grows; nothing of it is left in the middle of a picture."""

# --- errors to expect before anything is filmed ---------------------------------------------------

EXPECTED_ERROR_PX = 0.05
"""Error of one measured point of the paint in a film of little compression."""
EDGE_ERROR_PX = 0.015
"""Error of a stone's place in the picture beyond noise and the uncertainty of its look, alike in
all frames [px]: no shape of the model is quite that of a stone. In 94 films of known throws that
uncertainty explained all of it; this much is kept for stones unlike those."""
FIT_ERROR_PX = 0.17
"""Error of a smoothed place in the picture for a stone with a radius of one pixel; it falls with
the radius."""
SHAPE_RISE = 0.00125
"""Height by which what pictures leave open of a stone's shape raises it along the line of sight
[m]."""
STONE_HEIGHT_SIGMA = 0.05
"""Standard error, in log, of a camera's height that pictures of a stone tell."""
MIN_STONE_PX = 6.0
"""Smallest width of a stone that is followed [px]."""

# --- a camera from a single photo -----------------------------------------------------------------

PHOTO_SIDE = 720
"""Longer side of the picture in which a photo's camera is found [px]; larger ones are reduced."""
PHOTO_TRIALS = 6
"""Searches at most; two that agree with the paint are enough."""
PHOTO_SEARCHES = (0.15, 0.08, 0.05)
"""Search radius of each round before the camera is nearly right [m]."""
PHOTO_MIN_SCALE_PX = 1.5
"""`MIN_SCALE_PX` for a photo of a club's ice, whose paint is laid to a centimetre or so."""
PHOTO_CORRELATION = 24.0
"""`MARKING_CORRELATION` for the same."""
MARK_SIGMA = 0.2
"""Standard error of a mark that was read off roughly [m]."""
