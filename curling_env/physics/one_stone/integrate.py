"""The way of one stone, stride by stride, until something ends it.

A draw is some twenty strides (see `stride`). A stride ends where an effect is not smooth (the
edge of a patch, the beginning and end of a sweep), and near a bound or an obstacle its path is
followed from knot to knot. The last few mm/s are one parabola.
"""

from __future__ import annotations

import math
from enum import IntEnum
from typing import Any

import numpy as np

from curling_env.physics.compiled import compiled, inlined
from curling_env.physics.effects.motion import GRAVITY, SWEPT
from curling_env.physics.law import SLOWEST, Law, mu_of_map
from curling_env.physics.one_stone.step import (
    KNOT_SIZE,
    MOST_KNOTS,
    Work,
    between_knots,
    march,
    remember,
    stride,
)

LONGEST_STRIDE = 8.0
"""Longest stride [s]."""
CLOSE = 2.0
"""Prediction error above which the law is asked again, over the one aimed at."""
GROWTH = 1.5
"""A second stride over the first, which predicted nothing."""
FAR = 15.0
"""Prediction error above which a shorter stride is taken, over the one aimed at."""
EDGE = 2e-6
"""Strides end this far before the edge of an effect, and hop over it [m]."""
TOUCHING = 1e-7
"""A gap below this is a contact [m]."""
SHORTEST_STRIDE = 1e-4
"""A stride this short is taken as it is [s]."""
MAX_STRIDES = 20_000
"""Strides after which a stone that never stops is given up: ice that drives it."""
MAX_TIME = 180.0
"""Seconds after which a stone that never stops is given up [s]."""


class SlideEnd(IntEnum):
    """Why a slide ended."""

    REST = 0
    LEFT_BOUNDS = 1
    CONTACT = 2
    NEVER_STOPS = 3


@inlined
def _ahead(breaks: Any, position: float, velocity: float) -> float:
    """Distance to the next break in the direction of motion, infinite if there is none [m]."""
    nearest = np.inf
    for k in range(breaks.shape[0]):
        distance = breaks[k] - position if velocity > 0.0 else position - breaks[k]
        if 0.0 <= distance < nearest:
            nearest = distance
    return nearest


@inlined
def _crosses(breaks: Any, axis: int, states: Any, h: float) -> bool:
    """Whether a stride crosses a break, there and back included."""
    if breaks.shape[0] == 0:
        return False
    low = min(states[0, axis], min(states[1, axis], states[2, axis]))
    high = max(states[0, axis], max(states[1, axis], states[2, axis]))
    for half in range(2):
        before = states[half, axis + 3]
        after = states[half + 1, axis + 3]
        if before * after < 0.0:
            turn = states[half, axis] + 0.25 * h * before * before / (before - after)
            low = min(low, turn)
            high = max(high, turn)
    crossed = False
    for k in range(breaks.shape[0]):
        crossed = crossed or low < breaks[k] < high
    return crossed


@inlined
def _time_short_of(distance: float, velocity: float, acceleration: float) -> float:
    """Time to come close to the edge of an effect; 0 at it, infinite if it is not reached [s].

    The further off, the less certain the time: so short of it at first, then closer.
    """
    speed = math.fabs(velocity)
    if distance == np.inf or speed == 0.0:
        return np.inf
    if distance < EDGE:
        return 0.0
    distance = 0.97 * distance if distance > 1e-3 else distance - 0.5 * EDGE
    root = speed * speed + 2.0 * (acceleration if velocity > 0.0 else -acceleration) * distance
    return 2.0 * distance / (speed + math.sqrt(root)) if root > 0.0 else np.inf


@inlined
def _way_to_rest(speed: float, rate: float, tail: float) -> float:
    """Way that is left, over the speed [s]: a parabola that begins at this rate and rests in time.

    Parameters
    ----------
    speed, rate : of the centre or of the band, and how fast it falls [m/s, m/s²]
    tail : time to rest [s]
    """
    return tail * (2.0 / 3.0 - rate * tail / (6.0 * max(speed, SLOWEST)))


@inlined
def _room(s: Any, bounds: Any) -> float:
    """How far inside its bounds a state is [m]; negative outside."""
    return min(min(s[0] - bounds[0], bounds[1] - s[0]), min(s[1] - bounds[2], bounds[3] - s[1]))


@inlined
def _gap(s: Any, bounds: Any, obstacles: Any, reach: float) -> Any:
    """Distance to go to the nearest bound or obstacle that is being approached [m].

    Returns the distance, and whether it is to an obstacle.
    """
    room = _room(s, bounds)
    contact = False
    for k in range(obstacles.shape[0]):
        dx = s[0] - obstacles[k, 0]
        dy = s[1] - obstacles[k, 1]
        if dx * s[3] + dy * s[4] < 0.0:
            gap = math.sqrt(dx * dx + dy * dy) - reach
            if gap < room:
                room = gap
                contact = True
    return room, contact


@inlined
def _may_touch(states: Any, bulge: float, bounds: Any, obstacles: Any, reach: float) -> bool:
    """Whether a stride may cross a bound or come within reach of an obstacle.

    Its path lies within `bulge` of the straight lines between beginning, middle and end.
    """
    if _room(states[1], bounds) < bulge or _room(states[2], bounds) < bulge:
        return True
    if obstacles.shape[0] > 0:
        far = reach + bulge
        x0 = min(states[0, 0], min(states[1, 0], states[2, 0])) - far
        x1 = max(states[0, 0], max(states[1, 0], states[2, 0])) + far
        y0 = min(states[0, 1], min(states[1, 1], states[2, 1])) - far
        y1 = max(states[0, 1], max(states[1, 1], states[2, 1])) + far
        for k in range(obstacles.shape[0]):
            if x0 <= obstacles[k, 0] <= x1 and y0 <= obstacles[k, 1] <= y1:
                return True
    return False


@inlined
def _first_touch(work: Work, n: int, bounds: Any, obstacles: Any, reach: float) -> Any:
    """Where a stride's path first crosses a bound or comes within reach of an obstacle.

    From each place the stone goes on by no more than the distance it has left, so that nothing
    is passed however slightly it would be touched.

    Returns
    -------
    knot, tau : a time tau after that knot, or -1 if nothing is touched; the state is in probe
    contact : whether it is an obstacle
    """
    knots, probe = work.knots, work.probe
    for k in range(n - 1):
        length = knots[k + 1, 0] - knots[k, 0]
        if length <= 0.0:
            continue
        fastest = max(
            math.fabs(knots[k, 4]) + math.fabs(knots[k, 5]),
            math.fabs(knots[k + 1, 4]) + math.fabs(knots[k + 1, 5]),
        )
        tau = 0.0
        while tau < length:
            between_knots(knots, k, tau, probe)
            gap, contact = _gap(probe, bounds, obstacles, reach)
            if gap < TOUCHING:
                return k, tau, contact
            tau += max(gap, TOUCHING) / max(fastest, 1e-6)
    return -1, 0.0, False


@inlined
def _sample(
    knots: Any, n: int, t: float, until: float, dt: float, samples: Any, count: int, probe: Any
) -> int:
    """Fill samples from a stride that began at t; returns how many there are then."""
    for k in range(n - 1):
        length = knots[k + 1, 0] - knots[k, 0]
        while count < samples.shape[0] and length > 0.0:
            tau = count * dt - t
            if tau > until or tau > knots[k + 1, 0]:
                break
            between_knots(knots, k, tau - knots[k, 0], probe)
            samples[count, 0] = count * dt
            samples[count, 1] = probe[0]
            samples[count, 2] = probe[1]
            samples[count, 3] = probe[2]
            count += 1
    return count


@inlined
def _append(path: Any, m: int, knots: Any, k: int, t: float) -> int:
    """Copy a knot to the path; returns how many it has then."""
    if path.shape[0] == 0:
        return 0
    if m < path.shape[0]:
        path[m, 0] = t + knots[k, 0]
        for c in range(1, KNOT_SIZE):
            path[m, c] = knots[k, c]
    return m + 1


@inlined
def _append_state(path: Any, m: int, state: Any, t: float, ax: float, ay: float, at: float) -> int:
    """Add a state to the path; returns how many knots it has then."""
    if path.shape[0] == 0:
        return 0
    if m < path.shape[0]:
        path[m, 0] = t
        for c in range(6):
            path[m, 1 + c] = state[c]
        path[m, 7] = ax
        path[m, 8] = ay
        path[m, 9] = at
    return m + 1


@compiled
def glide(
    law: Law,
    motion: Any,
    clock: float,
    sweep_start: float,
    sweep_end: float,
    bounds: Any,
    obstacles: Any,
    reach: float,
    dt: float,
    samples: Any,
    path: Any,
    start: float,
    work: Work,
) -> Any:
    """Slide a stone on from the state in work.states[2], which becomes the final one.

    Parameters
    ----------
    start : time since release at which it is in that state [s]
    path : (m, KNOT_SIZE) filled with the knots of the way, at times since release; m = 0 for none
    law, motion, clock, sweep_start, sweep_end, bounds, obstacles, reach, dt, samples, work : as of
        `slide_kernel`

    Returns
    -------
    end, t, count : as of `slide_kernel`
    length : knots of the path; more than m if it had no room for them
    """
    states, parts, pace = work.states, work.parts, work.pace
    now = states[2]
    t = start
    count = 0
    length = 0
    gap, contact = _gap(now, bounds, obstacles, reach)
    if gap < 0.0:
        return (SlideEnd.CONTACT if contact else SlideEnd.LEFT_BOUNDS), t, count, length
    watched = samples.shape[0] > 0 or path.shape[0] > 0
    motion[SWEPT] = 1.0 if sweep_start <= t < sweep_end else 0.0
    fresh = True
    share = pace.first_share
    before = 1.0
    end = SlideEnd.NEVER_STOPS
    for _ in range(MAX_STRIDES):
        speed = math.sqrt(now[3] * now[3] + now[4] * now[4])
        rim = law.band_radius * math.fabs(now[5])
        ax = ay = at = 0.0
        mu = work.moments[4]
        if fresh:
            # P and Q are not known yet: the map's friction alone tells the scale of time.
            rate = GRAVITY * mu_of_map(law, now[0], now[1])
            turn = rate
        else:
            ax = mu * parts[2, 0] + parts[2, 3]
            ay = mu * parts[2, 1] + parts[2, 4]
            at = mu * parts[2, 2] + parts[2, 5]
            rate = math.sqrt(ax * ax + ay * ay)
            turn = law.band_radius * math.fabs(at)
        if max(speed, rim) < pace.rest_speed:
            # Centre and band come to rest together.
            both = max(math.sqrt(speed * speed + rim * rim), SLOWEST)
            tail = both / max((speed * rate + rim * turn) / both, 1e-6)
            way = _way_to_rest(speed, rate, tail)
            turning = _way_to_rest(rim, turn, tail)
            while count < samples.shape[0] and count * dt <= t + tail:
                u = count * dt - t
                fade = u * (1.0 - 0.5 * u / tail) if tail > 0.0 else 0.0
                samples[count, 0] = count * dt
                samples[count, 1] = now[0] + way * now[3]
                samples[count, 2] = now[1] + way * now[4]
                samples[count, 3] = now[2] + fade * now[5]
                count += 1
            now[0] += way * now[3]
            now[1] += way * now[4]
            now[2] += turning * now[5]
            now[3] = now[4] = now[5] = 0.0
            t += tail
            length = _append_state(path, length, now, t, 0.0, 0.0, 0.0)
            end = SlideEnd.REST
            break
        if t > MAX_TIME:
            break
        time_left = max(speed, rim) / max(rate, turn, 1e-6)
        h = min(share * time_left, LONGEST_STRIDE)
        if law.patterned:
            h = min(h, MOST_KNOTS / 8.0 * law.cell / max(speed, 1e-6))
        if law.x_breaks.shape[0] > 0 or law.y_breaks.shape[0] > 0:
            x_ahead = _ahead(law.x_breaks, now[0], now[3])
            y_ahead = _ahead(law.y_breaks, now[1], now[4])
            until = min(_time_short_of(x_ahead, now[3], ax), _time_short_of(y_ahead, now[4], ay))
            if until == 0.0:
                # At the edge of an effect: hop over it, and begin afresh beyond.
                hop = 2.0 * EDGE / max(math.fabs(now[3] if x_ahead < EDGE else now[4]), 1e-3)
                now[0] += hop * (now[3] + 0.5 * hop * ax)
                now[1] += hop * (now[4] + 0.5 * hop * ay)
                now[2] += hop * (now[5] + 0.5 * hop * at)
                now[3] += hop * ax
                now[4] += hop * ay
                now[5] += hop * at
                t += hop
                fresh = True
                share = pace.first_share
                continue
            h = min(h, until)
        switch = np.inf
        if t < sweep_start:
            switch = sweep_start
        elif t < sweep_end:
            switch = sweep_end
        h = min(h, switch - t)
        for k in range(6):
            states[0, k] = now[k]
        ratio = 0.0 if fresh else h / before
        aim = pace.aim + pace.aim_share * speed * time_left
        first, last = stride(law, motion, work, t, clock, h, ratio, time_left, CLOSE * aim)
        if h > SHORTEST_STRIDE and (
            _crosses(law.x_breaks, 0, states, h) or _crosses(law.y_breaks, 1, states, h)
        ):
            for k in range(6):
                now[k] = states[0, k]
                parts[2, k] = parts[0, k]
            work.moments[4] = mu
            share = 0.5 * h / time_left
            continue
        if (last > CLOSE * aim or (first > FAR * aim and not fresh)) and h > SHORTEST_STRIDE:
            for k in range(6):
                now[k] = states[0, k]
                parts[2, k] = parts[0, k]
            work.moments[4] = mu
            shorter = 0.3 if fresh else max(0.3, 0.8 * math.sqrt(math.sqrt(aim / first)))
            share = shorter * h / time_left
            continue
        if watched or _may_touch(states, rate * h * h / 16.0 + 2e-3, bounds, obstacles, reach):
            for k in range(6):
                work.again[0, k] = states[0, k]
            n = march(law, work.curves, work.towards, h, work.again, work.probe, work.knots)
            at_knot, tau, contact = _first_touch(work, n, bounds, obstacles, reach)
            until = h if at_knot < 0 else work.knots[at_knot, 0] + tau
            for k in range(n if at_knot < 0 else at_knot + 1):
                if k > 0 or length == 0:
                    length = _append(path, length, work.knots, k, t)
            if at_knot >= 0:
                for k in range(6):
                    now[k] = work.probe[k]
            count = _sample(work.knots, n, t, until, dt, samples, count, work.probe)
            if at_knot >= 0:
                t += until
                for c in range(3):
                    u = tau / (work.knots[at_knot + 1, 0] - work.knots[at_knot, 0])
                    rise = work.knots[at_knot + 1, 7 + c] - work.knots[at_knot, 7 + c]
                    work.probe[c] = work.knots[at_knot, 7 + c] + u * rise
                if tau > 0.0:
                    length = _append_state(
                        path, length, now, t, work.probe[0], work.probe[1], work.probe[2]
                    )
                end = SlideEnd.CONTACT if contact else SlideEnd.LEFT_BOUNDS
                break
        # The error of a prediction grows with the fourth power of the stride.
        factor = GROWTH if fresh else math.sqrt(math.sqrt(aim / max(first, 1e-2 * aim)))
        share = min(pace.longest_share, h / time_left * min(max(factor, 0.3), 2.5))
        remember(work)
        before = h
        fresh = False
        if h == switch - t:
            t = switch
            motion[SWEPT] = 1.0 if sweep_start <= t < sweep_end else 0.0
            fresh = True
            share = pace.first_share
        else:
            t += h
    return end, t, count, length
