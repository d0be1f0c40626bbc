"""Contacts of touching stones, solved by pymunk.

The contacts and their law are those of `contacts`, whose own solver the batch engine uses; an
independent solver checks it.
"""

# pymunk's stubs leave vectors partly untyped; this is the only file that uses it. pyright:
# reportUnknownMemberType=false, reportUnknownVariableType=false pyright:
# reportUnknownArgumentType=false

from __future__ import annotations

from typing import Any

import pymunk

from curling_env.physics.contacts import (
    ContactLaw,
    Contacts,
    Entry,
    add_no_energy,
    find_contacts,
    set_apart,
)
from curling_env.physics.state import State
from curling_env.physics.tuning import CREEP, ITERATIONS
from curling_env.typing import Floats, Integers

NO_TIME = 1e-15
"""Duration too short for a stone to move [s]."""

Push = tuple[int, int, float]
"""Two stones that pushed each other, and their approach speed before [m/s]."""


def resolve_contacts(
    law: ContactLaw, states: Floats, phases: Integers, contacts: Contacts
) -> list[Push]:
    """Solve the contacts of touching stones with pymunk; return those that pushed.

    Parameters
    ----------
    states, phases, contacts : stones, status and contacts as in `find_contacts`
    """
    count = find_contacts(law, states, phases, contacts)
    if count == 0:
        return []
    if count == 1:
        pushes = [_resolve_one(law, states, contacts)]
    else:
        contacts.before[:] = states
        pushes = _resolve_many(law, states, contacts, count)
        add_no_energy(law, contacts.before, states)
    if any(speed <= CREEP for *_, speed in pushes):
        set_apart(law, states, contacts, count)
    return pushes


def _space_of(
    law: ContactLaw, states: Floats, stones: list[int], radius: float
) -> tuple[pymunk.Space, dict[Any, int]]:
    """Return a space of stones as circles, and the stone of each body.

    Two elasticities and frictions multiply to the law's. The numbering of stones does not matter.
    """
    space = pymunk.Space()
    bodies: dict[Any, int] = {}
    for k in sorted(set(stones), key=lambda k: (states[k, State.Y], states[k, State.X])):
        body = pymunk.Body(1.0, 1.0 / law.turning)
        x, y, vx, vy, body.angle, body.angular_velocity = states[k].tolist()
        body.position, body.velocity = (x, y), (vx, vy)
        circle = pymunk.Circle(body, radius)
        circle.elasticity, circle.friction = law.restitution**0.5, law.friction**0.5
        space.add(body, circle)
        bodies[body] = k
    return space, bodies


def _push(space: pymunk.Space, bodies: dict[Any, int], states: Floats, iterations: int) -> None:
    """Let the stones of a space push each other, and read their velocities."""
    space.iterations = iterations
    space.step(NO_TIME)
    for body, k in bodies.items():
        states[k, [State.VX, State.VY]] = body.velocity
        states[k, State.OMEGA] = body.angular_velocity


def _resolve_one(law: ContactLaw, states: Floats, contacts: Contacts) -> Push:
    """Solve one contact: circles that reach its point push each other there, at any gap."""
    row = contacts.order[0]
    first, second = contacts.pairs[row].tolist()
    radius = float(contacts.table[row, Entry.LEVER]) + 1e-12
    space, bodies = _space_of(law, states, [first, second], radius)
    _push(space, bodies, states, 1)
    return first, second, float(contacts.table[row, Entry.CLOSING])


def _resolve_many(law: ContactLaw, states: Floats, contacts: Contacts, count: int) -> list[Push]:
    """Solve several contacts at once, each with its own separation."""
    rows = contacts.order[:count]
    pairs = contacts.pairs[rows]
    found = dict(zip(map(frozenset, pairs.tolist()), contacts.table[rows], strict=True))
    # Enlarged by the maximum gap of touching stones.
    radius = 0.5 * (law.reach + law.touching)
    space, bodies = _space_of(law, states, pairs.ravel().tolist(), radius)
    pushes: list[Push] = []

    def prepare(arbiter: pymunk.Arbiter, _space: pymunk.Space, _data: Any) -> None:
        a, b = arbiter.bodies
        entry = found.get(frozenset((bodies[a], bodies[b])))
        if entry is None:  # they touch, but separate
            arbiter.process_collision = False
            return
        if entry[Entry.CLOSING] <= 0.0:
            arbiter.restitution = 0.0
        # Both impulses act at one point, or angular momentum would not be conserved.
        points = arbiter.contact_point_set
        middle = 0.5 * (a.position + b.position)
        points.points[0].point_a = points.points[0].point_b = middle
        arbiter.contact_point_set = points

    def note(arbiter: pymunk.Arbiter, _space: pymunk.Space, _data: Any) -> None:
        first, second = sorted(bodies[body] for body in arbiter.bodies)
        entry = found.get(frozenset((first, second)))
        if entry is not None and arbiter.total_impulse.length > 0.0:
            pushes.append((first, second, max(float(entry[Entry.CLOSING]), 0.0)))

    space.on_collision(pre_solve=prepare, post_solve=note)
    _push(space, bodies, states, ITERATIONS * count)
    return pushes
