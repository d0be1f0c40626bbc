"""The tuned numbers of live tracking, set on streams that are rendered here."""

from __future__ import annotations

# --- motion on the ice -------------------------------------------------------------------------

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
"""Time between two looks [s]."""
COMPARED_AFTER = 2.0
"""A look is compared with the one this long before [s]: far from the camera, a stone on its last
metre has then moved by a pixel."""

# --- recording ---------------------------------------------------------------------------------

QUIET_SECONDS = 3.0
"""A throw is over when all has been still for this time [s]."""
LEAD_IN_SECONDS = 2.0
"""A film begins this long before the motion, or more, at the last key frame before that [s]."""
MAX_FILM_SECONDS = 120.0
"""A film ends after this time even if the ice is never quiet [s]."""

# --- cameras and streams -----------------------------------------------------------------------

OPEN_TIMEOUT = 10.0
"""Time that a stream may take to open [s]."""
READ_TIMEOUT = 10.0
"""Time that an open stream may take to send something [s]."""
MAX_QUEUED_FRAMES = 50
"""Frames of a camera that may wait to be encoded; beyond these, the camera drops its own."""
