"""Tuned constants for sliding stones and for contacts."""

from __future__ import annotations

from typing import NamedTuple

# --- slides ------------------------------------------------------------------------------------
# Compared with Runge–Kutta steps of 0.1 ms on 300 ices whose friction differs by up to a tenth from
# cell to cell, with patches, slopes, sweeping and drift.
QUICK_TOLERANCE = 1e-3
"""Maximum error of a rest on the roughest ice for large batches of throws [m]."""
FINE_TOLERANCE = 1e-4
"""The same for a single throw [m]."""


class StepControl(NamedTuple):
    """Limits on the length of steps.

    Parameters
    ----------
    target_error : minimum target for the error of a step's prediction, as a place of rest [m];
        about a fiftieth of it remains after the correction
    relative_error : the same as a share of speed × time to rest, which is twice the distance left
    first_share : length of a first step, over the time to rest
    longest_share : longest step, over the time to rest
    rest_speed : speed of centre and band below which the stone stops uniformly [m/s]
    """

    target_error: float
    relative_error: float
    first_share: float
    longest_share: float
    rest_speed: float


def step_control(tolerance: float) -> StepControl:
    """Return the limits that keep the rest of a lone stone within a tolerance [m] on any ice."""
    fine = tolerance / QUICK_TOLERANCE
    return StepControl(
        target_error=2e-4 * fine**2.7,
        relative_error=4e-5 * fine**2.7,
        first_share=0.1 * fine**0.5,
        longest_share=0.4 * fine**0.2,
        rest_speed=8e-3 * fine,
    )


MAX_NODES = 256
"""Maximum number of nodes of a step; steps are kept short enough to cross fewer lines of the
map.
"""
MAX_PASSES = 4
"""Maximum number of evaluations of the law for one step before a shorter one is tried."""
MIN_SPEED_LOSS = 1e-3
"""Minimum share of its speed that a stone must lose in a step to show the law's dependence on
speed.
"""
LENGTH_PER_RADIAN = 0.01
"""Error in position equivalent to an error of one radian in heading [m]."""

MAX_STEP = 8.0
"""Longest step [s]."""
MIN_STEP = 1e-4
"""Length below which a step is accepted unchecked [s]."""
TRACK_STEP = 0.2
"""Longest step on worn tracks [m]: contacts come and go between them."""
REPEAT_ABOVE = 2.0
"""Error above which the law is evaluated again at the predicted states, over the target error."""
SHORTEN_ABOVE = 15.0
"""Error of the prediction above which a shorter step is taken, over the target error."""
SECOND_STEP = 1.5
"""Length of the second step over the first, which had no prediction."""
EDGE_MARGIN = 2e-6
"""Distance before the edge of an effect at which steps end, to hop over it [m]."""
ROUNDING = 1e-9
"""Distance beyond a bound that counts as rounding [m]."""
ACCELERATION_MARGIN = 1.3
"""Maximum acceleration between the nodes of a path, over the greatest at the nodes."""
CONTACT_GAP = 1e-7
"""Gap below which stones are in contact [m]."""
MAX_STEPS = 20_000
"""Maximum number of steps, for a stone that never stops because the ice drives it."""
MAX_TIME = 180.0
"""Maximum time of such a stone [s]."""

ON_TARGET = 1e-3
"""Distance from the target at which a throw needs no further correction [m]."""
MAX_CORRECTIONS = 24
"""Maximum number of corrections of a throw before it counts as impossible."""
MAX_AIM_ANGLE = 0.3
"""Largest angle to which a line is corrected [rad]."""

# --- contacts ----------------------------------------------------------------------------------
TOUCHING = 1e-5
"""Gap below which stones touch, so that their contacts are solved together [m].

Granite stays in contact for some 0.1 ms, in which a stone moves further than this.
"""
CREEP = 1e-3
"""Approach speed below which stones that only just touch are ignored [m/s].

Friction may press two touching stones together, and restitution would then make them bounce ever
faster and lower. Below this speed they overlap instead.
"""
CREEP_OVERLAP = 1e-5
"""Maximum overlap up to which stones may approach at CREEP [m]."""
OVERLAPPING_CREEP = 5e-5
"""Approach speed below which stones that overlap by more are ignored [m/s].

Curl can steer a slow stone into one it slides along, for seconds and always slower than CREEP.
"""
CREEP_TIME = 5e-3
"""Interval at which creeping stones are checked again [s]; friction is no faster."""
SPACE = 8e-6
"""Gap after separating stones that creep along each other; less than TOUCHING [m]."""
MAX_SHIFT = 2e-5
"""Maximum shift of such a separation [m]."""
SOLVED = 1e-13
"""Change of an impulse in a sweep, over the greatest approach speed, below which all are solved."""
MAX_SWEEPS = 3000
"""Maximum number of sweeps over the contacts of a group; two contacts take 25, fifteen in a line
about a thousand.
"""
MAX_ROUNDS = 50
"""Maximum number of solutions at one time; stones that still approach wait for the next time."""
ENERGY_ROUNDING = 1e-13
"""Gain of energy that is rounding, as a part of the energy."""
OVERLAP_ALLOWED = 1e-3
"""Depth by which given resting stones may overlap [m]: positions are written to a millimetre."""
APPROACH = 0.3
"""Tolerance of the delivered stone's path among others, up to its first contact, as a share of the
tolerance. A contact magnifies an error of position ten times and more.
"""
ITERATIONS = 30
"""Number of iterations of pymunk's solver for each of several contacts."""
MEETING_GAP = 1e-6
"""Gap below which two stones that approach each other collide [m]."""
MAX_COLLISIONS = 3000
"""Maximum number of pushes in a throw."""
