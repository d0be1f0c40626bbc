"""Numbers that were tuned for plausible ices."""

MAP_ERROR_LENGTH = 2.0
"""Correlation length of the errors of a friction map [m].

An ice file holds σ for each cell and no correlation. One pass of a stone measures friction
averaged over two to three metres, so the errors of an estimated map are alike over such a length.
"""
DRAWN_FRICTION = (0.2, 5.0)
"""Smallest and largest friction that is drawn, as shares of the map's: the Gaussian's tails are not
real ice, and on neighbouring cells a thousandfold apart a stone takes millions of steps."""
LEAST_RESTED = 0.9
"""Share of the plausible ices on which a stone must rest for its rest to have a spread."""
REST_ICES = 256
"""Ices on which a throw is repeated for the spread of its rest; σ is then known to 6 %."""
