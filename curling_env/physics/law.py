"""The one force law: a running band on per-cell friction, and a sum of effects.

The running band (the paper's equations 5–8). J contacts stand on a ring of radius r, contact q at
the angle φ_q from the direction of travel, each carrying mg/J. Its velocity over the ice is

    u_q = (v − ω r sin φ_q, ω r cos φ_q)    (along travel, to its left),    s_q = |u_q|

and friction opposes it, so that

    F = −Σ μ_q (mg/J) u_q/s_q,      torque = Σ r_q × F_q.

Corrected against the printed paper: f in its equations 7–8 is the load of one contact, mg/J, and
not the weight; both components carry the minus sign (8a lacks it); γ = atan2(u_x, u_y) takes the
quadrant of the slip; and the torque of equation 6 sums r_q × F_q over the contacts.

Contacts at φ and π − φ slip equally fast, so a symmetric band's sideways forces cancel exactly and
half the ring is summed. The sum is a trapezoid rule on a smooth periodic function: its error falls
as (rω/v)^J, so few contacts suffice while the stone slides fast and all of them are used as it
stops.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import fabs, log, sqrt
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from curling_env.errors import InputError
from curling_env.ice import Ice
from curling_env.physics.compiled import call_kernel, compiled, inlined
from curling_env.physics.effects import catalogue
from curling_env.physics.effects.motion import (
    ALONG,
    BEND,
    CLOCK,
    FRICTION,
    GRAVITY,
    HEADING,
    LEFT,
    LOG_SLIP,
    LOG_SPEED,
    MOTION_SIZE,
    ORDER,
    PUSH_SIZE,
    PUSH_X,
    PUSH_Y,
    SLIP,
    SPEED,
    SPIN,
    STONE,
    SWEPT,
    TRAVEL_X,
    TRAVEL_Y,
    TURN,
    T,
    X,
    Y,
)

SLOWEST = 1e-9
"""Speeds below this are treated as this in directions and logarithms [m/s]."""

CONTACTS = 32
"""Contacts of the band, J; 10 to 100 pebbles carry a stone. All are summed as it stops."""


def _front_half(contacts: int) -> NDArray[np.float64]:
    """Sine and cosine of φ for the contacts ahead of the centre, (contacts/2, 2)."""
    phi = 2 * np.pi * (np.arange(contacts // 2) + 0.5) / contacts - np.pi / 2
    return np.column_stack([np.sin(phi), np.cos(phi)])


_FOUR, _EIGHT, _SIXTEEN = _front_half(4), _front_half(8), _front_half(16)
_ALL = _front_half(CONTACTS)

MEASUREMENT_EFFECTS = frozenset(
    {"tracking_offset", "lens_distortion", "frame_rate_error", "scale_error", "unknown"}
)
"""Names an ice file may carry that change what a camera reports, not how a stone slides."""


class Law(NamedTuple):
    """An ice as the compiled kernels read it.

    Parameters
    ----------
    mu : (rows, columns) friction of the map
    first_x, first_y : centre of cell (0, 0) [m]
    cell : side of a cell [m]
    bilinear : whether the map is interpolated between cell centres
    band_radius : of the running band [m]
    turning : g·mr/I, so that the torque of friction turns the stone by turning·Σ… [1/s²]
    kernels : addresses of the effects' kernels, per contact first, then friction, then motion
    offsets : where each kernel's parameters begin in theta
    theta : parameters of all effects
    per_contact, per_state : how many kernels act per contact, and once per state on friction
    x_breaks, y_breaks : sorted coordinates at which the law is not smooth [m]
    """

    mu: NDArray[np.float64]
    first_x: float
    first_y: float
    cell: float
    bilinear: bool
    band_radius: float
    turning: float
    kernels: NDArray[np.int64]
    offsets: NDArray[np.int64]
    theta: NDArray[np.float64]
    per_contact: int
    per_state: int
    x_breaks: NDArray[np.float64]
    y_breaks: NDArray[np.float64]


def compile_law(ice: Ice) -> Law:
    """The force law of an ice, ready for the engines. No code is compiled for it.

    Raises
    ------
    InputError : an effect that is not in the catalogue, or parameters its card does not allow
    """
    cards = catalogue()
    groups: dict[str, list[Any]] = {"contact_friction": [], "friction": [], "motion": []}
    x_breaks: list[float] = []
    y_breaks: list[float] = []
    for effect in ice.effects:
        if effect.name in MEASUREMENT_EFFECTS:
            continue
        card = cards.get(effect.name)
        if card is None:
            raise InputError(f"unknown effect {effect.name!r}; known are {', '.join(cards)}")
        groups[card.acts].append((card.kernel.address, card.theta(effect.parameters)))
        x_breaks += card.x_breaks(effect.parameters)
        y_breaks += card.y_breaks(effect.parameters)
    sheet, stone = ice.sheet, ice.stone
    if not ice.friction.is_uniform:
        x_breaks += _map_breaks(sheet.x_centres, sheet.cell_size, ice.friction.interpolation)
        y_breaks += _map_breaks(sheet.y_centres, sheet.cell_size, ice.friction.interpolation)
    ordered = [entry for group in groups.values() for entry in group]
    sizes = [len(theta) for _, theta in ordered]
    return Law(
        mu=np.ascontiguousarray(ice.friction.mu),
        first_x=float(sheet.x_centres[0]),
        first_y=float(sheet.y_centres[0]),
        cell=sheet.cell_size,
        bilinear=ice.friction.interpolation == "bilinear",
        band_radius=stone.band_radius,
        turning=GRAVITY * stone.mass * stone.band_radius / stone.inertia,
        kernels=np.array([address for address, _ in ordered], dtype=np.int64),
        offsets=np.concatenate([[0], np.cumsum(sizes)]).astype(np.int64)[: len(sizes)],
        theta=np.array([value for _, theta in ordered for value in theta], dtype=np.float64),
        per_contact=len(groups["contact_friction"]),
        per_state=len(groups["friction"]),
        x_breaks=np.unique(np.array(x_breaks, dtype=np.float64)),
        y_breaks=np.unique(np.array(y_breaks, dtype=np.float64)),
    )


def _map_breaks(centres: Sequence[float], cell: float, interpolation: str) -> list[float]:
    """Where the map bends (bilinear: at cell centres) or jumps (cell: at their edges) [m]."""
    lines = np.asarray(centres)
    return list(lines if interpolation == "bilinear" else lines[1:] - cell / 2)


@inlined
def mu_of_map(law: Law, x: float, y: float) -> float:
    """Friction of the map at a point of the sheet frame; the nearest cell beyond its edges."""
    rows, columns = law.mu.shape
    row = (y - law.first_y) / law.cell
    column = (x - law.first_x) / law.cell
    if not law.bilinear:
        i = min(max(int(np.floor(row + 0.5)), 0), rows - 1)
        j = min(max(int(np.floor(column + 0.5)), 0), columns - 1)
        return law.mu[i, j]
    row = min(max(row, 0.0), rows - 1.0)
    column = min(max(column, 0.0), columns - 1.0)
    i = min(int(row), max(rows - 2, 0))
    j = min(int(column), max(columns - 2, 0))
    i1 = min(i + 1, rows - 1)
    j1 = min(j + 1, columns - 1)
    u = row - i
    v = column - j
    near = law.mu[i, j] + v * (law.mu[i, j1] - law.mu[i, j])
    far = law.mu[i1, j] + v * (law.mu[i1, j1] - law.mu[i1, j])
    return near + u * (far - near)


@inlined
def _contact_factor(law: Law, slip: float, motion: Any, push: Any) -> float:
    """Factor on μ for a contact that slides at `slip` [m/s]."""
    if law.per_contact == 0:
        return 1.0
    motion[SLIP] = slip
    motion[LOG_SLIP] = log(slip)
    push[FRICTION] = 1.0
    for k in range(law.per_contact):
        call_kernel(law.kernels[k], motion, law.theta, law.offsets[k], push)
    return push[FRICTION]


@inlined
def _sum_contacts(law: Law, front: Any, speed: float, rim: float, motion: Any, push: Any) -> Any:
    """Drag and torque summed over contacts in pairs at φ and π − φ."""
    drag = 0.0
    torque = 0.0
    n = front.shape[0]
    for q in range(n):
        sine = front[q, 0]
        along = speed - rim * sine
        across = rim * front[q, 1]
        slip = max(sqrt(along * along + across * across), SLOWEST)
        weight = _contact_factor(law, slip, motion, push) / (slip * n)
        drag += weight * along
        torque -= weight * (rim - speed * sine)
    return drag, torque


@inlined
def running_band(law: Law, speed: float, spin: float, motion: Any, push: Any) -> Any:
    """Mean drag and torque of the band's contacts, per unit μ and load.

    Parameters
    ----------
    law : the ice
    speed : of the centre [m/s]
    spin : counter-clockwise positive [rad/s]
    motion, push : work arrays of MOTION_SIZE and PUSH_SIZE

    Returns
    -------
    drag, torque : F/(μmg) against the travel and τ/(μmgr) counter-clockwise
    """
    rim = law.band_radius * spin
    if fabs(rim) < SLOWEST:
        slip = max(speed, SLOWEST)
        return _contact_factor(law, slip, motion, push) * speed / slip, 0.0
    rim_speed = fabs(rim)
    ratio = min(rim_speed, speed) / max(rim_speed, speed)
    if ratio < 0.1:
        return _sum_contacts(law, _FOUR, speed, rim, motion, push)
    if ratio < 0.4:
        return _sum_contacts(law, _EIGHT, speed, rim, motion, push)
    if ratio < 0.7:
        return _sum_contacts(law, _SIXTEEN, speed, rim, motion, push)
    return _sum_contacts(law, _ALL, speed, rim, motion, push)


@inlined
def accelerate(
    law: Law, motion: Any, push: Any, x: float, y: float, vx: float, vy: float, spin: float
) -> Any:
    """Acceleration of a stone under the law.

    Parameters
    ----------
    law : the ice
    motion : (MOTION_SIZE,) work array; HEADING, T, CLOCK, ORDER, STONE and SWEPT are set by the
        caller, the rest here
    push : (PUSH_SIZE,) work array
    x, y, vx, vy, spin : state in the sheet frame [m, m/s, rad/s]

    Returns
    -------
    ax, ay : [m/s²], sheet frame
    turn : angular acceleration [rad/s²]
    """
    speed = sqrt(vx * vx + vy * vy)
    if speed > SLOWEST:
        travel_x = vx / speed
        travel_y = vy / speed
    else:
        travel_x = 0.0
        travel_y = 1.0
    motion[X] = x
    motion[Y] = y
    motion[SPEED] = speed
    motion[LOG_SPEED] = log(max(speed, SLOWEST))
    motion[TRAVEL_X] = travel_x
    motion[TRAVEL_Y] = travel_y
    motion[SPIN] = spin
    drag, torque = running_band(law, speed, spin, motion, push)
    push[FRICTION] = 1.0
    push[BEND] = 1.0
    push[ALONG] = 0.0
    push[LEFT] = 0.0
    push[TURN] = 0.0
    push[PUSH_X] = 0.0
    push[PUSH_Y] = 0.0
    for k in range(law.per_contact, law.kernels.shape[0]):
        call_kernel(law.kernels[k], motion, law.theta, law.offsets[k], push)
    mu = mu_of_map(law, x, y) * push[FRICTION]
    along = push[ALONG] - GRAVITY * mu * drag
    left = push[LEFT] * push[BEND]
    return (
        along * travel_x - left * travel_y + push[PUSH_X],
        along * travel_y + left * travel_x + push[PUSH_Y],
        push[TURN] + law.turning * mu * torque,
    )


@compiled
def _force(law: Law, motion: Any, states: Any, out: Any) -> None:
    push = np.empty(PUSH_SIZE)
    for i in range(states.shape[0]):
        out[i, 0], out[i, 1], out[i, 2] = accelerate(
            law, motion, push, states[i, 0], states[i, 1], states[i, 2], states[i, 3], states[i, 4]
        )


def acceleration(
    ice: Ice,
    states: NDArray[np.float64],
    *,
    heading: float = 0.0,
    t: float = 0.0,
    clock: float = 0.0,
    order: int = 0,
    stone: int = 0,
    swept: bool = False,
) -> NDArray[np.float64]:
    """Acceleration under the law for given states: to look at the law, plot it or test it.

    Parameters
    ----------
    ice : map, effects and stone
    states : (n, 5) x, y, vx, vy, spin in the sheet frame [m, m/s, rad/s]
    heading, t, clock, order, stone, swept : the rest of the motion, the same for every state

    Returns
    -------
    (n, 3) ax, ay [m/s²] and angular acceleration [rad/s²]
    """
    motion = np.zeros(MOTION_SIZE)
    motion[[HEADING, T, CLOCK, ORDER, STONE, SWEPT]] = heading, t, clock, order, stone, swept
    out = np.empty((len(states), 3))
    _force(compile_law(ice), motion, np.ascontiguousarray(states, dtype=np.float64), out)
    return out
