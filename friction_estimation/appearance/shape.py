"""The parameters of a stone's shape and its parts, in the order in which kernels read them."""

from __future__ import annotations

PARTS = ("foot", "side", "bevel", "top", "handle")
"""Separately coloured parts of a stone, from the ice up."""
FOOT, SIDE, BEVEL, TOP, HANDLE, SHADE, LIT = range(7)
"""Planes of a painted stone: the share of each part, the light that the ice loses, and the light on
the stone from one side, in units of its side's brightness."""
PLANES = 7

SHAPE_PARAMETERS = (
    "radius",
    "height",
    "foot_inset",
    "foot_height",
    "bevel_height",
    "bevel_inset",
    "handle_rise",
    "handle_back",
    "handle_front",
    "handle_width",
    "blur_px",
    "colour_blur_px",
    "shadow_x",
    "shadow_y",
    "shadow_radius",
    "shadow_blur",
    "shadow",
    "handle_depth",
    "roundness",
    "contact",
    "contact_reach",
    "mirror",
    "collar_radius",
    "collar_rise",
    "foot_roundness",
    "neck_length",
    "light_x",
    "light_y",
    "gloss",
)
"""Names of the parameters of `StoneModel`, which explains them."""

(
    RADIUS,
    HEIGHT,
    FOOT_INSET,
    FOOT_HEIGHT,
    BEVEL_HEIGHT,
    BEVEL_INSET,
    HANDLE_RISE,
    HANDLE_BACK,
    HANDLE_FRONT,
    HANDLE_WIDTH,
    BLUR_PX,
    COLOUR_BLUR_PX,
    SHADOW_X,
    SHADOW_Y,
    SHADOW_RADIUS,
    SHADOW_BLUR,
    SHADOW,
    HANDLE_DEPTH,
    ROUNDNESS,
    CONTACT,
    CONTACT_REACH,
    MIRROR,
    COLLAR_RADIUS,
    COLLAR_RISE,
    FOOT_ROUNDNESS,
    NECK_LENGTH,
    LIGHT_X,
    LIGHT_Y,
    GLOSS,
) = range(len(SHAPE_PARAMETERS))
"""Place of each parameter."""

SUMS_IN_ANY_ORDER = {"reassoc", "nsz", "contract", "arcp"}
"""Options of the kernels' floating-point arithmetic: the compiler may reorder it."""
FINE = 2
"""Number of parts into which a pixel's side is cut when a stone is painted; `blur` is written for
two."""
