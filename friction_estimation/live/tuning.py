"""Tuned numbers of live tracking, set on streams rendered by this project."""

from __future__ import annotations

# --- recording ---------------------------------------------------------------------------------

QUIET_SECONDS = 3.0
"""Time without motion that ends a throw [s]."""
LEAD_IN_SECONDS = 2.0
"""Minimum lead of a film before the motion, from the last key frame before that [s]."""
MAX_FILM_SECONDS = 120.0
"""Maximum duration of a film [s]."""

# --- cameras and streams -----------------------------------------------------------------------

OPEN_TIMEOUT = 10.0
"""Timeout for opening a stream [s]."""
READ_TIMEOUT = 10.0
"""Timeout for data of an open stream [s]."""
MAX_QUEUED_FRAMES = 50
"""Maximum number of a camera's frames that wait for encoding; beyond these, the camera drops
frames."""
