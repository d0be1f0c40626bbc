"""Force law: a running band on per-cell friction, and a sum of effects.

The running band (the paper's equations 5–8). J contacts are on a ring of radius r, contact q at
the angle φ_q from the direction of travel, each carrying mg/J. Its velocity over the ice is

    u_q = (v − ω r sin φ_q, ω r cos φ_q)    (along travel, to its left),    s_q = |u_q|

and friction opposes it, so that

    F = −Σ μ_q (mg/J) u_q/s_q,      torque = Σ r_q × F_q.

Corrected against the printed paper: f in its equations 7–8 is the load of one contact, mg/J, and
not the weight; both components carry the minus sign (8a lacks it); γ = atan2(u_x, u_y) takes the
quadrant of the slip; and the torque of equation 6 sums r_q × F_q over the contacts.

Contacts at φ and π − φ slip equally fast, so a symmetric band's sideways forces cancel exactly and
half the ring is summed. `running_band` sums it. On worn tracks, each contact has the friction of
the ice under it.

The law is linear in the friction of the map: acceleration = μ(x, y)·P + Q, where P and Q change
smoothly along a path on any map. `law_terms` gives P and Q, so that engines can follow every cell
of a map without evaluating the effects again.
"""

from __future__ import annotations

import math
from functools import lru_cache
from itertools import accumulate
from typing import Any, NamedTuple

import numpy as np

from curling_env.errors import InputError
from curling_env.ice import Ice
from curling_env.physics.compiled import call_kernel, compiled, inlined, quick_log
from curling_env.physics.effects import catalogue
from curling_env.physics.law_table import (
    COLUMNS,
    NO_TABLE,
    as_table,
    in_table,
    look_up,
    table_states,
)
from curling_env.physics.motion import (
    ALONG,
    BEND,
    CLOCK,
    FRICTION,
    GRAVITY,
    HEADING,
    LEFT,
    LOG_SPEED,
    MOTION_SIZE,
    ORDER,
    PUSH_SIZE,
    PUSH_X,
    PUSH_Y,
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
from curling_env.physics.running_band import MIN_SPEED, band_on_tracks, running_band
from curling_env.physics.wear import wear_under_contacts
from curling_env.typing import Floats, Integers
from curling_env.worn_tracks import WornTracks

_Kernels = tuple[tuple[int, tuple[float, ...]], ...]
"""Address of each kernel, and its parameters."""
EVEN = np.ones((1, 1))
"""Placeholder map of a law for which only P and Q are needed."""
NO_BREAKS = np.empty(0)
NO_TRACKS = np.zeros((1, 1, 1))


class Law(NamedTuple):
    """Ice in the form that compiled kernels read.

    Parameters
    ----------
    band_radius : radius of the running band [m]
    turning : g·m·r/I, the factor from the sum over the band to an angular acceleration [1/s²]
    kernels : addresses of the effects' kernels: those per contact, then friction, then motion
    offsets : start of each kernel's parameters in theta
    theta : parameters of all effects
    per_contact : number of kernels that act per contact
    mu : (rows, columns) friction of the map
    patterned : true if the friction of the map varies
    bilinear : true if it is interpolated between the centres of cells
    origin_x, origin_y : first line of the map: the centre of a cell if bilinear, otherwise its edge
        [m]
    cell : distance between lines [m]
    x_breaks, y_breaks : sorted coordinates at which an effect is not smooth [m]
    table : sum of the band and the first kernels, see `law_table`; or `NO_TABLE`
    tabled : number of kernels that are in the table
    wear : change of ln μ under a contact by one pass of a stone; 0 without this effect
    tracks : (layers, rows, columns) passes over each cell; the layer is RAN of the motion
    track_x, track_y : centre of the first of these cells [m]
    track_width, track_length : their sides along x and y [m]
    """

    band_radius: float
    turning: float
    kernels: Integers
    offsets: Integers
    theta: Floats
    per_contact: int
    mu: Floats = EVEN
    patterned: bool = False
    bilinear: bool = False
    origin_x: float = 0.0
    origin_y: float = 0.0
    cell: float = 1.0
    x_breaks: Floats = NO_BREAKS
    y_breaks: Floats = NO_BREAKS
    table: Floats = NO_TABLE
    tabled: int = 0
    wear: float = 0.0
    tracks: Floats = NO_TRACKS
    track_x: float = 0.0
    track_y: float = 0.0
    track_width: float = 1.0
    track_length: float = 1.0


class Laws(NamedTuple):
    """Laws that differ in the map and in parameters of effects only.

    Parameters
    ----------
    common : the common law
    mu : (n, rows, columns) friction of each one's map
    theta : (n, m) parameters of each one's effects
    """

    common: Law
    mu: Floats
    theta: Floats


@inlined
def law_among(laws: Laws, k: int) -> Law:
    """Return the k-th of some laws."""
    one = laws.common
    return Law(
        one.band_radius,
        one.turning,
        one.kernels,
        one.offsets,
        laws.theta[k],
        one.per_contact,
        laws.mu[k],
        one.patterned,
        one.bilinear,
        one.origin_x,
        one.origin_y,
        one.cell,
        one.x_breaks,
        one.y_breaks,
        one.table,
        one.tabled,
        one.wear,
        one.tracks,
        one.track_x,
        one.track_y,
        one.track_width,
        one.track_length,
    )


def compile_law(ice: Ice, *, tabulated: bool = False) -> Law:
    """Return the force law of an ice, ready for the engines. This compiles no code.

    Parameters
    ----------
    ice : map, effects and stone
    tabulated : read the law from a table if possible. Making the table takes as long as some
        hundred throws, the first time that these effects occur

    Raises
    ------
    InputError : an effect that is not in the catalogue, or parameters its card does not allow
    """
    cards = catalogue()
    groups: dict[str, list[Any]] = {"contact_friction": [], "friction": [], "motion": []}
    x_breaks: list[float] = []
    y_breaks: list[float] = []
    for effect in ice.effects:
        card = cards.get(effect.name)
        if card is None:
            raise InputError(f"unknown effect {effect.name!r}; expected one of {', '.join(cards)}")
        if not card.is_physical:
            continue
        kernel = (card.kernel.address, tuple(card.theta(effect.parameters)))
        groups[card.acts].append((kernel, card.of_speed_and_spin))
        x_breaks += card.x_breaks(effect.parameters)
        y_breaks += card.y_breaks(effect.parameters)
    sheet, stone = ice.sheet, ice.stone
    bilinear = ice.friction.interpolation == "bilinear"
    to_line = 0.0 if bilinear else -sheet.cell_size / 2
    ordered = [entry for group in groups.values() for entry in group]
    wear = 0.0 if ice.tracks is None else wear_under_contacts(ice)
    tabulated = tabulated and wear == 0.0 and all(fits for _, fits in groups["contact_friction"])
    if tabulated:
        ordered.sort(key=lambda entry: not entry[1])  # contacts' kernels stay the first
    tabled = sum(fits for _, fits in ordered) if tabulated else 0
    kernels = tuple(kernel for kernel, _ in ordered)
    law = Law(
        band_radius=stone.band_radius,
        turning=GRAVITY * stone.mass * stone.band_radius / stone.inertia,
        per_contact=len(groups["contact_friction"]),
        **_side_by_side(kernels),
        mu=np.ascontiguousarray(ice.friction.mu, dtype=np.float64),
        patterned=not ice.friction.is_uniform,
        bilinear=bilinear,
        origin_x=float(sheet.x_centres[0]) + to_line,
        origin_y=float(sheet.y_centres[0]) + to_line,
        cell=sheet.cell_size,
        x_breaks=np.array(sorted(set(x_breaks)), dtype=np.float64),
        y_breaks=np.array(sorted(set(y_breaks)), dtype=np.float64),
        tabled=tabled,
    )
    if ice.tracks is not None and wear != 0.0:
        law = on_tracks(law, ice.tracks, ice.tracks.passes[None], wear)
    if not tabulated:
        return law
    table = _table_of(law.band_radius, law.turning, law.per_contact, kernels[:tabled])
    return law._replace(table=table)


def _side_by_side(kernels: _Kernels) -> dict[str, Any]:
    """Return the kernels of a `Law`, their parameters, and the start of each kernel's
    parameters.
    """
    sizes = [len(theta) for _, theta in kernels]
    return {
        "kernels": np.array([address for address, _ in kernels], dtype=np.int64),
        "offsets": np.array(list(accumulate(sizes, initial=0))[:-1], dtype=np.int64),
        "theta": np.array([value for _, theta in kernels for value in theta], dtype=np.float64),
    }


def on_tracks(law: Law, tracks: WornTracks, layers: Floats, wear: float) -> Law:
    """Return a law in which earlier stones' tracks act on contacts.

    Parameters
    ----------
    law : law of the ice without tracks
    tracks : the cells
    layers : (layers, rows, columns) passes over each cell
    wear : change of ln μ by one pass
    """
    (x, y), (width, length) = tracks.origin, tracks.spacing
    return law._replace(
        wear=wear, tracks=layers, track_x=x, track_y=y, track_width=width, track_length=length
    )


@inlined
def patch_of(law: Law, i: int, j: int) -> Any:
    """Return the friction between line i and i + 1 across rows, j and j + 1 across columns.

    Beyond the map the friction of the nearest cell holds.

    Returns
    -------
    base, across, along, twist : μ = base + across·v + along·u + twist·u·v at the fractions u of a
        cell beyond line i and v beyond line j
    """
    rows, columns = law.mu.shape
    i0 = min(max(i, 0), rows - 1)
    j0 = min(max(j, 0), columns - 1)
    base = law.mu[i0, j0]
    if not law.bilinear:
        return base, 0.0, 0.0, 0.0
    i1 = min(max(i + 1, 0), rows - 1)
    j1 = min(max(j + 1, 0), columns - 1)
    across = law.mu[i0, j1] - base
    along = law.mu[i1, j0] - base
    return base, across, along, law.mu[i1, j1] - base - across - along


@inlined
def mu_in(patch: Any, u: float, v: float) -> float:
    """Return the friction in a `patch_of` the map, at the fractions u along and v across it."""
    base, across, along, twist = patch
    return base + across * v + along * u + twist * u * v


@inlined
def mu_of_map(law: Law, x: float, y: float) -> float:
    """Return the friction of the map at a point of the sheet frame; the nearest cell beyond its
    edges.
    """
    u = (y - law.origin_y) / law.cell
    v = (x - law.origin_x) / law.cell
    i, j = math.floor(u), math.floor(v)
    return mu_in(patch_of(law, i, j), u - i, v - j)


@inlined
def law_terms(
    law: Law,
    motion: Any,
    push: Any,
    x: float,
    y: float,
    vx: float,
    vy: float,
    spin: float,
    terms: Any,
) -> None:
    """Return the law at one state, apart from the map: P and Q of acceleration = μ·P + Q.

    Parameters
    ----------
    law : the ice
    motion : (MOTION_SIZE,) work array; the caller sets HEADING, T, CLOCK, ORDER, STONE and SWEPT,
        this function the rest
    push : (PUSH_SIZE,) work array for the effects' output
    x, y, vx, vy, spin : state in the sheet frame [m, m/s, rad/s]
    terms : (6,) filled in: P along x, along y and of the spin, then Q likewise [m/s², rad/s²]
    """
    speed = math.sqrt(vx * vx + vy * vy)
    travel_x = vx / max(speed, MIN_SPEED)
    travel_y = vy / max(speed, MIN_SPEED)
    first = law.per_contact
    drag = aside = torque = along = sideways = turn = 0.0
    tabled = in_table(law.table, speed, spin)
    if tabled:
        drag, torque, along, sideways, turn = look_up(law.table, speed, spin)
        first = law.tabled
    if not tabled or first < law.kernels.shape[0]:
        motion[X], motion[Y] = x, y
        motion[SPEED] = speed
        motion[LOG_SPEED] = quick_log(max(speed, MIN_SPEED))
        motion[TRAVEL_X], motion[TRAVEL_Y] = travel_x, travel_y
        motion[SPIN] = spin
    if law.wear != 0.0:
        drag, aside, torque = band_on_tracks(law, speed, spin, motion, push)
    elif not tabled:
        drag, torque = running_band(law, speed, spin, motion, push)
    push[FRICTION] = push[BEND] = 1.0
    push[ALONG], push[LEFT], push[TURN] = along, sideways, turn
    push[PUSH_X] = push[PUSH_Y] = 0.0
    for k in range(first, law.kernels.shape[0]):
        call_kernel(law.kernels[k], motion, law.theta, law.offsets[k], push)
    brake = -GRAVITY * push[FRICTION] * drag
    left = push[LEFT] * push[BEND]
    aside *= GRAVITY * push[FRICTION]
    terms[0] = brake * travel_x - aside * travel_y
    terms[1] = brake * travel_y + aside * travel_x
    terms[2] = law.turning * push[FRICTION] * torque
    terms[3] = push[ALONG] * travel_x - left * travel_y + push[PUSH_X]
    terms[4] = push[ALONG] * travel_y + left * travel_x + push[PUSH_Y]
    terms[5] = push[TURN]


@inlined
def accelerate(
    law: Law,
    motion: Any,
    push: Any,
    terms: Any,
    x: float,
    y: float,
    vx: float,
    vy: float,
    spin: float,
) -> Any:
    """Return the acceleration of a stone under the law; parameters as in `law_terms`.

    Returns
    -------
    ax, ay : [m/s²], sheet frame
    turn : angular acceleration [rad/s²]
    """
    law_terms(law, motion, push, x, y, vx, vy, spin, terms)
    mu = mu_of_map(law, x, y)
    return mu * terms[0] + terms[3], mu * terms[1] + terms[4], mu * terms[2] + terms[5]


@compiled
def _tabulate(
    law: Law, speeds: Any, spins: Any, motion: Any, push: Any, terms: Any, out: Any
) -> Any:
    """Fill in the table's columns at every node; return whether no kernel acts in another way."""
    plain = True
    for i in range(speeds.shape[0]):
        for j in range(spins.shape[0]):
            law_terms(law, motion, push, 0.0, 0.0, 0.0, speeds[i], spins[j], terms)
            out[i, j, 0] = -terms[1] / GRAVITY
            out[i, j, 1] = terms[2] / law.turning if law.turning > 0.0 else 0.0
            out[i, j, 2], out[i, j, 3], out[i, j, 4] = terms[4], -terms[3], terms[5]
            plain = plain and push[BEND] == 1.0 and push[PUSH_X] == 0.0 and push[PUSH_Y] == 0.0
    return plain


@lru_cache(maxsize=16)
def _table_of(band_radius: float, turning: float, per_contact: int, kernels: _Kernels) -> Floats:
    """Return the table of these kernels; `NO_TABLE` if one of them has other outputs."""
    law = Law(
        band_radius=band_radius,
        turning=turning,
        per_contact=per_contact,
        **_side_by_side(kernels),
    )
    speeds, spins = table_states()
    values = np.empty((len(speeds), len(spins), COLUMNS))
    work = np.zeros(MOTION_SIZE), np.empty(PUSH_SIZE), np.empty(6)
    plain = _tabulate(law, speeds, spins, *work, values)
    return as_table(values) if plain else NO_TABLE


@compiled
def _force(law: Law, motion: Any, push: Any, terms: Any, states: Any, out: Any) -> None:
    for i in range(states.shape[0]):
        x, y, vx, vy, spin = states[i]
        out[i, 0], out[i, 1], out[i, 2] = accelerate(law, motion, push, terms, x, y, vx, vy, spin)


def acceleration(
    ice: Ice,
    states: Floats,
    *,
    heading: float = 0.0,
    t: float = 0.0,
    clock: float = 0.0,
    order: int = 0,
    stone: int = 0,
    swept: bool = False,
) -> Floats:
    """Return the acceleration under the law for given states, to plot or test the law.

    Parameters
    ----------
    ice : map, effects and stone
    states : (n, 5) x, y, vx, vy, spin in the sheet frame [m, m/s, rad/s]
    heading, t, clock, order, stone, swept : further inputs of effects, the same for every state

    Returns
    -------
    (n, 3) ax, ay [m/s²] and angular acceleration [rad/s²]
    """
    motion = np.zeros(MOTION_SIZE)
    motion[[HEADING, T, CLOCK, ORDER, STONE, SWEPT]] = heading, t, clock, order, stone, swept
    out = np.empty((len(states), 3))
    states = np.ascontiguousarray(states, dtype=np.float64)
    _force(compile_law(ice), motion, np.empty(PUSH_SIZE), np.empty(6), states, out)
    return out
