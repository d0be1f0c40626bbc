"""The tuned numbers of live tracking, set on streams that are rendered here."""

from __future__ import annotations

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
