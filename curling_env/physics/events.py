"""Throw among other stones, from event to event.

Every moving stone slides as if alone until it rests, leaves the bounds or meets a resting stone;
the first time at which two moving stones meet is found on their paths. The contacts at the earliest
of these times are solved together (`contacts`), and the moving stones slide on. So a resting stone
costs nothing until a stone approaches it, and no time step limits the accuracy of a hit.
"""

# Work arrays come untyped through compiled code: values read from them are unknown, not wrong.
# pyright: reportUnknownVariableType=false, reportUnknownArgumentType=false

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from curling_env.ice import Ice
from curling_env.physics.compiled import compiled, inlined, part
from curling_env.physics.contacts import (
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
from curling_env.physics.integrator import SlideEnd, ThrowTimes, append_state, integrate
from curling_env.physics.law import Law
from curling_env.physics.map_path import sample_path
from curling_env.physics.motion import MOTION_SIZE, STONE
from curling_env.physics.state import NODE_SIZE, Node, State
from curling_env.physics.step import Workspace, new_workspace
from curling_env.physics.surroundings import Limits, free_time, max_acceleration
from curling_env.physics.tuning import (
    APPROACH,
    CREEP,
    CREEP_TIME,
    MAX_COLLISIONS,
    MAX_ROUNDS,
    MAX_TIME,
    MEETING_GAP,
    QUICK_TOLERANCE,
    step_control,
)
from curling_env.typing import Floats, Integers

REST, MOVING = 0, 1
"""Values of a stone's status, in addition to GONE."""


class PlayWorkspace(NamedTuple):
    """Work arrays for one throw among n stones, the thrown one last.

    Parameters
    ----------
    stones : (n, 6) states
    status : (n,) REST, MOVING or GONE
    identity : (n,) identifiers of the stones, for effects that depend on them
    contacts : arrays for finding and solving contacts
    resting : (n, 2) centres of the stones at rest
    paths : (n, nodes, NODE_SIZE) of the moving stones
    lengths : (n,) number of nodes of each path; 0 for an unknown one
    ends : (n,) `SlideEnd` of each path
    accelerations : (n,) bounds of the acceleration on each path [m/s²]
    finished : (n,) times at which stones came to rest or left play [s]; 0 for one that never moved
    motion : (MOTION_SIZE,)
    """

    stones: Floats
    status: Integers
    identity: Floats
    contacts: Contacts
    resting: Floats
    paths: Floats
    lengths: Integers
    ends: Integers
    accelerations: Floats
    finished: Floats
    motion: Floats


def new_play_workspace(
    ice: Ice, stones: int, tolerance: float = QUICK_TOLERANCE
) -> tuple[PlayWorkspace, Workspace, Workspace]:
    """Allocate the arrays for one thread; the rest of a lone stone is accurate to the tolerance
    [m].

    Returns
    -------
    the arrays of a throw, those of a slide, and the same with finer steps for the delivered stone
    among others, up to its first contact
    """
    nodes = 512 + 4 * sum(ice.friction.mu.shape)
    usual = step_control(tolerance)
    # Finer along the path, but not where the stone comes to rest undisturbed.
    fine = step_control(APPROACH * tolerance)._replace(
        target_error=APPROACH * usual.target_error, rest_speed=usual.rest_speed
    )
    work = new_workspace(tolerance)
    position = PlayWorkspace(
        stones=np.zeros((stones, 6)),
        status=np.zeros(stones, dtype=np.int64),
        identity=np.zeros(stones),
        contacts=new_contacts(stones),
        resting=np.zeros((stones, 2)),
        paths=np.zeros((stones, nodes, NODE_SIZE)),
        lengths=np.zeros(stones, dtype=np.int64),
        ends=np.zeros(stones, dtype=np.int64),
        accelerations=np.zeros(stones),
        finished=np.zeros(stones),
        motion=np.zeros(MOTION_SIZE),
    )
    return position, work, work._replace(control=fine)


@inlined
def _place(path: Any, length: int, k: int, t: float) -> Any:
    """Return the node before time t, from k on, and position and velocity then; at rest after the
    path's end.
    """
    while k < length - 2 and path[k + 1, Node.T] <= t:
        k += 1
    last = path[length - 1]
    if k >= length - 1 or t >= last[Node.T]:
        return k, last[Node.X], last[Node.Y], 0.0, 0.0
    a, b = path[k], path[k + 1]
    h = b[Node.T] - a[Node.T]
    u = (t - a[Node.T]) / h
    x, vx = _cubic(a[Node.X], a[Node.VX], b[Node.X], b[Node.VX], h, u)
    y, vy = _cubic(a[Node.Y], a[Node.VY], b[Node.Y], b[Node.VY], h, u)
    return k, x, y, vx, vy


@inlined
def _cubic(p0: float, v0: float, p1: float, v1: float, h: float, u: float) -> Any:
    """Return position and velocity at share u of the time h between nodes, with nearly constant
    friction.
    """
    d = p1 - p0 - h * v0
    e = h * (v1 - v0)
    c2 = 3.0 * d - e
    c3 = e - 2.0 * d
    return p0 + u * (h * v0 + u * (c2 + u * c3)), v0 + u * (2.0 * c2 + 3.0 * u * c3) / h


@inlined
def _meeting_time(one: Any, other: Any, most: float, reach: float, within: Any) -> float:
    """Return the time within two limits at which moving stones first touch and approach; infinite
    if never [s].

    Parameters
    ----------
    one, other : path, its number of nodes, and its `SlideEnd`
    most : bound of the sum of their accelerations [m/s²]
    """
    t, until = within
    first, n, end = one
    second, m, other_end = other
    first_end, second_end = first[n - 1, Node.T], second[m - 1, Node.T]
    if end == SlideEnd.LEFT_BOUNDS:
        until = min(until, first_end)
    if other_end == SlideEnd.LEFT_BOUNDS:
        until = min(until, second_end)
    until = min(until, max(first_end, second_end))
    j = k = 0
    while t < until:
        j, ax, ay, avx, avy = _place(first, n, j, t)
        k, bx, by, bvx, bvy = _place(second, m, k, t)
        dx, dy, dvx, dvy = bx - ax, by - ay, bvx - avx, bvy - avy
        gap = math.sqrt(dx * dx + dy * dy) - reach
        closing = -(dx * dvx + dy * dvy) / (gap + reach)
        least = 0.0
        if gap < MEETING_GAP:
            if collides(gap, closing):
                return t
            gap = MEETING_GAP
            least = CREEP_TIME if closing > -CREEP else 0.0
        t += max(least, free_time(gap, closing, most))
    return np.inf


@inlined
def _advance(stone: Any, path: Any, n: int, end: int, t: float) -> int:
    """Move a stone to time t on its path of n nodes; return its status then."""
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
    stone[State.X], stone[State.Y], stone[State.VX], stone[State.VY] = x, y, vx, vy
    return MOVING


@part
def advance(
    law: Law,
    reach: float,
    position: PlayWorkspace,
    delivery: ThrowTimes,
    bounds: Any,
    start: float,
    work: Workspace,
    traced: bool,
) -> Any:
    """Let stones slide until two of them touch, or all are at rest or out of play.

    Each moving stone has a separate path, as if alone among the resting ones. A path that is
    undisturbed since the last contact continues.

    Parameters
    ----------
    start : time since release [s]
    traced : keep the path of a stone that moves alone as well

    Returns
    -------
    pause : CONTACT, REST, or NEVER_STOPS
    t : time of the pause [s]
    """
    paths, lengths, ends = position.paths, position.lengths, position.ends
    stones, status, n = position.stones, position.status, position.stones.shape[0]
    resting = moving = 0
    for s in range(n):
        if status[s] == REST:
            position.resting[resting, 0] = stones[s, State.X]
            position.resting[resting, 1] = stones[s, State.Y]
            resting += 1
        elif status[s] == MOVING:
            moving += 1
    if moving == 0:
        return SlideEnd.REST, start
    limits = Limits(bounds, position.resting[:resting], reach, MAX_TIME)
    until, latest = np.inf, start
    for s in range(n):
        if status[s] != MOVING:
            continue
        if lengths[s] > 0:
            latest = max(latest, paths[s, lengths[s] - 1, Node.T])
            continue
        for c in range(6):
            work.states[2, c] = stones[s, c]
        position.motion[STONE] = position.identity[s]
        sweep_start = delivery.sweep_start if s == n - 1 else 0.0
        sweep_end = delivery.sweep_end if s == n - 1 else 0.0
        own = ThrowTimes(delivery.clock, sweep_start, sweep_end)
        path = paths[s] if moving > 1 or traced else paths[s, :0]
        end, at, length = integrate(law, position.motion, own, limits, path, start, work)
        if end == SlideEnd.NEVER_STOPS or length > paths.shape[1]:
            return SlideEnd.NEVER_STOPS, at
        if length == 0:
            append_state(paths[s], 0, work.states[2], at, (0.0, 0.0, 0.0))
            length = 1
        ends[s] = end
        lengths[s] = length
        if moving > 1:
            position.accelerations[s] = max_acceleration(paths[s], length)
        latest = max(latest, at)
        if end == SlideEnd.CONTACT:
            until = min(until, at)
    for a in range(n):
        for b in range(a + 1, n):
            if status[a] == MOVING and status[b] == MOVING:
                most = position.accelerations[a] + position.accelerations[b]
                one, other = (paths[a], lengths[a], ends[a]), (paths[b], lengths[b], ends[b])
                until = min(until, _meeting_time(one, other, most, reach, (start, until)))
    t = min(until, latest)
    for s in range(n):
        if status[s] == MOVING:
            status[s] = _advance(stones[s], paths[s], lengths[s], ends[s], t)
            if status[s] != MOVING:
                position.finished[s] = paths[s, lengths[s] - 1, Node.T]
    return (SlideEnd.REST if until == np.inf else SlideEnd.CONTACT), t


@part
def update_after_contacts(stones: Any, status: Any, lengths: Any, ends: Any, finished: Any) -> None:
    """Update after contacts which stones move, and which paths have changed.

    The path of a stone that is not pushed continues, unless its next obstacle has changed. The
    parameters are those of `PlayWorkspace`.
    """
    rested = False
    for s in range(stones.shape[0]):
        rested = rested or (status[s] == REST and lengths[s] > 0)
    for s in range(stones.shape[0]):
        if rested or ends[s] == SlideEnd.CONTACT or status[s] != MOVING:
            lengths[s] = 0
        stone = stones[s]
        moves = stone[State.VX] != 0.0 or stone[State.VY] != 0.0 or stone[State.OMEGA] != 0.0
        if status[s] == REST and moves:
            status[s] = MOVING
            finished[s] = 0.0


@compiled
def advance_and_sample(
    law: Law,
    reach: float,
    position: PlayWorkspace,
    delivery: ThrowTimes,
    bounds: Any,
    start: float,
    work: Workspace,
    dt: float,
    count: int,
    samples: Any,
) -> Any:
    """Run `advance`, and sample the paths; also return the number of samples.

    Parameters
    ----------
    dt : time between samples [s]
    count : number of samples already filled in
    samples : (stones, m, 3) filled in with x, y and heading at the times k·dt; m = 0 for none
    """
    traced, first = samples.shape[1] > 0, count
    pause, t = advance(law, reach, position, delivery, bounds, start, work, traced)
    while count < samples.shape[1] and count * dt <= t:
        count += 1
    for s in range(samples.shape[0]):
        stone, length = position.stones[s], position.lengths[s]
        for k in range(first, count):
            samples[s, k, 0] = stone[State.X]
            samples[s, k, 1] = stone[State.Y]
            samples[s, k, 2] = stone[State.THETA]
        if length > 0 and traced:
            sample_path(position.paths[s], length, dt, first, t, work.probe, samples[s])
    return pause, t, count


@inlined
def _resolve(
    contact: ContactLaw, stones: Any, status: Any, lengths: Any, contacts: Contacts
) -> int:
    """Solve the contacts of touching stones until none approaches; return the number of pushes."""
    pushes = 0
    for _ in range(MAX_ROUNDS):
        count = find_contacts(contact, stones, status, contacts)
        if count == 0:
            break
        solve_contacts(contact, stones, contacts, count)
        set_apart(contact, stones, contacts, count)
        for place in range(count):
            row = contacts.order[place]
            if contacts.table[row, Entry.PUSH] > 0.0:
                pushes += 1
                lengths[contacts.pairs[row, 0]] = 0
                lengths[contacts.pairs[row, 1]] = 0
    return pushes


@part
def play(
    law: Law,
    contact: ContactLaw,
    position: PlayWorkspace,
    usual: Workspace,
    approach: Workspace,
    delivery: ThrowTimes,
    bounds: Any,
) -> Any:
    """Run a throw among other stones until all are at rest.

    Parameters
    ----------
    position : stones, status and identity are given, the thrown stone MOVING, and motion with ORDER
        set; stones and status become the final ones
    usual, approach : see `new_play_workspace`
    delivery : clock, and sweep of the thrown stone
    bounds : (4,) x_min, x_max, y_min, y_max of centres [m]; a stone beyond is out of play

    Returns
    -------
    time : time until the last stone rests [s]
    collisions : their number; -1 if they never ended or a stone never stops
    """
    stones, status, lengths = position.stones, position.status, position.lengths
    t, collisions, work = 0.0, 0, usual
    for s in range(stones.shape[0]):
        lengths[s] = 0
        position.finished[s] = 0.0
        if status[s] == REST:
            work = approach
    while collisions <= MAX_COLLISIONS:
        pause, t = advance(law, contact.reach, position, delivery, bounds, t, work, False)
        if pause == SlideEnd.REST:
            return t, collisions
        if pause == SlideEnd.NEVER_STOPS:
            break
        collisions += max(_resolve(contact, stones, status, lengths, position.contacts), 1)
        update_after_contacts(stones, status, lengths, position.ends, position.finished)
        work = usual
    return t, -1
