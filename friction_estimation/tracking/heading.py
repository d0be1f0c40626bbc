"""One heading for the whole track: which of a handle's two ends is the front, frame by frame.

Far away a handle is a pixel or two and its two ends look alike, so single frames are half a turn
off, or anywhere. But a stone turns steadily, and ever slower as it slows. The turn that most frames
agree with, whichever end they took for the front, is found first; then the front, by majority.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator

Floats = NDArray[np.float64]

SPINS = np.linspace(-6.0, 6.0, 481)
"""Spins tried at the beginning of the track [rad/s]."""
POWERS = (0.0, 0.15, 0.3, 0.5, 0.8)
"""The spin falls with these powers of the speed; real stones lie in between."""
LEAST_AGREEMENT = 0.35
"""Mean cosine of the headings' doubled miss below which no turn is found."""
LEAST_MAJORITY = 0.1
"""By how much one front must win, as a mean cosine, to be believed."""
WINDOW = 1.5
"""Time over which the turn may stray from a power of the speed [s]."""
LARGEST_MISS = 0.7
"""A heading further from the joint one [rad] is a misread handle."""
SIGMA_FLOOR = 0.15
"""No single heading counts for more than one with this standard error [rad]."""


LEAST_RIGHT = 0.75
"""Share of the frames begun at both ends of the handle that must choose the expected one."""
NEARBY = 1.5
LEAST_RIGHT_NEARBY = 0.6
"""The same of those within so many seconds of a frame, for this frame's heading."""
LONGEST_GAP = 2.0
"""Whole turns are not counted across a longer time without a heading [s]."""


class Turn:
    """A stone's heading through a throw as its clearest pictures show it, all of them together.

    Parameters
    ----------
    moments : (n,) of the pictures, increasing [s]
    headings : (n,) unwrapped [rad]
    """

    def __init__(self, moments: Sequence[float], headings: Sequence[float]) -> None:
        self._t, self._theta = np.asarray(moments), np.asarray(headings)
        self._curve = PchipInterpolator(self._t, self._theta)
        self._rate = self._curve.derivative()

    def at(self, t: Floats | float) -> Floats:
        """Heading at times [s]; before the first picture and after the last it runs on steadily."""
        t = np.asarray(t, dtype=np.float64)
        inside = np.clip(t, self._t[0], self._t[-1])
        on = t - inside
        # At rest the last spin is nothing; at the release the first one is the thrower's.
        return self._curve(inside) + (self._rate(inside) * on if np.any(on) else 0.0)


def heading_about(turn: Turn, t: Floats, theta: Floats, probed: NDArray[np.bool_]) -> Floats:
    """Headings near an expected turn, unwrapped, (n,); NaN for those that are not.

    Parameters
    ----------
    turn : what is expected
    t, theta : (n,) times and measured headings, modulo a turn; NaN where unknown
    probed : (n,) frames in which the fit was begun at both ends of the handle. Only they can
        contradict the turn; where too many do, no heading is believed
    """
    expected = turn.at(t)
    miss = np.angle(np.exp(1j * (theta - expected)))
    right = np.abs(miss) < LARGEST_MISS
    asked = probed & np.isfinite(theta)
    if asked.sum() < 5 or np.mean(right[asked]) < LEAST_RIGHT:
        return np.full(len(t), np.nan)
    # Where people hid it for seconds, the turn between two clear pictures may be a whole one off.
    near = np.abs(t[:, None] - t[asked]) <= NEARBY
    share = np.sum(near & right[asked], axis=1) / np.maximum(near.sum(axis=1), 1)
    believed = right & ((share >= LEAST_RIGHT_NEARBY) | ~near.any(axis=1))
    return np.where(_longest_stretch(t, believed), expected + miss, np.nan)


def _longest_stretch(t: Floats, believed: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Of the frames believed, those of the longest stretch without a long gap."""
    at = np.flatnonzero(believed)
    stretches = np.split(at, np.flatnonzero(np.diff(t[at]) > LONGEST_GAP) + 1)
    kept = np.zeros(len(t), dtype=bool)
    kept[max(stretches, key=len)] = True
    return kept


def consistent_heading(t: Floats, theta: Floats, sigma: Floats, speed: Floats) -> Floats:
    """Headings of one steady turn, unwrapped.

    Parameters
    ----------
    t : (n,) [s]
    theta : (n,) measured, modulo a turn and sometimes half a turn off; NaN where unknown [rad]
    sigma : (n,) their standard errors [rad]
    speed : (n,) of the stone [m/s]

    Returns
    -------
    (n,) NaN where a heading fits the turn in no way, and everywhere when no turn or no front can
    be told
    """
    known = np.isfinite(theta) & np.isfinite(sigma)
    nothing = np.full(len(t), np.nan)
    if known.sum() < 5:
        return nothing
    weight = np.where(known, 1 / (SIGMA_FLOOR**2 + np.nan_to_num(sigma, nan=9.0) ** 2), 0.0)
    measured = np.where(known, theta, 0.0)
    turn, agreement = _steady_turn(t, measured, weight, speed)
    if agreement < LEAST_AGREEMENT:
        return nothing
    turn = turn + _stray(t, measured - turn, weight)
    miss = measured - turn
    front = np.sum(weight * np.exp(1j * miss)) / weight.sum()
    if abs(front) < LEAST_MAJORITY:
        return nothing
    turn = turn + np.angle(front)
    # Half a turn off is the other end of the same handle.
    left = 0.5 * np.angle(np.exp(2j * (measured - turn)))
    return np.where(known & (np.abs(left) < LARGEST_MISS), turn + left, np.nan)


def _steady_turn(t: Floats, theta: Floats, weight: Floats, speed: Floats) -> tuple[Floats, float]:
    """The turn that most doubled headings agree with, up to a constant, and how well they do."""
    share = np.clip(speed / max(float(np.nanmax(speed)), 1e-6), 0.0, 1.0)
    doubled = weight * np.exp(2j * theta)
    best, agreement = np.zeros(len(t)), -1.0
    for power in POWERS:
        rate = np.where(share > 0.02, share**power, 0.0)
        swept = np.concatenate([[0.0], np.cumsum(np.diff(t) * (rate[1:] + rate[:-1]) / 2)])
        for spins in np.array_split(SPINS, 8):
            sums = np.abs(np.exp(-2j * spins[:, None] * swept) @ doubled) / weight.sum()
            i = int(np.argmax(sums))
            if sums[i] > agreement:
                agreement, best = float(sums[i]), spins[i] * swept
    return best, agreement


def _stray(t: Floats, miss: Floats, weight: Floats) -> Floats:
    """Slow departure of the headings from a turn, from their doubled misses, (n,)."""
    step = float(np.median(np.diff(t)))
    half = max(int(WINDOW / step / 2), 1)
    bell = np.exp(-0.5 * (np.arange(-2 * half, 2 * half + 1) / half) ** 2)
    total = np.convolve(weight * np.exp(2j * miss), bell, mode="full")
    total = total[2 * half : 2 * half + len(t)]
    return 0.5 * np.unwrap(np.angle(total))
