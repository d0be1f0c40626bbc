"""Time steps of Digital Curling's server: 1 ms each, in single precision.

Law and contacts are the project's own. Three things are the server's: a velocity is advanced before
the position (semi-implicit steps), contacts are found at the ends of steps, up to 4 mm late, and
positions and velocities are rounded to single precision. Together they are worth 3 mm on a draw,
and each further contact magnifies that some ten times. The engines are closer to the law, this is
closer to the server.
"""

# Work arrays come untyped through compiled code: values read from them are unknown, not wrong.
# pyright: reportUnknownVariableType=false, reportUnknownArgumentType=false

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from curling_env.ice import Ice
from curling_env.physics.compiled import compiled, inlined
from curling_env.physics.contacts import (
    GONE,
    ContactLaw,
    Contacts,
    Entry,
    contact_law,
    find_contacts,
    new_contacts,
    solve_contacts,
)
from curling_env.physics.law import Law, accelerate, compile_law
from curling_env.physics.motion import MOTION_SIZE, PUSH_SIZE
from curling_env.physics.state import State
from curling_env.sheet import BACK_LINE_Y, TEE_Y
from curling_env.typing import Flags, Floats, Integers

EPSILON = 1.1920929e-07
"""Smallest number that changes 1 in single precision; the server's measure of rest."""
BACK_BOARD_Y = TEE_Y + 4.877
"""Distance of the boards behind the houses from mid-sheet, which stop a stone thrown backwards
[m].
"""
MAX_TIME = 180.0
"""Maximum simulated time, after which stones are taken as they are [s]; the server has no limit."""


class StepWorkspace(NamedTuple):
    """Work arrays of a step.

    Parameters
    ----------
    motion, push, terms : work arrays of the law
    contacts : contacts among the stones
    pushed : (n,) true if a stone was ever pushed
    """

    motion: Floats
    push: Floats
    terms: Floats
    contacts: Contacts
    pushed: Integers


@dataclass(frozen=True, kw_only=True)
class Rest:
    """Final states of the stones of a shot, the delivered one last.

    Parameters
    ----------
    stones : (n, 6) final states, sheet frame, as in `State`
    gone : (n,) true if a stone left play
    pushed : (n,) true if a stone touched another
    """

    stones: Floats
    gone: Flags
    pushed: Flags


@inlined(fastmath=False)
def _single(value: float) -> float:
    """Round a number to single precision."""
    return float(np.float32(value))


@inlined(fastmath=False)
def _slow(law: Law, work: StepWorkspace, s: Any, dt: float) -> None:
    """Advance velocity and spin by one step, each operation rounded like the server's."""
    vx, vy, spin = s[State.VX], s[State.VY], s[State.OMEGA]
    if vx == 0.0 and vy == 0.0 and spin == 0.0:
        return
    speed = _single(math.sqrt(_single(_single(vx * vx) + _single(vy * vy))))
    ax, ay, turn = accelerate(
        law, work.motion, work.push, work.terms, s[State.X], s[State.Y], vx, vy, spin
    )
    if speed > EPSILON:
        share = _single(1.0 / speed)
        along_x, along_y = _single(vx * share), _single(vy * share)
        after = _single(speed + _single(_single(ax * along_x + ay * along_y) * dt))
        if after <= 0.0:
            s[State.VX] = s[State.VY] = 0.0
        else:
            yaw = _single(_single((ay * along_x - ax * along_y) / speed) * dt)
            ahead = _single(after * _single(math.cos(yaw)))
            left = _single(after * _single(math.sin(yaw)))
            s[State.VX] = _single(_single(ahead * along_x) - _single(left * along_y))
            s[State.VY] = _single(_single(ahead * along_y) + _single(left * along_x))
    if math.fabs(spin) > EPSILON:
        change = _single(_single(turn) * dt)
        if math.fabs(spin) <= math.fabs(change):
            s[State.OMEGA] = 0.0
        else:
            s[State.OMEGA] = _single(spin + change)


@inlined(fastmath=False)
def _push(contact: ContactLaw, work: StepWorkspace, stones: Any, status: Any) -> None:
    """Solve the contacts of stones that overlap."""
    contacts = work.contacts
    count = find_contacts(contact, stones, status, contacts)
    if count == 0:
        return
    solve_contacts(contact, stones, contacts, count)
    for place in range(count):
        k = contacts.order[place]
        if contacts.table[k, Entry.PUSH] > 0.0:
            work.pushed[contacts.pairs[k, 0]] = 1
            work.pushed[contacts.pairs[k, 1]] = 1
    for s in range(stones.shape[0]):
        for c in (State.VX, State.VY, State.OMEGA):
            stones[s, c] = _single(stones[s, c])


@compiled(fastmath=False)
def _run(
    law: Law,
    contact: ContactLaw,
    work: StepWorkspace,
    stones: Any,
    status: Any,
    bounds: Any,
    dt: float,
) -> None:
    """Step until all stones rest; stones (n, 6) and status (n,) become the final ones."""
    n = stones.shape[0]
    for _ in range(int(MAX_TIME / dt)):
        moves = False
        for s in range(n):
            x, y = stones[s, State.X], stones[s, State.Y]
            if not (bounds[0] < x < bounds[1] and bounds[2] < y < bounds[3]):
                status[s] = GONE
            if status[s] != GONE:
                vx, vy = stones[s, State.VX], stones[s, State.VY]
                if vx * vx + vy * vy > EPSILON or stones[s, State.OMEGA] > EPSILON:
                    moves = True
        if not moves:
            return
        for s in range(n):
            if status[s] != GONE:
                _slow(law, work, stones[s], dt)
        _push(contact, work, stones, status)
        for s in range(n):
            if status[s] != GONE:
                for c in range(2):
                    step = _single(dt * stones[s, State.VX + c])
                    stones[s, State.X + c] = _single(stones[s, State.X + c] + step)
                turn = _single(dt * stones[s, State.OMEGA])
                stones[s, State.THETA] = _single(stones[s, State.THETA] + turn)


def run_steps(ice: Ice, stones: Floats, *, seconds_per_frame: float = 0.001) -> Rest:
    """Let stones slide and collide in the server's steps until all rest.

    Parameters
    ----------
    ice : the ice, of the preset `fcv1`
    stones : (n, 6) states, sheet frame, as in `State`; play is towards +y
    seconds_per_frame : length of a step [s]
    """
    n = len(stones)
    states = stones.astype(np.float32).astype(np.float64)
    stone, half = ice.stone, ice.sheet.width / 2
    radius = float(np.float32(stone.radius))
    law = contact_law(stone, touching=0.0)._replace(reach=2 * radius)
    bounds = np.array([radius - half, half - radius, radius - BACK_BOARD_Y, BACK_LINE_Y + radius])
    status = np.zeros(n, dtype=np.int64)
    work = StepWorkspace(
        motion=np.zeros(MOTION_SIZE),
        push=np.zeros(PUSH_SIZE),
        terms=np.zeros(6),
        contacts=new_contacts(n),
        pushed=np.zeros(n, dtype=np.int64),
    )
    dt = float(np.float32(seconds_per_frame))
    _run(compile_law(ice), law, work, states, status, bounds, dt)
    return Rest(stones=states, gone=status == GONE, pushed=work.pushed > 0)
