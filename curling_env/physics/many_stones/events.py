"""A throw among other stones, from event to event.

Every moving stone slides as if alone until it rests, leaves the bounds or meets a resting stone;
the first time at which two moving stones meet is found on their paths. The contacts that are there
at the earliest of these times are solved together (`contacts`), and the moving stones slide on. So
a resting stone costs nothing until something comes near it, and no time step limits how exactly a
hit stands.
"""

# Work arrays come untyped through compiled code: what is read from them is unknown, not wrong.
# pyright: reportUnknownVariableType=false, reportUnknownArgumentType=false

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from curling_env.ice import Ice
from curling_env.physics.compiled import inlined, part
from curling_env.physics.law import Law
from curling_env.physics.many_stones.contacts import (
    GONE,
    ContactLaw,
    Contacts,
    Entry,
    collides,
    find_contacts,
    new_contacts,
    set_apart,
    solve_contacts,
)
from curling_env.physics.many_stones.tuning import (
    APPROACH,
    CONTACT_GAP,
    MAX_COLLISIONS,
)
from curling_env.physics.motion import MOTION_SIZE, STONE
from curling_env.physics.one_stone.integrate import Delivery, Sampling, SlideEnd, integrate
from curling_env.physics.one_stone.slide_table import slide_from_table
from curling_env.physics.one_stone.step import Workspace, new_workspace
from curling_env.physics.one_stone.surroundings import Limits, free_time, greatest_acceleration
from curling_env.physics.one_stone.tuning import (
    MAX_TIME,
    QUICK_TOLERANCE,
    StepControl,
    step_control,
)
from curling_env.physics.state import NODE_SIZE, Node, State
from curling_env.physics.tuning import CREEP, CREEP_TIME, MAX_ROUNDS
from curling_env.typing import Floats, Integers

REST, MOVING = 0, 1
"""What a stone is doing; or it is GONE."""


class PlayWorkspace(NamedTuple):
    """The arrays in which one throw among n stones is played.

    Parameters
    ----------
    stones : (n, 6) states
    status : (n,) REST, MOVING or GONE
    contacts : in which contacts are found and solved
    resting : (n, 2) centres of the stones at rest
    paths : (n, nodes, NODE_SIZE) of the moving stones
    lengths : (n,) number of nodes of each path; 0 for one that is not known
    ends : (n,) `SlideEnd` of each path
    motion : (MOTION_SIZE,)
    sampling : without samples
    work : of one slide
    approach : of the delivered stone among others up to its first contact, which is finer
    """

    stones: Floats
    status: Integers
    contacts: Contacts
    resting: Floats
    paths: Floats
    lengths: Integers
    ends: Integers
    motion: Floats
    sampling: Sampling
    work: Workspace
    approach: Workspace


def new_play_workspace(ice: Ice, stones: int, tolerance: float = QUICK_TOLERANCE) -> PlayWorkspace:
    """The arrays for one thread; the rest of a lone stone is right within the tolerance [m]."""
    rows, columns = ice.friction.mu.shape
    work = new_workspace(tolerance)
    nodes = 512 + 4 * (rows + columns)
    return PlayWorkspace(
        stones=np.zeros((stones, 6)),
        status=np.zeros(stones, dtype=np.int64),
        contacts=new_contacts(stones),
        resting=np.zeros((stones, 2)),
        paths=np.zeros((stones, nodes, NODE_SIZE)),
        lengths=np.zeros(stones, dtype=np.int64),
        ends=np.zeros(stones, dtype=np.int64),
        motion=np.zeros(MOTION_SIZE),
        sampling=Sampling(1.0, np.zeros((0, 4))),
        work=work,
        approach=work._replace(control=_approach_control(tolerance)),
    )


def _approach_control(tolerance: float) -> StepControl:
    """Steps that are finer on the way, but not where the stone comes to rest by itself."""
    usual = step_control(tolerance)
    return step_control(APPROACH * tolerance)._replace(
        target_error=APPROACH * usual.target_error, rest_speed=usual.rest_speed
    )


@inlined
def _place(path: Any, length: int, k: int, t: float) -> Any:
    """Node before time t, position and velocity then; at rest at its last place after the end."""
    while k < length - 2 and path[k + 1, Node.T] <= t:
        k += 1
    last = path[length - 1]
    if k >= length - 1 or t >= last[Node.T]:
        return k, last[Node.X], last[Node.Y], 0.0, 0.0
    a, b = path[k], path[k + 1]
    h = b[Node.T] - a[Node.T]
    tau = t - a[Node.T]
    # Between nodes friction hardly changes: a cubic through places and velocities.
    u = tau / h
    x, vx = _cubic(a[Node.X], a[Node.VX], b[Node.X], b[Node.VX], h, u)
    y, vy = _cubic(a[Node.Y], a[Node.VY], b[Node.Y], b[Node.VY], h, u)
    return k, x, y, vx, vy


@inlined
def _cubic(p0: float, v0: float, p1: float, v1: float, h: float, u: float) -> Any:
    d = p1 - p0 - h * v0
    e = h * (v1 - v0)
    c2 = 3.0 * d - e
    c3 = e - 2.0 * d
    return p0 + u * (h * v0 + u * (c2 + u * c3)), v0 + u * (2.0 * c2 + 3.0 * u * c3) / h


@inlined
def _meeting_time(
    paths: Any, lengths: Any, ends: Any, a: int, b: int, reach: float, within: Any
) -> float:
    """When two moving stones first touch while approaching, infinite if they do not [s].

    Parameters
    ----------
    paths, lengths, ends : as in `PlayWorkspace`
    within : the times between which to look [s]
    """
    start, until = within
    first, second = paths[a], paths[b]
    n, m = lengths[a], lengths[b]
    most = greatest_acceleration(first, n) + greatest_acceleration(second, m)
    t = start
    if ends[a] == SlideEnd.LEFT_BOUNDS:
        until = min(until, first[n - 1, Node.T])
    if ends[b] == SlideEnd.LEFT_BOUNDS:
        until = min(until, second[m - 1, Node.T])
    until = min(until, max(first[n - 1, Node.T], second[m - 1, Node.T]))
    j = k = 0
    while t < until:
        j, ax, ay, avx, avy = _place(first, n, j, t)
        k, bx, by, bvx, bvy = _place(second, m, k, t)
        dx = bx - ax
        dy = by - ay
        dvx = bvx - avx
        dvy = bvy - avy
        gap = math.sqrt(dx * dx + dy * dy) - reach
        closing = -(dx * dvx + dy * dvy) / (gap + reach)
        least = 0.0
        if gap < CONTACT_GAP:
            if collides(gap, closing):
                return t
            gap = CONTACT_GAP
            least = CREEP_TIME if closing > -CREEP else 0.0
        t += max(least, free_time(gap, closing, most))
    return np.inf


@inlined
def _advance(stone: Any, path: Any, n: int, end: int, t: float) -> int:
    """Take a moving stone to time t on its path of n nodes; returns its status then."""
    if t >= path[n - 1, Node.T]:
        for c in range(6):
            stone[c] = path[n - 1, Node.X + c]
        if end == SlideEnd.REST:
            return REST
        return GONE if end == SlideEnd.LEFT_BOUNDS else MOVING
    k, x, y, vx, vy = _place(path, n, 0, t)
    a, b = path[k], path[k + 1]
    h = b[Node.T] - a[Node.T]
    u = (t - a[Node.T]) / h
    stone[State.THETA], stone[State.OMEGA] = _cubic(
        a[Node.THETA], a[Node.OMEGA], b[Node.THETA], b[Node.OMEGA], h, u
    )
    stone[State.X] = x
    stone[State.Y] = y
    stone[State.VX] = vx
    stone[State.VY] = vy
    return MOVING


@inlined
def _resolve(
    contact: ContactLaw, stones: Any, status: Any, contacts: Contacts, lengths: Any
) -> int:
    """Solve the contacts of touching stones until none closes; returns how many pushed."""
    pushes = 0
    for _ in range(MAX_ROUNDS):
        count = find_contacts(contact, stones, status, contacts)
        if count == 0:
            break
        pushes += solve_contacts(contact, stones, contacts, count)
        set_apart(contact, stones, contacts, count)
        for place in range(count):
            row = contacts.order[place]
            if contacts.table[row, Entry.PUSH] > 0.0:
                lengths[contacts.pairs[row, 0]] = 0
                lengths[contacts.pairs[row, 1]] = 0
    for s in range(stones.shape[0]):
        moves = (
            stones[s, State.VX] != 0.0
            or stones[s, State.VY] != 0.0
            or stones[s, State.OMEGA] != 0.0
        )
        if status[s] == REST and moves:
            status[s] = MOVING
    return pushes


@part
def play(
    law: Law,
    contact: ContactLaw,
    position: PlayWorkspace,
    count: int,
    identity: Any,
    delivery: Delivery,
    bounds: Any,
    slides: Any,
) -> Any:
    """Let a throw among other stones run until all are at rest.

    Parameters
    ----------
    law, contact : the ice, and how its stones push each other
    position : stones[:count] and status[:count] are given, the thrown stone last and MOVING, and
        motion with ORDER set; stones and status become the final ones
    count : number of stones
    identity : (count,) identifiers of the stones, for effects that depend on them
    delivery : clock, and sweep of the thrown stone
    bounds : (4,) x_min, x_max, y_min, y_max of centres [m]; a stone beyond is out of play
    slides : the table of slides, see `slide_table`; None to follow each step by step

    Returns
    -------
    time : until the last stone rests [s]
    collisions : their number; MAX_COLLISIONS + 1 if they never ended or a stone never stops
    """
    t = 0.0
    collisions = 0
    work = position.work
    paths, lengths, ends = position.paths, position.lengths, position.ends
    for s in range(count):
        position.lengths[s] = 0
        if position.status[s] == REST:
            work = position.approach
    thrown = count - 1
    while True:
        resting = 0
        moving = 0
        for s in range(count):
            if position.status[s] == REST:
                position.resting[resting, 0] = position.stones[s, State.X]
                position.resting[resting, 1] = position.stones[s, State.Y]
                resting += 1
            elif position.status[s] == MOVING:
                moving += 1
        if moving == 0:
            return t, collisions
        limits = Limits(bounds, position.resting[:resting], contact.reach, MAX_TIME)
        until = np.inf
        latest = t
        for s in range(count):
            if position.status[s] != MOVING:
                continue
            if position.lengths[s] > 0:
                latest = max(latest, position.paths[s, position.lengths[s] - 1, Node.T])
                continue
            for c in range(6):
                position.work.states[2, c] = position.stones[s, c]
            position.motion[STONE] = identity[s]
            sweep_start = delivery.sweep_start if s == thrown else 0.0
            sweep_end = delivery.sweep_end if s == thrown else 0.0
            own = Delivery(delivery.clock, sweep_start, sweep_end)
            # Where only one stone moves, its path is not needed.
            path = position.paths[s] if moving > 1 else position.paths[s, :0]
            if slides is None:
                end, at, _, length = integrate(
                    law, position.motion, own, limits, position.sampling, path, t, work
                )
            else:
                end, at, _, length = slide_from_table(
                    slides, law, position.motion, own, limits, position.sampling, path, t, work
                )
            if end == SlideEnd.NEVER_STOPS or length > position.paths.shape[1]:
                return at, MAX_COLLISIONS + 1
            if length == 0:
                position.paths[s, 0, Node.T] = at
                for c in range(6):
                    position.paths[s, 0, Node.X + c] = position.work.states[2, c]
                for c in (Node.AX, Node.AY, Node.ALPHA):
                    position.paths[s, 0, c] = 0.0
                length = 1
            position.ends[s] = end
            position.lengths[s] = length
            latest = max(latest, at)
            if end == SlideEnd.CONTACT:
                until = min(until, at)
        if moving > 1:
            for a in range(count):
                for b in range(a + 1, count):
                    if position.status[a] == MOVING and position.status[b] == MOVING:
                        met = _meeting_time(paths, lengths, ends, a, b, contact.reach, (t, until))
                        until = min(until, met)
        t = min(until, latest)
        rested = False
        for s in range(count):
            if position.status[s] == MOVING:
                stone, path = position.stones[s], position.paths[s]
                position.status[s] = _advance(stone, path, lengths[s], ends[s], t)
                rested = rested or position.status[s] == REST
        if until == np.inf:
            continue
        # The path of a stone that nothing pushes goes on, unless what it would meet is other now.
        for s in range(count):
            if rested or position.ends[s] == SlideEnd.CONTACT:
                position.lengths[s] = 0
        stones, status = position.stones, position.status
        pushes = _resolve(contact, stones, status, position.contacts, lengths)
        collisions += max(pushes, 1)
        work = position.work
        if collisions > MAX_COLLISIONS:
            return t, collisions
