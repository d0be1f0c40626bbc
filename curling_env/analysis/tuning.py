"""Tuned constants for sampling ices."""

MAP_ERROR_LENGTH = 2.0
"""Correlation length of the errors of a friction map [m].

An ice file has σ for each cell and no correlation. One pass of a stone measures friction averaged
over two to three metres, so the errors of an estimated map are correlated over such a length.
"""
DRAWN_FRICTION = (0.2, 5.0)
"""Minimum and maximum sampled friction, as shares of the map's: the Gaussian's tails are not real
ice, and with neighbouring cells that differ a thousandfold a stone takes millions of steps.
"""
MIN_RESTED_SHARE = 0.9
"""Minimum share of the sampled ices on which a stone must come to rest for its rest to have a
spread.
"""
REST_ICES = 256
"""Number of ices on which a throw is repeated for the spread of its rest; σ is then known to 6
%.
"""
