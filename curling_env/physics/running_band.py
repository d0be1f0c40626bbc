"""Running band of a stone: the sum of friction over its contacts.

The band is summed as a continuous ring, the limit of the paper's J contacts: a periodic trapezoid
rule whose points crowd where the rim is nearly at rest on the ice, within 7e-5 of the elliptic
integrals if the rim is nearly as fast as the centre, within 2e-6 otherwise, with 8 to 32 contacts.

On worn tracks, each contact has the friction of the ice under it. More friction on the left than on
the right then turns the stone, and more in front than behind pushes a turning stone aside.
"""

# Work arrays come untyped through compiled code: values read from them are unknown, not wrong.
# pyright: reportUnknownVariableType=false, reportUnknownArgumentType=false

from __future__ import annotations

import math
from typing import Any

import numpy as np

from curling_env.physics.compiled import call_kernel, inlined, quick_log
from curling_env.physics.motion import (
    CONTACT_FRICTION,
    CONTACTS,
    LOG_SLIP,
    RAN,
    SLIP,
    TRAVEL_X,
    TRAVEL_Y,
    X,
    Y,
)
from curling_env.typing import Floats

MIN_SPEED = 1e-9
"""Minimum speed for directions and logarithms; lower speeds are replaced by it [m/s]."""


def _front_half(pairs: int, crowding: float) -> Floats:
    """Return contacts ahead of the centre: sine and cosine of φ and weight, (pairs, 3).

    φ = π/2 + u − crowding·sin u: equal steps of u crowd the points where φ = π/2, the place of a
    rim that moves against the travel.
    """
    u = np.pi * (np.arange(pairs) + 0.5) / pairs
    beyond = u - crowding * np.sin(u)
    return np.column_stack([np.cos(beyond), np.sin(beyond), (1 - crowding * np.cos(u)) / pairs])


_POINT = np.array([[0.0, 0.0, 1.0]])
_EIGHT = _front_half(4, 0.4)
_SIXTEEN, _MOST = _front_half(8, 0.7), _front_half(16, 1.0)
_WORN = _front_half(8, 0.4)


@inlined
def _slips_and_factors(
    law: Any, front: Any, speed: float, rim: float, motion: Any, push: Any
) -> None:
    """Fill in the slips of a band's contacts, and the resulting factors on their μ."""
    contacts = front.shape[0]
    for q in range(contacts):
        along = speed - rim * front[q, 0]
        across = rim * front[q, 1]
        motion[SLIP + q] = max(math.sqrt(along * along + across * across), MIN_SPEED)
    for q in range(contacts):
        push[CONTACT_FRICTION + q] = 1.0
    if law.per_contact > 0:
        motion[CONTACTS] = contacts
        for q in range(contacts):
            motion[LOG_SLIP + q] = quick_log(motion[SLIP + q])
        for k in range(law.per_contact):
            call_kernel(law.kernels[k], motion, law.theta, law.offsets[k], push)


@inlined
def running_band(law: Any, speed: float, spin: float, motion: Any, push: Any) -> Any:
    """Return mean drag and torque of the band's contacts, per unit μ and load.

    Parameters
    ----------
    law : the ice, a `Law`
    speed : speed of the centre [m/s]
    spin : spin, counter-clockwise positive [rad/s]
    motion, push : work arrays of MOTION_SIZE and PUSH_SIZE

    Returns
    -------
    drag, torque : F/(μmg) against the travel and τ/(μmgr) counter-clockwise
    """
    rim = law.band_radius * math.fabs(spin)
    # A point contact is a band of a single contact, which slips as fast as the centre.
    front = _POINT
    if rim >= MIN_SPEED:
        ratio = min(rim, speed) / max(rim, speed)
        front = _EIGHT  # fewer would not fill a vector register
        if ratio > 0.85:
            front = _MOST
        elif ratio > 0.5:
            front = _SIXTEEN
    else:
        rim = 0.0
    # Contacts at φ and π − φ slip equally fast: each represents both.
    _slips_and_factors(law, front, speed, rim, motion, push)
    drag = torque = 0.0
    for q in range(front.shape[0]):
        weight = front[q, 2] * push[CONTACT_FRICTION + q] / motion[SLIP + q]
        drag += weight * (speed - rim * front[q, 0])
        torque -= weight * (rim - speed * front[q, 0])
    return drag, torque if spin > 0.0 else -torque


@inlined
def _worn(law: Any, layer: int, x: float, y: float) -> float:
    """Return the factor on the friction at a point from the passes of bands over it."""
    rows, columns = law.tracks.shape[1], law.tracks.shape[2]
    u = min(max((y - law.track_y) / law.track_length, 0.0), rows - 1.0)
    v = min(max((x - law.track_x) / law.track_width, 0.0), columns - 1.0)
    i, j = int(u), int(v)
    i1, j1 = min(i + 1, rows - 1), min(j + 1, columns - 1)
    u, v = u - i, v - j
    near = (1.0 - v) * law.tracks[layer, i, j] + v * law.tracks[layer, i, j1]
    far = (1.0 - v) * law.tracks[layer, i1, j] + v * law.tracks[layer, i1, j1]
    return math.exp(law.wear * ((1.0 - u) * near + u * far))


@inlined
def band_on_tracks(law: Any, speed: float, spin: float, motion: Any, push: Any) -> Any:
    """Return the same as `running_band`, with the friction of the ice under each contact.

    Parameters
    ----------
    law, speed, spin, push : as in `running_band`
    motion : motion with X, Y, TRAVEL_X, TRAVEL_Y and RAN set

    Returns
    -------
    drag, left, torque : F/(μmg) against the travel and to its left, and τ/(μmgr) counter-clockwise
    """
    radius = law.band_radius
    side = 1.0 if spin > 0.0 else -1.0
    rim = radius * math.fabs(spin)
    ratio = min(rim, speed) / max(max(rim, speed), MIN_SPEED)
    front = _WORN
    if ratio > 0.85:
        front = _MOST
    elif ratio > 0.5:
        front = _SIXTEEN
    _slips_and_factors(law, front, speed, rim, motion, push)
    layer = int(motion[RAN])
    forward_x, forward_y = radius * motion[TRAVEL_X], radius * motion[TRAVEL_Y]
    drag = left = torque = 0.0
    for q in range(front.shape[0]):
        # The contacts at φ and π − φ: at the same distance to the side, ahead of the centre and
        # behind.
        aside = side * front[q, 0]
        x = motion[X] - aside * forward_y
        y = motion[Y] + aside * forward_x
        to_x, to_y = front[q, 1] * forward_x, front[q, 1] * forward_y
        ahead = _worn(law, layer, x + to_x, y + to_y)
        behind = _worn(law, layer, x - to_x, y - to_y)
        weight = 0.5 * front[q, 2] * push[CONTACT_FRICTION + q] / motion[SLIP + q]
        drag += weight * (ahead + behind) * (speed - rim * front[q, 0])
        torque -= weight * (ahead + behind) * (rim - speed * front[q, 0])
        left -= weight * (ahead - behind) * rim * front[q, 1]
    return drag, side * left, side * torque
