"""Association of detections with stones over all sampled frames: the most likely paths.

A path is a chain of detections. Every two of them give a velocity, and the next one is predicted
under the stone's mode: carried, sliding or at rest. The score of a path is the log of its odds
against clutter. The best path is found by dynamic programming over pairs of detections and removed,
and the next one is searched for, until no score is high enough.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from curling_env.physics.compiled import compiled
from curling_env.typing import Floats, Integers
from friction_estimation.tracking import tuning
from friction_estimation.tracking.detection.detections import Detections

CARRIED, SLIDING, RESTING = 0, 1, 2
"""Modes of a stone."""
_MODES = 3
_STAYS = -0.1
"""Log probability that a mode continues."""
_REPEATED = 0.25
"""Share of the variance of a detection that is common to others at the same place."""
_AIM_SIGMA = 0.1
"""Standard deviation of the direction of a throw about the length of the sheet [rad]."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Path:
    """The detections of one stone.

    Parameters
    ----------
    at : (n,) indices of its detections
    mode : (n,) mode at each of them
    gained : (n,) log odds of a stone against clutter up to each of them
    """

    at: Integers
    mode: Integers
    gained: Floats

    @property
    def odds(self) -> float:
        """Log odds of a stone over clutter."""
        return float(self.gained[-1])

    def part(self, low: int, high: int) -> Path:
        """Return the path from one of its detections to before another."""
        before = self.gained[low - 1] if low else 0.0
        return Path(
            at=self.at[low:high],
            mode=self.mode[low:high],
            gained=self.gained[low:high] - before,
        )

    @property
    def slides(self) -> bool:
        """True if it slides anywhere."""
        return bool((self.mode == SLIDING).any())


def most_likely_paths(seen: Detections, area: float, among: Integers | None = None) -> list[Path]:
    """Return all paths whose log odds are above `tuning.SURE`, the most likely first.

    Parameters
    ----------
    seen : the detections, in order of time
    area : of the ice that is in view [m²]
    among : indices of the detections that they may have; None: all
    """
    clutter = max(len(seen.t) / max(len(seen.times), 1), 1.0) / area
    left = np.arange(len(seen.t)) if among is None else np.unique(among)
    paths: list[Path] = []
    while len(left) > 1:
        found = _disjoint_paths(seen, left, clutter)
        if not found:
            break
        paths += found
        left = np.setdiff1d(left, np.concatenate([path.at for path in found]))
    return sorted(paths, key=lambda path: -path.odds)


def _disjoint_paths(seen: Detections, left: Integers, clutter: float) -> list[Path]:
    """Return the most likely paths through some of the detections, one at a time.

    Paths beside the most likely one may continue elsewhere once it is removed, so they are found
    again later.
    """
    frame, t, xy = seen.frame[left], seen.t[left], seen.xy[left]
    variance, score = seen.sigma[left] ** 2, seen.score[left]
    still, leaves = seen.still[left], seen.leaves[left]
    first, second = _pairs(frame, t, xy, variance)
    if not len(first):
        return []
    into = np.searchsorted(second, np.arange(len(left) + 1))
    value = np.full((len(first), _MODES), -np.inf)
    came = np.full((len(first), _MODES), -1, dtype=np.int64)
    _score_pairs(
        first, second, into, frame, t, xy, variance, score, still, leaves, math.log(clutter),
        value, came, np.empty((len(first), 2)), np.empty((len(first), 4)),
        np.zeros(len(first), dtype=np.bool_), _first_seen(t, xy),
    )  # fmt: skip
    flat = value.ravel()
    ends = np.flatnonzero(flat > tuning.SURE)
    busy = np.zeros(len(seen.times), dtype=bool)
    found: list[Path] = []
    for end in ends[np.argsort(-flat[ends], kind="stable")].tolist():
        if busy[frame[second[end // _MODES]]]:
            continue
        nodes, modes, gained = _traced(end, first, second, came, value)
        low, high = frame[nodes[[0, -1]]].tolist()
        if not busy[max(low - tuning.LONGEST_GAP_FRAMES, 0) : high + 1].any():
            found.append(Path(at=left[nodes], mode=modes, gained=gained))
        busy[low : high + tuning.LONGEST_GAP_FRAMES + 1] = True
    return found


def _traced(
    end: int, first: Integers, second: Integers, came: Integers, value: Floats
) -> tuple[Integers, Integers, Floats]:
    """Detections, modes and log odds of the path that ends with a pair in a mode."""
    edge, mode = divmod(end, _MODES)
    nodes, modes, gained = [int(second[edge])], [mode], [float(value[edge, mode])]
    while True:
        nodes.append(int(first[edge]))
        back = int(came[edge, mode])
        if back < 0:
            break
        edge, mode = divmod(back, _MODES)
        modes.append(mode)
        gained.append(float(value[edge, mode]))
    modes.append(mode)
    gained.append(0.0)
    # Standing people rest too: rest shows the continuation of a path, not that it is a stone's.
    steps = np.diff(gained[::-1], prepend=0.0)
    mode_of = np.array(modes[::-1])
    most = np.where(mode_of == RESTING, tuning.STILL_THERE, np.inf)
    return np.array(nodes[::-1]), mode_of, np.cumsum(np.minimum(steps, most))


def _first_seen(t: Floats, xy: Floats) -> Floats:
    """Times of the first detections at each detection's place, (n,) [s]."""
    near = (np.hypot(*(xy[: k + 1] - xy[k]).T) < tuning.SAME_PLACE for k in range(len(t)))
    return np.array([t[np.argmax(one)] for one in near])


def _pairs(frame: Integers, t: Floats, xy: Floats, variance: Floats) -> tuple[Integers, Integers]:
    """Return pairs of detections that may be of one stone, ordered by the second and by the
    first.
    """
    firsts: list[Integers] = []
    seconds: list[Integers] = []
    for k in range(len(t)):
        low = int(np.searchsorted(t, t[k] - tuning.LONGEST_GAP))
        low = max(low, int(np.searchsorted(frame, frame[k] - tuning.LONGEST_GAP_FRAMES)))
        earlier = np.arange(low, k)
        earlier = earlier[frame[earlier] < frame[k]]
        way = np.hypot(*(xy[k] - xy[earlier]).T)
        margin = 3 * np.sqrt((variance[earlier] + variance[k]).sum(axis=1))
        near = earlier[way < tuning.FASTEST * (t[k] - t[earlier]) + margin]
        firsts.append(near)
        seconds.append(np.full(len(near), k))
    if not firsts:
        return np.empty(0, np.int64), np.empty(0, np.int64)
    return np.concatenate(firsts), np.concatenate(seconds)


@compiled
def _gauss(dx, dy, vx, vy):
    """Log density of a Student distribution of two coordinates."""
    chi2 = dx * dx / vx + dy * dy / vy
    nu = tuning.STUDENT_FREEDOM
    return -math.log(2 * math.pi) - 0.5 * math.log(vx * vy) - 0.5 * (nu + 2) * math.log1p(chi2 / nu)


@compiled
def _misses(dx, dy, vx, vy):
    """Log likelihood of a residual relative to one of two standard errors; 0 below that."""
    chi2 = dx * dx / vx + dy * dy / vy
    nu = tuning.STUDENT_FREEDOM
    return min(-0.5 * (nu + 2) * (math.log1p(chi2 / nu) - math.log1p(4 / nu)), 0.0)


@compiled
def _aim(vx, vy):
    """Log likelihood ratio of a direction, of throws over other motion."""
    angle = math.atan2(vx, abs(vy)) / _AIM_SIGMA
    return math.log(math.sqrt(2 * math.pi) / _AIM_SIGMA) - 0.5 * angle * angle


@compiled
def _score_pairs(
    first, second, into, frame, t, xy, variance, score, still, leaves, clutter, value, came,
    deceleration, rests, slid, taken,
):  # fmt: skip
    """Fill in the log odds of the best path that ends with each pair, in each mode.

    Parameters
    ----------
    deceleration : (n, 2) deceleration of that path while it slides, and its variance; filled in
    rests : (n, 4) place of that path while it rests, and the variances of its coordinates; filled
        in
    slid : (n,) whether that path slid to rest in a free place; filled in
    taken : (n,) when something was detected first at the place of each detection [s]
    """
    for e in range(len(first)):
        j, k = first[e], second[e]
        dt = t[k] - t[j]
        x, y = xy[k, 0] - xy[j, 0], xy[k, 1] - xy[j, 1]
        sx, sy = variance[j, 0] + variance[k, 0], variance[j, 1] + variance[k, 1]
        missed = max(tuning.MISSED * (frame[k] - frame[j] - 1), tuning.HIDDEN)
        begin = tuning.BIRTH + score[j] + score[k] + missed - clutter
        spread = (0.5 * tuning.FASTEST * dt) ** 2
        free = _gauss(x, y, sx + spread, sy + spread)
        way = math.sqrt(x * x + y * y)
        moves = way > tuning.LEAST_SPEED * dt and not still[k]
        left = moves and x * x / sx + y * y / sy > tuning.GATE**2
        begins = left and not still[j]
        value[e, CARRIED] = begin + free if begins else -np.inf
        value[e, SLIDING] = begin + free + _aim(x / dt, y / dt) if begins else -np.inf
        value[e, RESTING] = begin + _gauss(x, y, sx, sy)
        if frame[j] < tuning.END_FRAMES:
            value[e, RESTING] += tuning.LIES - tuning.BIRTH
        for a in range(2):
            rests[e, a] = (xy[j, a] + xy[k, a]) / 2
            rests[e, 2 + a] = (variance[j, a] + variance[k, a]) / 4
        for m in range(_MODES):
            came[e, m] = -1
        deceleration[e, 0], deceleration[e, 1] = tuning.DECELERATION, tuning.ICE_SIGMA**2
        for d in range(into[j], into[j + 1]):
            i = first[d]
            before = t[j] - t[i]
            vx, vy = (xy[j, 0] - xy[i, 0]) / before, (xy[j, 1] - xy[i, 1]) / before
            speed = math.sqrt(vx * vx + vy * vy) + 1e-6
            ux, uy = vx / speed, vy / speed
            ratio = dt / before
            ex = variance[k, 0] + (1 + ratio) ** 2 * variance[j, 0] + ratio**2 * variance[i, 0]
            ey = variance[k, 1] + (1 + ratio) ** 2 * variance[j, 1] + ratio**2 * variance[i, 1]
            lever = 0.5 * (before * dt + dt * dt)
            gain = missed + score[k] - clutter
            # carried on, or let go
            held = (tuning.CARRIED_ACCELERATION * lever) ** 2
            moved = gain + _gauss(x - vx * dt, y - vy * dt, ex + held, ey + held)
            if not moves:
                moved = -np.inf
            v = value[d, CARRIED] + _STAYS + moved
            if v > value[e, CARRIED]:
                value[e, CARRIED], came[e, CARRIED] = v, d * _MODES + CARRIED
            v = value[d, CARRIED] + tuning.RELEASED + moved + _aim(x / dt, y / dt)
            if v > value[e, SLIDING]:
                value[e, SLIDING], came[e, SLIDING] = v, d * _MODES + CARRIED
                deceleration[e, 0], deceleration[e, 1] = tuning.DECELERATION, tuning.ICE_SIGMA**2
            # slides on
            lost = min(deceleration[d, 0] * lever, 0.9 * speed * dt)
            dx, dy = x - vx * dt + ux * lost, y - vy * dt + uy * lost
            along, aside = math.sqrt(deceleration[d, 1]) * lever, tuning.CURL_SIGMA * lever
            qx, qy = (along * ux) ** 2 + (aside * uy) ** 2, (along * uy) ** 2 + (aside * ux) ** 2
            v = value[d, SLIDING] + _STAYS + gain + _gauss(dx, dy, ex + qx, ey + qy)
            if v > value[e, SLIDING] and moves:
                value[e, SLIDING], came[e, SLIDING] = v, d * _MODES + SLIDING
                share = deceleration[d, 1] * lever
                share /= along * along + (ex * ux * ux + ey * uy * uy)
                deceleration[e, 0] = deceleration[d, 0] - share * (dx * ux + dy * uy)
                fades = 1 - math.exp(-2 * dt / tuning.DECELERATION_MEMORY)
                deceleration[e, 1] = deceleration[d, 1] * (1 - share * lever)
                deceleration[e, 1] += fades * (tuning.ICE_SIGMA**2 - deceleration[e, 1])
            # is hit or hits, from rest or sliding
            jump = (tuning.JUMP_SIGMA * dt) ** 2
            hit = tuning.HIT + gain + _gauss(dx, dy, ex + jump, ey + jump)
            ax, ay = xy[k, 0] - rests[d, 0], xy[k, 1] - rests[d, 1]
            avx, avy = rests[d, 2] + variance[k, 0], rests[d, 3] + variance[k, 1]
            gone = moves and ax * ax / avx + ay * ay / avy > tuning.GATE**2
            for m in (SLIDING, RESTING):
                v = value[d, m] + hit
                free = left if m == SLIDING else gone and (leaves[j] or not still[j])
                if v > value[e, SLIDING] and free:
                    value[e, SLIDING], came[e, SLIDING] = v, d * _MODES + m
                    deceleration[e, 0] = tuning.DECELERATION
                    deceleration[e, 1] = tuning.ICE_SIGMA**2
            # stops between j and k
            rest = 0.5 * min(speed * dt, speed * speed / (2 * tuning.DECELERATION))
            stop = _gauss(
                x - ux * rest, y - uy * rest, ex + (rest * ux) ** 2, ey + (rest * uy) ** 2
            )
            v = value[d, SLIDING] + tuning.STOPS + gain + stop
            if v > value[e, RESTING]:
                value[e, RESTING], came[e, RESTING] = v, d * _MODES + SLIDING
                slid[e] = taken[k] > t[j] - 2 * tuning.SAME_PLACE / speed
                for a in range(2):
                    rests[e, a], rests[e, 2 + a] = xy[k, a], variance[k, a]
            # an unchanged picture of a resting object is hardly new evidence
            again = gain + _gauss(ax, ay, avx, avy)
            if not slid[d] or still[k]:
                known = tuning.STILL_THERE + _misses(ax, ay, avx, avy)
                again = min(again - score[k], missed + known)
            v = value[d, RESTING] + again
            if v > value[e, RESTING]:
                value[e, RESTING], came[e, RESTING] = v, d * _MODES + RESTING
                slid[e] = slid[d]
                for a in range(2):
                    spread, own = rests[d, 2 + a], variance[k, a]
                    rests[e, a] = rests[d, a] + spread / (spread + own) * (xy[k, a] - rests[d, a])
                    rests[e, 2 + a] = max(spread * own / (spread + own), _REPEATED * own)
