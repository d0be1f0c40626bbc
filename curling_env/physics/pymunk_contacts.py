"""The contacts of touching stones, solved by pymunk.

Which contacts there are and what they do is the law of `contacts`, whose own solver the batch
engine uses; a solver of other people's making checks it. A pymunk space is made of the stones that
touch, steps for no time worth the name, and hands back velocities. It never moves anything.
"""

# pymunk's stubs leave vectors partly untyped; this is the one file that talks to it.
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false
# pyright: reportUnknownArgumentType=false

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
"""Too short for a stone to move [s]."""

Push = tuple[int, int, float]
"""Two stones that pushed each other, and their closing speed before [m/s]."""


def resolve_contacts(
    law: ContactLaw, states: Floats, phases: Integers, contacts: Contacts
) -> list[Push]:
    """Let pymunk solve the contacts of touching stones, as `solve_contacts` does.

    Parameters
    ----------
    law : how stones push each other
    states : (n, 6) as in `State`
    phases : (n,) whether each is GONE
    contacts : room for their contacts

    Returns
    -------
    the contacts that pushed
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


def _add_stone(
    space: pymunk.Space, law: ContactLaw, state: list[float], radius: float
) -> pymunk.Body:
    """A stone in its state, as a circle; two elasticities and frictions multiply to the law's."""
    body = pymunk.Body(1.0, 1.0 / law.turning)
    x, y, vx, vy, theta, omega = state
    body.position, body.velocity = (x, y), (vx, vy)
    body.angle, body.angular_velocity = theta, omega
    circle = pymunk.Circle(body, radius)
    circle.elasticity, circle.friction = law.restitution**0.5, law.friction**0.5
    space.add(body, circle)
    return body


def _by_place(states: Floats, stones: list[int]) -> list[int]:
    """The stones in an order that does not depend on how they are numbered."""
    return sorted(set(stones), key=lambda k: (states[k, State.Y], states[k, State.X]))


def _take_back(states: Floats, k: int, body: pymunk.Body) -> None:
    states[k, [State.VX, State.VY]] = body.velocity
    states[k, State.OMEGA] = body.angular_velocity


def _resolve_one(law: ContactLaw, states: Floats, contacts: Contacts) -> Push:
    """One contact: circles that reach its point push each other there, whatever the gap."""
    row = int(contacts.order[0])
    pair = _by_place(states, contacts.pairs[row].tolist())
    entry = contacts.table[row]
    space = pymunk.Space()
    space.iterations = 1
    radius = float(entry[Entry.LEVER]) + 1e-12
    bodies = [_add_stone(space, law, states[k].tolist(), radius) for k in pair]
    space.step(NO_TIME)
    for k, body in zip(pair, bodies, strict=True):
        _take_back(states, k, body)
    return min(pair), max(pair), float(entry[Entry.CLOSING])


def _resolve_many(law: ContactLaw, states: Floats, contacts: Contacts, count: int) -> list[Push]:
    """Several contacts at once, each told how it parts."""
    rows = contacts.order[:count]
    found = {
        frozenset(pair): row
        for pair, row in zip(contacts.pairs[rows].tolist(), contacts.table[rows], strict=True)
    }
    space = pymunk.Space()
    space.iterations = ITERATIONS * count
    bodies: dict[Any, int] = {}
    for k in _by_place(states, contacts.pairs[rows].ravel().tolist()):
        # As much larger as touching stones may be apart.
        bodies[_add_stone(space, law, states[k].tolist(), 0.5 * (law.reach + law.touching))] = k
    pushes: list[Push] = []

    def prepare(arbiter: pymunk.Arbiter, _space: pymunk.Space, _data: Any) -> None:
        a, b = arbiter.bodies
        entry = found.get(frozenset((bodies[a], bodies[b])))
        if entry is None:  # they touch, but part
            arbiter.process_collision = False
            return
        if entry[Entry.CLOSING] <= 0.0:
            arbiter.restitution = 0.0
        # Both impulses act at one point, or angular momentum would not be kept.
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
    space.step(NO_TIME)
    for body, k in bodies.items():
        _take_back(states, k, body)
    return pushes
