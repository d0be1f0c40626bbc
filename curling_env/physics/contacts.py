"""Law of contacts: contacts of stones, their separation, and the joint solution of all contacts.

Stones that touch and do not separate form a group. When two of a group approach each other, all
contacts of the group are solved together: those that approach separate with their restitution,
those that only touch do not approach, no push pulls, and friction at the rims acts against the
slip, at most in proportion to the push. These are Newton's restitution and Coulomb's friction as
constraints on the velocities. The batch engine solves them here, by Gauss-Seidel sweeps; the other
engine uses pymunk for the same contacts (`pymunk_contacts`), so that each checks the other. Both
impulses of a contact act at one point, so that momentum and angular momentum are conserved. If
friction and restitution of several contacts together add energy, all impulses are scaled down until
they do not.

Impulses are per mass. A push acts along the line of centres, a rub along the rims.

Source
------
J. J. Moreau, "Unilateral contact and dry friction in finite freedom dynamics" (1988). Box2D, with
which Digital Curling's server plays, solves the contacts of a time step in the same way.
"""

# Work arrays come untyped through compiled code: values read from them are unknown, not wrong.
# pyright: reportUnknownVariableType=false, reportUnknownArgumentType=false

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from curling_env.physics.compiled import compiled, inlined
from curling_env.physics.state import State
from curling_env.physics.tuning import (
    CREEP,
    CREEP_OVERLAP,
    ENERGY_ROUNDING,
    MAX_SHIFT,
    MAX_SWEEPS,
    OVERLAPPING_CREEP,
    SOLVED,
    SPACE,
    TOUCHING,
)
from curling_env.sheet import Stone
from curling_env.typing import Floats, Integers

GONE = 2
"""Status of a stone that has left play, in both engines."""


class ContactLaw(NamedTuple):
    """Parameters of the contacts of stones."""

    reach: float
    """Distance between two centres in contact [m]."""
    restitution: float
    friction: float
    """Coulomb friction between two rims."""
    turning: float
    """Mass over moment of inertia [1/m²]."""
    touching: float
    """Gap below which stones touch [m]."""


def contact_law(stone: Stone, *, touching: float = TOUCHING) -> ContactLaw:
    """Return the law for stones of this kind, which touch at a gap of up to `touching` [m]."""
    return ContactLaw(
        touching=touching,
        reach=2 * stone.radius,
        restitution=stone.restitution,
        friction=stone.stone_friction,
        turning=stone.mass / stone.inertia,
    )


class _Entries(NamedTuple):
    """Columns of the table of contacts."""

    NX: int = 0
    """Direction from the first centre to the second."""
    NY: int = 1
    LEVER: int = 2
    """Distance of the point of contact from both centres [m]."""
    CLOSING: int = 3
    """Approach speed of the stones [m/s]."""
    X: int = 4
    """Position of the contact, doubled [m]."""
    Y: int = 5
    PUSH: int = 6
    """Impulse along the line of centres, per mass [m/s]."""
    RUB: int = 7
    """Impulse along the rims, per mass [m/s]."""


Entry = _Entries()


class Contacts(NamedTuple):
    """Contacts among n stones, and the arrays for finding and solving them.

    Parameters
    ----------
    pairs : (m, 2) indices of two touching stones
    table : (m, 8) as in `Entry`
    order : (m,) rows of the contacts to be solved, the nearest to the home end first, so that the
        result does not depend on the numbering of the stones
    joined : (n,) true if a stone belongs to a group in which two stones approach
    before : (n, 6) states before a solution
    """

    pairs: Integers
    table: Floats
    order: Integers
    joined: Integers
    before: Floats


def new_contacts(stones: int) -> Contacts:
    """Allocate the contacts among a number of stones."""
    pairs = max(stones * (stones - 1) // 2, 1)
    return Contacts(
        pairs=np.zeros((pairs, 2), dtype=np.int64),
        table=np.zeros((pairs, len(Entry))),
        order=np.zeros(pairs, dtype=np.int64),
        joined=np.zeros(stones, dtype=np.int64),
        before=np.zeros((stones, 6)),
    )


@inlined
def collides(gap: float, closing: float) -> bool:
    """Return whether touching stones approach too fast to be ignored [m, m/s]."""
    return closing > (CREEP if gap > -CREEP_OVERLAP else OVERLAPPING_CREEP)


@compiled
def find_contacts(law: ContactLaw, stones: Any, status: Any, contacts: Contacts) -> int:
    """Find the contacts of every group of touching stones in which two approach each other.

    Touching stones that separate are in no contact. If the push of others makes them approach, they
    are found the next time.

    Parameters
    ----------
    stones : (n, 6) states
    status : (n,) status of each stone, GONE if out of play
    contacts : filled in

    Returns
    -------
    number of contacts; their rows come first in `order`
    """
    pairs, table, order, joined = contacts.pairs, contacts.table, contacts.order, contacts.joined
    n = stones.shape[0]
    far = law.reach + law.touching
    found = 0
    for a in range(n):
        joined[a] = 0
    for a in range(n):
        if status[a] == GONE:
            continue
        for b in range(a + 1, n):
            one, other = stones[a], stones[b]
            dx = other[State.X] - one[State.X]
            dy = other[State.Y] - one[State.Y]
            square = dx * dx + dy * dy
            if status[b] == GONE or square > far * far or square == 0.0:
                continue
            distance = math.sqrt(square)
            nx, ny = dx / distance, dy / distance
            closing = (one[State.VX] - other[State.VX]) * nx
            closing += (one[State.VY] - other[State.VY]) * ny
            if closing < -CREEP:
                continue
            row = table[found]
            row[Entry.NX], row[Entry.NY] = nx, ny
            row[Entry.LEVER] = 0.5 * distance
            row[Entry.CLOSING] = closing
            row[Entry.X] = one[State.X] + other[State.X]
            row[Entry.Y] = one[State.Y] + other[State.Y]
            row[Entry.PUSH] = row[Entry.RUB] = 0.0
            pairs[found, 0], pairs[found, 1] = a, b
            found += 1
            # A lower speed than makes stones collide, so that every collision is found here.
            if closing > 0.5 * OVERLAPPING_CREEP:
                joined[a] = joined[b] = 1
    grows = True
    while grows:
        grows = False
        for k in range(found):
            a, b = pairs[k, 0], pairs[k, 1]
            if joined[a] != joined[b]:
                joined[a] = joined[b] = 1
                grows = True
    count = 0
    for k in range(found):
        if joined[pairs[k, 0]] == 0:
            continue
        here = table[k, Entry.Y], table[k, Entry.X]
        place = count
        while place > 0:
            last = order[place - 1]
            if (table[last, Entry.Y], table[last, Entry.X]) <= here:
                break
            order[place] = last
            place -= 1
        order[place] = k
        count += 1
    return count


@compiled
def solve_contacts(law: ContactLaw, stones: Any, contacts: Contacts, count: int) -> None:
    """Set the velocities and spins of stones (n, 6) after the contacts that were found."""
    pairs, table, order, before = contacts.pairs, contacts.table, contacts.order, contacts.before
    fastest = 0.0
    for s in range(stones.shape[0]):
        for c in range(6):
            before[s, c] = stones[s, c]
    for place in range(count):
        fastest = max(fastest, table[order[place], Entry.CLOSING])
    for _ in range(MAX_SWEEPS):
        largest = 0.0
        for place in range(count):
            k = order[place]
            row, a, b = table[k], stones[pairs[k, 0]], stones[pairs[k, 1]]
            nx, ny, lever = row[Entry.NX], row[Entry.NY], row[Entry.LEVER]
            closing = (a[State.VX] - b[State.VX]) * nx + (a[State.VY] - b[State.VY]) * ny
            wanted = row[Entry.PUSH] + 0.5 * (
                closing + law.restitution * max(row[Entry.CLOSING], 0.0)
            )
            push = max(wanted, 0.0) - row[Entry.PUSH]
            row[Entry.PUSH] += push
            slip = (a[State.VY] - b[State.VY]) * nx - (a[State.VX] - b[State.VX]) * ny
            slip += lever * (a[State.OMEGA] + b[State.OMEGA])
            turning = law.turning * lever
            wanted = row[Entry.RUB] + slip / (2.0 + 2.0 * turning * lever)
            most = law.friction * row[Entry.PUSH]
            rub = min(max(wanted, -most), most) - row[Entry.RUB]
            row[Entry.RUB] += rub
            a[State.VX] -= push * nx - rub * ny
            a[State.VY] -= push * ny + rub * nx
            b[State.VX] += push * nx - rub * ny
            b[State.VY] += push * ny + rub * nx
            a[State.OMEGA] -= turning * rub
            b[State.OMEGA] -= turning * rub
            largest = max(largest, abs(push), abs(rub))
        if count == 1 or largest <= SOLVED * fastest:
            break
    if count > 1:  # one contact alone adds none
        add_no_energy(law, before, stones)


@compiled
def set_apart(law: ContactLaw, stones: Any, contacts: Contacts, count: int) -> None:
    """Move creeping stones a few micrometres apart, those of them that move.

    Friction may press them together for seconds. They would meet again immediately, without end.
    """
    for place in range(count):
        k = contacts.order[place]
        row = contacts.table[k]
        shift = min(SPACE - (2.0 * row[Entry.LEVER] - law.reach), MAX_SHIFT)
        if row[Entry.CLOSING] > CREEP or shift <= 0.0:
            continue
        a, b = stones[contacts.pairs[k, 0]], stones[contacts.pairs[k, 1]]
        a_moves = a[State.VX] != 0.0 or a[State.VY] != 0.0
        b_moves = b[State.VX] != 0.0 or b[State.VY] != 0.0
        if a_moves and b_moves:
            shift *= 0.5
        for stone, moves, away in ((a, a_moves, -shift), (b, b_moves, shift)):
            if moves:
                stone[State.X] += away * row[Entry.NX]
                stone[State.Y] += away * row[Entry.NY]


@compiled
def add_no_energy(law: ContactLaw, before: Any, after: Any) -> None:
    """Scale the change from `before` to `after`, both (n, 6), until it adds no energy.

    The energy is a parabola in the share of all impulses that acts. Stones that separate after all
    of them may still approach after a smaller share; they then collide once more.
    """
    first = second = energy = 0.0
    for s in range(after.shape[0]):
        for c in (State.VX, State.VY, State.OMEGA):
            weight = 1.0 / law.turning if c == State.OMEGA else 1.0
            change = after[s, c] - before[s, c]
            first += weight * 2.0 * before[s, c] * change
            second += weight * change * change
            energy += weight * before[s, c] * before[s, c]
    if first + second > ENERGY_ROUNDING * energy:
        share = max(-first / second, 0.0)
        for s in range(after.shape[0]):
            for c in (State.VX, State.VY, State.OMEGA):
                after[s, c] = before[s, c] + share * (after[s, c] - before[s, c])
