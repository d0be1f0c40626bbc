"""Numbers that were chosen for contacts, and for the ices that an ice's standard errors allow."""

from __future__ import annotations

# --- contacts ----------------------------------------------------------------------------------
TOUCHING = 1e-5
"""Gap up to which stones touch, so that their contacts are solved together [m].

Granite stays in contact for some 0.1 ms, in which a stone goes further than this."""
CREEP = 1e-3
"""Closing speed below which stones that only just touch are left alone [m/s].

Friction may press two touching stones together, and restitution would then have them bounce ever
faster and lower. Below this speed they overlap instead."""
CREEP_OVERLAP = 1e-5
"""Overlap up to which stones may creep closer at CREEP [m]."""
OVERLAPPING_CREEP = 5e-5
"""Closing speed below which stones that overlap by more are left alone [m/s].

Curl can steer a slow stone into one it slides along, for seconds and always slower than CREEP."""
CREEP_TIME = 5e-3
"""Time after which touching stones that creep are looked at again [s]; friction is no faster."""
SPACE = 8e-6
"""Gap to which stones that creep along each other are set apart; less than TOUCHING [m]."""
MAX_SHIFT = 2e-5
"""The most by which they are moved apart at a time [m]."""
SOLVED = 1e-13
"""Change of an impulse in a sweep, over the greatest closing speed, below which all are solved."""
MAX_SWEEPS = 3000
"""Sweeps over the contacts of a group; two contacts take 25, fifteen in a line about a thousand."""
MAX_ROUNDS = 50
"""Solutions at one time after which stones that still close are left to the next."""
ENERGY_ROUNDING = 1e-13
"""Gain of energy that is rounding, as a part of the energy."""

# --- plausible ices ----------------------------------------------------------------------------
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
