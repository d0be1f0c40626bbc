"""Measurements that contradict a freely sliding stone: jumps of velocity, and positions off any
path.

If the smoothed path does not fit, the velocity may have jumped, because the stone hit an unseen
object. If no jump explains the misfit either, another object was measured instead of the stone, or
an old picture of it that a codec repeated.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from curling_env.sheet import HACK_Y, HOG_LINE_Y
from curling_env.typing import Flags, Floats
from friction_estimation.tracking import tuning
from friction_estimation.tracking.smoothing.smoother import Smoothing, SmoothPath

_TRIED = 16
"""Maximum number of initially tried times of a jump."""
_TURNS = 3
"""Number of rounds of the search for the time of a jump, each about four times as fine."""


@dataclass(frozen=True, kw_only=True)
class Misfit:
    """Stretch in which the measurements of a stone are off its path.

    Parameters
    ----------
    first, last : first and last time [s]
    by : the most that they are off [m]
    """

    first: float
    last: float
    by: float

    @property
    def words(self) -> str:
        return (
            f"from {self.first:.1f} to {self.last:.1f} s it is up to {self.by:.2f} m off the path "
            "of a sliding stone: another object may have been tracked"
        )


def smoothed_with_jump(
    smoothed: Smoothing, released: float = -np.inf
) -> tuple[SmoothPath, float | None]:
    """Return the smoothed path, with a jump of its velocity if that is far more likely.

    Parameters
    ----------
    smoothed : smooths the measurements with jumps at some times
    released : the jump is later [s]

    Returns
    -------
    the path, and the time of the jump [s]; None without one
    """
    plain = smoothed()
    t = plain.t[plain.weight > 0]
    bad = t[_is_off(plain)[plain.weight > 0]]
    moments = ((t[1:-2] + t[2:-1]) / 2)[t[1:-2] > released]
    # A jump near either end would explain any error of the few measurements there.
    low, high = t[0] + tuning.NEIGHBOURS, t[-1] - tuning.NEIGHBOURS
    moments = moments[(moments > low) & (moments < high)]
    if len(bad):
        moments = moments[np.abs(moments[:, None] - bad).min(axis=1) < tuning.NEIGHBOURS * 2]
    if not len(bad) or not len(moments):
        return plain, None
    tried = moments[:: -(-len(moments) // _TRIED)]
    reach = float(np.diff(tried).max(initial=0.0))
    best, when = plain, tried[0]
    for _ in range(_TURNS):
        for moment in tried.tolist():
            found = smoothed(moment)
            if found.unlikelihood < best.unlikelihood:
                best, when = found, moment
        tried = np.clip(when + reach * np.linspace(-1.0, 1.0, 8), low, high)
        reach /= 4
    gain = plain.unlikelihood - best.unlikelihood
    left = _is_off(best) & (np.abs(best.t - when) < tuning.NEIGHBOURS)
    if gain < np.log(len(moments)) - tuning.HIT or left.any():
        return plain, None
    return best, float(when)


def misfits(path: SmoothPath) -> list[Misfit]:
    """Return stretches in which the measurements are off a path by more than those of a stone can
    be.
    """
    at = np.flatnonzero(_is_off(path))
    if not len(at):
        return []
    t = path.t[at]
    parts = np.split(at, np.flatnonzero(np.diff(t) > 2 * tuning.NEIGHBOURS) + 1)
    return [
        Misfit(
            first=float(path.t[part[0]]),
            last=float(path.t[part[-1]]),
            by=float(path.off[part].max()),
        )
        for part in parts
    ]


def _slowed(path: SmoothPath) -> Flags:
    """Return where a released stone decelerates more than ice can explain, (n,)."""
    speed, y = np.hypot(*path.velocity.T), path.place[:, 1]
    low, high = (np.clip(path.t + way * tuning.LONG, path.t[0], path.t[-1]) for way in (-1, 1))
    lost = np.interp(low, path.t, speed) - np.interp(high, path.t, speed)
    most = tuning.DECELERATION + tuning.GATE * tuning.DECELERATION_SIGMA
    released = np.abs(y - y[0]) > HACK_Y - HOG_LINE_Y
    return released & (lost > most * np.maximum(high - low, tuning.LONG))


def left_behind(path: SmoothPath) -> int | None:
    """Return the row from which on a path decelerates more than ice can explain; None without
    one.
    """
    fast = np.flatnonzero(_slowed(path))
    return int(fast[0]) if len(fast) else None


def misfit_sigma(path: SmoothPath, off: Sequence[Misfit], behind: int | None) -> Floats:
    """Standard error of each coordinate due to misfits, (n,) [m]."""
    sigma = np.zeros(len(path.t))
    for one in off:
        sigma[(path.t >= one.first) & (path.t <= one.last)] = tuning.MISFIT_ERROR * one.by
    if behind is not None:  # the stone may have slid on
        speed = float(np.hypot(*path.velocity[behind]))
        since = np.clip(path.t - path.t[behind], 0.0, speed / tuning.DECELERATION)
        way = since - 0.5 * tuning.DECELERATION * since**2 / speed
        there = path.place[behind] + way[:, None] * path.velocity[behind]
        sigma[behind:] = np.hypot(sigma, np.hypot(*(there - path.place).T))[behind:]
    return sigma


def loss_in_words(path: SmoothPath, jump: float | None, behind: int | None) -> Iterator[str]:
    """Describe a loss of speed that ice does not explain, sudden or while the track lags behind."""
    if behind is not None:
        yield (
            f"from {path.t[behind]:.1f} s on it slows down more than ice slows a stone: the track "
            "may lag behind the stone"
        )
    if jump is None:
        return
    after = min(int(np.searchsorted(path.t, jump)), len(path.t) - 1)
    if _slowed(path)[after]:
        yield (
            f"at {jump:.1f} s it loses speed as if it hit a stone, but no stone is found there: "
            "from then on the track may be of another stone"
        )


def misfits_in_words(off: Sequence[Misfit], contacts: Sequence[float]) -> Iterator[str]:
    """Describe long misfits, except those at a contact."""
    for one in off:
        at_contact = any(one.first - 1 < c < one.last + 1 for c in contacts)
        if one.last - one.first > tuning.LONG and not at_contact:
            yield one.words


def _is_off(path: SmoothPath) -> Flags:
    """Return which measurements are far off a path through the others, (n,)."""
    seen = path.weight > 0
    near = np.abs(path.t[:, None] - path.t[seen]) <= tuning.NEIGHBOURS
    square = near @ path.off[seen] ** 2 / np.maximum(near.sum(axis=1), 1)
    usual = np.median(square[seen])
    return square > max(tuning.NOISE_TIMES**2 * usual, tuning.DETECTION_M**2)
