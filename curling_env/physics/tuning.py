"""Numbers that were tuned for sliding stones and for contacts."""

from __future__ import annotations

from typing import NamedTuple

# --- slides ------------------------------------------------------------------------------------
# They were held against Runge–Kutta steps of 0.1 ms on 300 ices whose friction differs by up to a
# tenth from cell to cell, with patches, slopes, sweeping and drift.
QUICK_TOLERANCE = 1e-3
"""Distance by which a rest may be off on the roughest ice where very many throws are made [m]."""
FINE_TOLERANCE = 1e-4
"""The same for a single throw [m]."""


class StepControl(NamedTuple):
    """The lengths that steps may have.

    Parameters
    ----------
    target_error : smallest error of a step's prediction that is aimed at, as a place of rest [m];
        the correction leaves about a fiftieth of it
    relative_error : the same as a part of speed × time to rest, which is twice the way left
    first_share : length of a step that has none before it, over the time to rest
    longest_share : longest step, over the time to rest
    rest_speed : speed of centre and band below which the stone stops uniformly [m/s]
    """

    target_error: float
    relative_error: float
    first_share: float
    longest_share: float
    rest_speed: float


def step_control(tolerance: float) -> StepControl:
    """The steps that keep the rest of a lone stone right within a tolerance [m] on any ice."""
    fine = tolerance / QUICK_TOLERANCE
    return StepControl(
        target_error=2e-4 * fine**2.7,
        relative_error=4e-5 * fine**2.7,
        first_share=0.1 * fine**0.5,
        longest_share=0.4 * fine**0.2,
        rest_speed=8e-3 * fine,
    )


MAX_NODES = 256
"""Nodes that one step can have; steps are kept short enough to cross fewer lines of the map."""
MAX_PASSES = 4
"""Times the law is evaluated for one step before a shorter one is taken."""
MIN_SPEED_LOSS = 1e-3
"""Share of its speed that a stone must lose in a step to show how the law follows the speed."""
LENGTH_PER_RADIAN = 0.01
"""Error in place that counts as much as an error of one radian in heading [m]."""

MAX_STEP = 8.0
"""Longest step [s]."""
MIN_STEP = 1e-4
"""A step this short is accepted as it is [s]."""
TRACK_STEP = 0.2
"""Longest step where stones have worn tracks [m]: contacts come and go between them."""
REPEAT_ABOVE = 2.0
"""Error above which the law is evaluated again at the predicted states, over the target error."""
SHORTEN_ABOVE = 15.0
"""Error of the prediction above which a shorter step is taken, over the target error."""
SECOND_STEP = 1.5
"""Length of the second step over the first, which predicted nothing."""
EDGE_MARGIN = 2e-6
"""Distance before the edge of an effect at which steps end, to hop over it [m]."""
ROUNDING = 1e-9
"""Distance beyond a bound that is put down to numbers being rounded [m]."""
MORE_THAN_AT_NODES = 1.3
"""The acceleration between the nodes of a path, at most, over the greatest at the nodes."""
CONTACT_GAP = 1e-7
"""A gap below this is a contact [m]."""
MAX_STEPS = 20_000
"""Steps after which a stone is given up that never stops because the ice drives it."""
MAX_TIME = 180.0
"""Time after which such a stone is given up [s]."""

ON_TARGET = 1e-3
"""Distance from the target at which a throw needs no further correction [m]."""
MAX_CORRECTIONS = 12
"""Corrections of a throw after which there is taken to be none that reaches the target."""
MAX_AIM_ANGLE = 0.3
"""Largest angle to which a line is corrected [rad]."""

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
OVERLAP_ALLOWED = 1e-3
"""Depth by which resting stones may overlap as given [m]: positions are written to a millimetre."""
APPROACH = 0.3
"""Tolerance of the delivered stone's path among others, up to its first contact, as a part of the
tolerance. A contact magnifies ten times and more what the place of the stones is off by."""
ITERATIONS = 30
"""Iterations of pymunk's solver for each of several contacts."""
MEETING_GAP = 1e-6
"""Gap below which two stones that close on each other collide [m]."""
MAX_COLLISIONS = 3000
"""Pushes after which a throw is given up."""
