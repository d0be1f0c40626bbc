"""Appearance of synthetic films, and the fineness of their drawing.

None of these numbers is measured. They were chosen by eye, so that films look like those of clubs.
"""

# --- the sheet and the hall -----------------------------------------------------------------------

SHEET_SAMPLES = 4
"""Number of samples along each side of a pixel of the sheet."""
PIXELS_AT_ONCE = 4096
"""Number of pixels painted at a time; their samples fit into a processor's cache."""
BUMPER_WIDTH = 0.12
"""Width of the foam divider along the ice [m]."""
LAMP_HEIGHT = 14.0
"""Height of the lamps above the ice [m]."""
LAMP_POSITIONS = tuple((x, y) for x in (-3.0, 3.0) for y in (-20.0, -12.0, -4.0, 4.0, 12.0, 20.0))
"""Places of the lamps, sheet frame [m]."""
PEBBLE_CELL = 0.0125
"""Side of a cell of the pebble texture [m]."""

# --- stones ---------------------------------------------------------------------------------------

BODY_PROFILE = (
    (0.50, 0.00),
    (0.76, 0.08),
    (0.91, 0.21),
    (0.985, 0.36),
    (1.00, 0.44),
    (1.00, 0.56),
    (0.985, 0.64),
    (0.92, 0.79),
    (0.80, 0.92),
    (0.66, 1.00),
)
"""Outline of a stone's body from the ice to its flat top, as shares of its radius and height.

Outlines differ between makers; this one has the usual striking band at mid-height.
"""
GRANITE_COLOUR = (112.0, 114.0, 116.0)
"""Mean colour of a stone's body, blue-green-red."""
SPECKLE_CELL = 0.004
"""Size of a grain of the granite [m]."""
RED = (38, 30, 196)
"""Default colour of a handle, blue-green-red."""
HANDLE_COLOURS = (RED, (40, 190, 235), (190, 110, 30), (70, 140, 40))
"""Red, yellow, blue and green handles (blue-green-red), in the order of the stones' numbers."""
LAMP_DIRECTIONS = ((0.30, 0.35, 0.89), (-0.35, -0.25, 0.90))
"""Directions from a stone to the lamps that light it."""
SHADOW_REACH = 0.30
"""Distance from a stone's edge at which its shadow ends [m]."""
LARGE_STONE_SAMPLES = 4
"""Number of samples along a pixel's side for a large stone; must be divisible by four, see
`_schedule`.
"""
SMALL_STONE_SAMPLES = 8
"""The same for a small stone."""
LARGE_STONE_PIXELS = 700
"""A patch with more pixels than this counts as a large stone."""

# --- people ---------------------------------------------------------------------------------------

THROWER_DECELERATION = 1.1
"""Deceleration of a thrower who has released the stone [m/s²]."""
SWEEP_RATE = 4.5
"""Strokes of a broom per second [1/s]."""
STRIDE_LENGTH = 1.4
"""Length of two steps [m]."""
PERSON_SAMPLES = 3
"""Number of samples along a pixel's side for a person."""
LARGE_PERSON_PIXELS = 60_000
"""A person's box with more pixels than this gets one sample per pixel."""

JACKETS = ((110, 62, 34), (56, 92, 40), (60, 58, 130), (120, 116, 112))
"""Colours of jackets, blue-green-red; those of the other clothes follow."""
TROUSERS = (36, 34, 34)
SHOES = (24, 24, 24)
SKIN = (138, 164, 206)
HAIR = (40, 52, 70)
BROOM = (60, 190, 220)
BRUSH = (48, 44, 40)

# --- the sensor -----------------------------------------------------------------------------------

STEPS_PER_GREY_LEVEL = 16
"""Resolution of a picture that is being drawn, so that noise is not added to rounded values."""
NOISE_MARGIN_PX = 251
"""Extra rows and columns of the noise field; each frame uses a random part of the field."""
