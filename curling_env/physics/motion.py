"""Inputs and outputs of an effect's kernel.

A kernel is a small pure function ``kernel(motion, theta, push)``: it reads the motion of the stone
from `motion`, its own parameters from `theta` in the order of its card, and adds to `push`. The
names below are the places in `motion` and `push`.
"""

from __future__ import annotations

import math

from curling_env.physics.compiled import part

# --- motion: how the stone moves -------------------------------------------------------------
X, Y = 0, 1
"""Centre of the stone across and along the sheet [m], sheet frame."""
SPEED = 2
"""Speed of the centre [m/s]."""
LOG_SPEED = 3
"""Natural logarithm of the speed in m/s, precomputed: exp(p·LOG_SPEED) is speed^p."""
TRAVEL_X, TRAVEL_Y = 4, 5
"""Direction of travel, a unit vector in the sheet frame."""
HEADING = 6
"""Heading of the handle [rad]."""
SPIN = 7
"""Spin, counter-clockwise positive [rad/s]."""
T = 8
"""Seconds since release [s]."""
CLOCK = 9
"""Seconds into the session [s]."""
ORDER = 10
"""Throws already played in the session."""
STONE = 11
"""Identifier of the stone."""
SWEPT = 12
"""1 while the stone is swept, else 0."""
CONTACTS = 13
"""Number of contacts of the band in this call: friction kernels that act per contact only."""
MAX_CONTACTS = 16
"""Maximum number of contacts in one call of a kernel."""
SLIP = 14
"""Sliding speed of contact q over the ice at SLIP + q [m/s]: kernels that act per contact only."""
LOG_SLIP = SLIP + MAX_CONTACTS
"""Natural logarithm of the slip in m/s of contact q at LOG_SLIP + q."""
RAN = LOG_SLIP + MAX_CONTACTS
"""Layer of the law's tracks: the number of stones that had run before."""
MOTION_SIZE = RAN + 1

# --- push: what the effect does to it ---------------------------------------------------------
FRICTION = 0
"""Factor on the coefficient of friction; multiply it."""
BEND = 1
"""Factor on the sideways acceleration of all effects together; multiply it."""
ALONG = 2
"""Acceleration along the direction of travel [m/s²]; add to it, negative slows the stone."""
LEFT = 3
"""Acceleration to the left of the direction of travel [m/s²]; add to it."""
TURN = 4
"""Angular acceleration, counter-clockwise positive [rad/s²]; add to it."""
PUSH_X, PUSH_Y = 5, 6
"""Acceleration along the sheet frame's x and y [m/s²]; add to it."""
CONTACT_FRICTION = 7
"""Factor on the friction of contact q at CONTACT_FRICTION + q; multiply it."""
PUSH_SIZE = CONTACT_FRICTION + MAX_CONTACTS

GRAVITY = 9.80665
"""Standard gravity [m/s²] (ISO 80000-3)."""

SLOW_SPIN = 0.01
"""Spin below which the sign of the rotation fades out smoothly [rad/s]."""


@part
def spin_sign(spin: float) -> float:
    """Return the sign of the spin, smooth through zero so that a stone that stops turning stays at
    rest.
    """
    return spin / math.sqrt(spin * spin + SLOW_SPIN * SLOW_SPIN)
