"""Tuned numbers of solving a camera: from known points, boards and the painted lines.

They were set on films that `friction_estimation.synthetic` renders, from all of its named cameras
and with clicks of 3 px, and checked on photos of clubs. Numbers of the kind of lens are in `lens`.
"""

# --- priors, and measured errors ------------------------------------------------------------------

CLICK_SIGMA_PX = 3.0
"""Standard error of a point that was marked by hand."""
MARKING_SIGMA_PX = 0.15
"""Standard error of one measured point in the weights of a fit; the residuals then show the actual
errors."""
MARKING_CORRELATION = 6.0
"""Number of neighbouring points with common errors that count as one."""
PAINT_PLACEMENT_SIGMA = 0.002
"""Standard error of the painted radius of a ring, or place of a whole line [m]."""
PLACEMENT_SPREAD = 0.7
"""Spread of that from one sheet to another, in log."""
CURVE_ERROR_PX = 0.03
"""Error of a whole ring or line in a picture, the same all along it [px]: in 36 films by another
renderer, borders were off by 0.01, rings by 0.02 and lines by 0.02 to 0.1."""
MIN_SCALE_PX = 0.1
"""Minimum scale of the residuals of measured points."""
PAINT_DEPTH = 0.0, 0.004
"""Assumed thickness of the clear ice above the paint if it is unknown, and its standard error [m].
Rinks have some millimetres, and most drawn films have none."""
PAINT_DEPTH_ERROR = 0.0005
"""Standard error of a measured thickness [m]."""
CAMERA_HEIGHTS = 2.5, 25.0
"""Range of heights of cameras above a rink [m]."""
CAMERA_HEIGHT_PRIOR = (8.0, 0.5)
"""Median height of rink cameras [m] and its spread (in log): halls, galleries and tripods. It
matters only if the paint does not determine the height, as for a camera that looks straight
down."""
FOCAL_PRIOR = (1.1, 0.5)
"""Median focal length of cameras, in half diagonals of their picture, and its spread (in log).
Main cameras of phones have 1.1 to 1.3 (24 to 28 mm on the 35 mm scale), wide ones 0.6 to 0.75. To
see the whole sheet from low down takes a wider lens."""
MEASURED_HEIGHT_SIGMA = 0.01
"""Standard error of a measured height, in log."""
RIM_SHIFT_PX = 1.0
"""Outward error of paint where a lens compresses the picture's rim to half its scale [px]: colours
separate there, edges blur, and no formula of distortion is exact."""
RIM_SHIFT_POWER = 4
"""Power of the compression with which that grows; it is zero in the middle of a picture."""
EXPECTED_ERROR_PX = 0.05
"""Error of one measured point of the paint in a film of little compression."""
EDGE_ERROR_PX = 0.015
"""Error of a stone's position in the picture in addition to noise and the uncertainty of its
appearance, the same in all frames [px]: no shape of the model is exactly that of a stone. In 94
films of known throws that uncertainty explained all errors; this value is kept for other stones."""
FIT_ERROR_PX = 0.17
"""Error of a smoothed position in the picture for a stone with a radius of one pixel; it falls with
the radius."""
SHAPE_RISE = 0.00125
"""Displacement along the line of sight, in height, by the uncertainty of a stone's shape [m]."""
STONE_HEIGHT_SIGMA = 0.05
"""Standard error, in log, of a camera's height from pictures of a stone; with a larger one, a focal
length counts as unknown."""
PHOTO_MIN_SCALE_PX = 1.5
"""`MIN_SCALE_PX` for a photo of a club's ice, whose paint is exact to about a centimetre."""
PHOTO_CORRELATION = 24.0
"""`MARKING_CORRELATION` for the same."""
MARK_SIGMA = 0.2
"""Standard error of a rough mark [m]."""

# --- numerics: sizes of samples, steps, and settings of searches ----------------------------------

BOARD_MIN_VIEWS = 3
"""Minimum number of pictures of a board for focal length, principal point and distortion."""
BOARD_SEARCH_PX = 3_000_000
"""Maximum number of pixels of the picture in which a chessboard is searched; larger ones are
reduced."""
BOARD_MIN_CORNERS = 6
"""Minimum number of corners in a view of a ChArUco board."""
EDGE_BLUR_PX = 1.0
"""Scale of the search for edges, about that of a film's own blur."""
MIN_LINE_WIDTH_PX = 1.6
"""Minimum apparent width of a line."""
POINT_SEARCH_PX = 2.5
"""Maximum distance of a single point from the offset of its group [px]."""
PROFILE_STEP_PX = 0.5
"""Distance between the samples along a normal."""
GROUP_SIZE = 12
"""Number of neighbouring points that are searched for together first."""
ALIKE_REACH = 12
"""Maximum number of neighbours on either side with which points of a curve share their errors."""
NARROW_SEARCHES_PX = (4.0, 3.0, 2.0, 2.0, 2.0)
"""Search radius of each round once the camera is nearly right."""
WIDE_SEARCHES_PX = (16.0, 10.0, 6.0)
"""Search radius of the rounds before."""
SEARCHED_SIDE = 1280
"""Longer side of the pictures to which these values apply; they scale down with smaller pictures
[px]."""
WORKING_SIDE = 1920
"""Longer side of the pictures to which cameras are fitted [px]; larger ones are reduced."""
MAX_STARTS = 12
"""Maximum number of initial cameras that are followed."""
DISPLACED_SEARCH_PX = 6.0
"""Search radius of paint if a camera may have moved [px]."""
PHOTO_SIDE = 720
"""Longer side of the picture in which a photo's camera is found [px]; larger ones are reduced."""
PHOTO_TRIALS = 6
"""Maximum number of searches; two that agree with the paint are enough."""
PHOTO_SEARCHES = (0.15, 0.08, 0.05)
"""Search radius of each round before the camera is nearly right [m]."""

# --- thresholds -----------------------------------------------------------------------------------

BOARD_MIN_TILT_DEG = 5.0
"""Minimum tilt of some board: views that all face the camera cannot separate focal length and
distance."""
BOARD_FOCAL_SIGMA = 0.02
"""Maximum standard error, in log, of a focal length from a board."""
MAX_MISFIT = 0.02
"""Maximum misfit of consistent points, as a share of the image's diagonal."""
MIN_RADIUS_PX = 8.0
"""Minimum apparent radius of curvature of a measured ring: at a smaller one a blur of 0.7 px moves
an edge by more than 0.03 px."""
MIN_CONTRAST = 4.0
"""Minimum contrast of a marking [grey levels]."""
OUTLIER_AT = 3.0
"""Residuals with a quarter of the weight, in units of their scale (Geman-McClure)."""
TOLERANCE_PX = 2.0
"""Maximum distance of a curve, or of the corners of a board, from its projection that counts as
agreement."""
AGREEING_SHARE = 0.7
"""Minimum share of agreeing parts: of a curve, of all rings and hog lines, and of all paint if a
camera is certainly correct. A curve of which the rest is seen elsewhere is in another place."""
MIN_MARKINGS = 60
"""Minimum number of measured points that replace marks made by hand."""
MIN_STONE_PX = 6.0
"""Minimum width of a tracked stone [px]."""
