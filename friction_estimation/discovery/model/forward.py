"""Predicted paths of all throws of a session at the times at which they were measured.

Each stone slides by the integrator of the physics, `integrate`, on separate ice: the map with the
factor of its throw and the wear of earlier stones, and the pushes of an unknown effect as one more
effect of the law. A fit calls this some thousand times per session. Steps are short enough for
paths to change smoothly with every parameter, so that finite differences are accurate.
"""

from __future__ import annotations

from math import exp
from typing import Any, NamedTuple

import numpy as np

from curling_env.physics.compiled import compiled, effect_kernel, inlined, quick_exp
from curling_env.physics.integrator import NEVER_STOPS, ThrowTimes, integrate
from curling_env.physics.law import Law, law_terms, mu_of_map
from curling_env.physics.map_path import between_nodes
from curling_env.physics.motion import (
    CLOCK,
    FRICTION,
    HEADING,
    MOTION_SIZE,
    ORDER,
    PUSH_X,
    PUSH_Y,
    RAN,
    STONE,
    SWEPT,
    TRAVEL_X,
    TRAVEL_Y,
    TURN,
    T,
)
from curling_env.physics.slides import NO_OBSTACLES
from curling_env.physics.state import NODE_SIZE, Node, State
from curling_env.physics.step import Workspace, new_workspace
from curling_env.physics.surroundings import Limits
from curling_env.physics.tuning import StepControl
from curling_env.typing import Floats, Indices
from friction_estimation.discovery.data.session import UnknownPushes

STEPS = StepControl(
    target_error=1e-6,
    relative_error=1e-7,
    first_share=0.01,
    longest_share=0.06,
    rest_speed=3e-3,
)
"""Steps after which paths are right to some micrometres."""
STEPS_ON_TRACKS = STEPS._replace(target_error=1e-3, relative_error=1e-4, longest_share=0.05)
"""Steps for wear under contacts, where the law is rough. A step is repeated there only after an
error of centimetres: fixed steps give smoother derivatives than adaptive ones."""
NODES = 2_000
"""Initial capacity of a path in nodes."""
MAX_OFFSET_OF_POINT = 300.0
"""Distance along either axis at which a diverging stone of a trial step is stopped [m]."""


class Wear(NamedTuple):
    """Wear by earlier stones along their paths.

    Parameters
    ----------
    passes : (p + 1, rows, columns) passes over each cell of the law's map by the first 0, 1, ... p
        stones
    along_path : change of ln μ by one pass
    """

    passes: Floats
    along_path: float


class ThrowInputs(NamedTuple):
    """Inputs of the throws of a session, except fitted parameters.

    Parameters
    ----------
    orders, stones, clocks : (k,) throws played before, stone, and session time of the release [s]
    ran : (k,) number of stones that had worn the ice before
    swept_first : (k,) whether the stone is swept at first, 0 or 1
    switches : times at which sweeping begins or ends [s]
    switch_starts : (k+1,) index of the first switch of each throw
    times : (rows,) measured times [s]
    starts : (k+1,) index of the first time of each throw
    pushes : what something unknown does to the stones
    """

    orders: Indices
    stones: Indices
    clocks: Floats
    ran: Indices
    swept_first: Floats
    switches: Floats
    switch_starts: Indices
    times: Floats
    starts: Indices
    pushes: UnknownPushes


class _Slides(NamedTuple):
    """Work arrays for the throws of a session, because compiled code allocates none.

    Parameters
    ----------
    motion : (MOTION_SIZE,) what effects read
    limits : what ends a slide before the stone rests: bounds far off
    path : (m, NODE_SIZE) nodes of a path
    step : arrays in which one stone slides
    """

    motion: Floats
    limits: Limits
    path: Floats
    step: Workspace


def _slides(law: Law, nodes: int) -> _Slides:
    """Return the arrays for a law, with room for a number of nodes of a path."""
    control = STEPS if law.wear == 0.0 else STEPS_ON_TRACKS
    return _Slides(
        motion=np.zeros(MOTION_SIZE),
        limits=Limits(MAX_OFFSET_OF_POINT * np.array([-1.0, 1.0, -1.0, 1.0]), NO_OBSTACLES, 0.0),
        path=np.empty((nodes, NODE_SIZE)),
        step=new_workspace()._replace(control=control),
    )


# --- a separate law for every throw --------------------------------------------------------------


@effect_kernel
def _unknown(motion: Any, theta: Any, push: Any) -> None:
    """Apply the pushes of an unknown effect: theta has their number, spacing and sizes."""
    last = theta[0] - 1.0
    if last < 1.0:
        return
    place = min(max(motion[T] / theta[1], 0.0), last)
    i = int(min(place, last - 1.0))
    u = place - i
    a = 2 + 4 * i
    b = a + 4
    push[FRICTION] *= exp((1.0 - u) * theta[a] + u * theta[b])
    left = (1.0 - u) * theta[a + 1] + u * theta[b + 1]
    push[PUSH_X] += (1.0 - u) * theta[a + 2] + u * theta[b + 2] - left * motion[TRAVEL_Y]
    push[PUSH_Y] += left * motion[TRAVEL_X]
    push[TURN] += (1.0 - u) * theta[a + 3] + u * theta[b + 3]


def _own_law(law: Law, wear: Wear, pushes: UnknownPushes) -> Law:
    """Return a law with room for the map of each throw and the pushes of an unknown effect."""
    rows, columns = law.mu.shape if wear.along_path == 0.0 else wear.passes.shape[1:]
    law = law._replace(
        mu=np.empty((rows, columns)), patterned=law.patterned or wear.along_path != 0.0
    )
    if len(pushes.sizes) == 0:
        return law
    room = np.zeros(2 + 4 * int(np.diff(pushes.starts).max()))
    return law._replace(
        kernels=np.append(law.kernels, _unknown.address),
        offsets=np.append(law.offsets, len(law.theta)),
        theta=np.concatenate([law.theta, room]),
    )


@inlined
def _fill_in(law: Any, mu: Any, wear: Any, factor: float, throws: Any, throw: int) -> None:
    """Set a law to that of a throw."""
    if wear.along_path == 0.0:
        for i in range(mu.shape[0]):
            for j in range(mu.shape[1]):
                law.mu[i, j] = factor * mu[i, j]
    else:
        passes = wear.passes[throws.ran[throw]]
        for i in range(passes.shape[0]):
            for j in range(passes.shape[1]):
                law.mu[i, j] = factor * mu[i, j]
                if passes[i, j] != 0.0:
                    law.mu[i, j] *= quick_exp(wear.along_path * passes[i, j])
    pushes = throws.pushes
    if pushes.sizes.shape[0] > 0:
        begin, end = pushes.starts[throw], pushes.starts[throw + 1]
        place = law.offsets[law.offsets.shape[0] - 1]
        law.theta[place] = end - begin
        law.theta[place + 1] = pushes.spacing[throw]
        for i in range(end - begin):
            for j in range(4):
                law.theta[place + 2 + 4 * i + j] = pushes.sizes[begin + i, j]


@inlined
def _set_motion(motion: Any, throws: Any, throw: int) -> None:
    motion[ORDER] = throws.orders[throw]
    motion[STONE] = throws.stones[throw]
    motion[RAN] = throws.ran[throw]
    motion[SWEPT] = throws.swept_first[throw]


# --- paths ---------------------------------------------------------------------------------------


@inlined
def _sweep_from(throws: Any, throw: int, swept: bool, switch: int) -> Any:
    """Return begin and end of the current or next sweep of a throw; infinite if there is no
    sweep.
    """
    switches, last = throws.switches, throws.switch_starts[throw + 1]
    begin = -1.0
    if not swept:
        begin = switches[switch] if switch < last else np.inf
        switch += 1
    return begin, switches[switch] if switch < last else np.inf


@inlined
def _path_of(law: Any, throws: Any, throw: int, last: float, work: Any) -> int:
    """Follow a throw to its last time, sweep after sweep; the number of nodes of its path."""
    path, limits = work.path, work.limits
    clock = throws.clocks[throw]
    switch = throws.switch_starts[throw]
    swept = throws.swept_first[throw] > 0.5
    t = 0.0
    count = 0
    end = NEVER_STOPS
    while end == NEVER_STOPS and t < last and count < path.shape[0]:
        begin, until = _sweep_from(throws, throw, swept, switch)
        within = Limits(limits.bounds, limits.obstacles, limits.reach, min(until, last))
        delivery = ThrowTimes(clock, begin, until)
        end, t, length = integrate(law, work.motion, delivery, within, path[count:], t, work.step)
        count += length
        switch += 1 if swept else 2
        swept = False
        if until == np.inf:
            break
    return count


@inlined
def _read_path(path: Any, count: int, times: Any, release: Any, out: Any) -> None:
    """Fill out (n, 6) with the states at some times on a path of `count` nodes."""
    k = 0
    for row in range(times.shape[0]):
        t = times[row]
        if t <= 0.0 or count == 0:
            for j in range(6):
                out[row, j] = release[j]
            continue
        while k + 1 < count and path[k + 1, Node.T] < t:
            k += 1
        if k + 1 < count:
            between_nodes(path, k, t - path[k, Node.T], out[row])
        else:
            for j in range(6):
                out[row, j] = path[count - 1, Node.X + j]


@compiled
def _slide_throws(
    law: Any, mu: Any, wear: Any, factors: Any, states: Any, throws: Any, out: Any, work: Any
) -> int:
    """Slide every throw; return the number of nodes of the longest path, or more than the capacity.

    Parameters
    ----------
    law : as of `_own_law`; overwritten with that of each throw
    mu : (rows, columns) friction of the map
    wear, factors, states, throws, out : as of `slide_session`
    work : `_Slides`
    """
    most = 0
    for i in range(states.shape[0]):
        _fill_in(law, mu, wear, factors[i], throws, i)
        _set_motion(work.motion, throws, i)
        for j in range(6):
            work.step.states[2, j] = states[i, j]
        begin, end = throws.starts[i], throws.starts[i + 1]
        if end == begin:
            continue
        times = throws.times[begin:end]
        count = _path_of(law, throws, i, times[end - begin - 1], work)
        _read_path(work.path, min(count, work.path.shape[0]), times, states[i], out[begin:end])
        most = max(most, count)
    return most


def slide_session(
    law: Law, wear: Wear, factors: Floats, states: Floats, throws: ThrowInputs, out: Floats
) -> None:
    """Fill `out` with the states of every throw at its measured times.

    Parameters
    ----------
    law : law of the ice
    wear : wear along the paths of earlier stones
    factors : (k,) factor on the map's friction, per throw
    states : (k, 6) states at release: x, y, vx, vy, theta, omega
    throws : what the throws bring along
    out : (rows, 6) states at the measured times
    """
    own = _own_law(law, wear, throws.pushes)
    room = NODES
    while True:
        needed = _slide_throws(own, law.mu, wear, factors, states, throws, out, _slides(own, room))
        if needed < room:
            return
        room *= 4


@compiled
def _friction_of_throws(
    law: Any, mu: Any, wear: Any, factors: Any, throws: Any, path: Any, out: Any, work: Any
) -> None:
    """Fill out (rows, 3) as of `friction_of_session`; the rest as of `_slide_throws`."""
    motion, terms = work.motion, work.step.probe
    for i in range(factors.shape[0]):
        _fill_in(law, mu, wear, factors[i], throws, i)
        _set_motion(motion, throws, i)
        switch, last = throws.switch_starts[i], throws.switch_starts[i + 1]
        for row in range(throws.starts[i], throws.starts[i + 1]):
            t = throws.times[row]
            while switch < last and throws.switches[switch] <= t:
                motion[SWEPT] = 1.0 - motion[SWEPT]
                switch += 1
            s = path[row]
            motion[T] = t
            motion[CLOCK] = throws.clocks[i] + t
            motion[HEADING] = s[State.THETA]
            x, y = s[State.X], s[State.Y]
            vx, vy, spin = s[State.VX], s[State.VY], s[State.OMEGA]
            law_terms(law, motion, work.step.push, x, y, vx, vy, spin, terms)
            local = mu_of_map(law, x, y)
            for j in range(3):
                out[row, j] = local * terms[j]


def friction_of_session(
    law: Law, wear: Wear, factors: Floats, throws: ThrowInputs, path: Floats, out: Floats
) -> None:
    """Fill out (rows, 3) with the part of the acceleration that is proportional to the map's μ.

    Parameters
    ----------
    law, wear, factors, throws : as of `slide_session`
    path : (rows, 6) states at the times of the throws
    """
    own = _own_law(law, wear, throws.pushes)
    _friction_of_throws(own, law.mu, wear, factors, throws, path, out, _slides(own, 1))
