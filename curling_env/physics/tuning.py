"""Numbers that were chosen for the ices that an ice's standard errors allow."""

from __future__ import annotations

MAP_ERROR_LENGTH = 2.0
"""Correlation length of the errors of a friction map [m].

An ice file holds σ for each cell and no correlation. One pass of a stone measures friction
averaged over two to three metres, so the errors of an estimated map are alike over such a length.
"""
MIN_FRICTION_SHARE = 0.2
"""Smallest friction that is drawn, as a share of the map's: the Gaussian's tail is not real ice."""
LEAST_RESTED = 0.9
"""Share of the plausible ices on which a stone must rest for its rest to have a spread."""
REST_ICES = 256
"""Ices on which a throw is repeated for the spread of its rest; σ is then known to 6 %."""
