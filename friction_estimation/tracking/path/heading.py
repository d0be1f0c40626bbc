"""One heading for the whole track: what all pictures of the handle say of it together.

Far away a handle is a pixel or two: one picture leaves its heading open, and its two ends look
alike. But a stone turns steadily, and ever slower as it slows. So pictures a quarter of a second
apart each say how well every heading fits, and the turn that explains all of them is found, first
as a power of the speed, then straying slowly from it. Where another heading fits a stretch better,
none is claimed there.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator

from curling_env.typing import Flags, Floats

SPINS = np.linspace(-6.0, 6.0, 481)
"""Spins tried at the beginning of the track [rad/s]."""
POWERS = (0.0, 0.15, 0.3, 0.5, 0.8)
"""The spin falls with these powers of the speed; real stones lie in between."""
WAVES = 6
"""What a handle of two ends looks like at all headings is no finer than so many waves a turn."""
MOST = 25.0
"""What a single picture can hold against a heading at most: it may show a sweeper's foot."""
STRAY = 0.25
"""How far the turn strays from a power of the speed within a second [rad/√s]."""
STRAYS = np.linspace(-np.pi, np.pi, 48, endpoint=False)
MATCH = 0.7
"""A heading further from the joint one [rad] is another heading."""
ABOUT = 1.5
"""Pictures within so many seconds decide together whether the turn is right there."""
VIEW = np.pi / 4
"""A handle turned by less shows the same faults of its model."""
FEWEST_VIEWS = 3
CLEAR = 3.0
"""By how many standard errors the turn must fit better than turned round, and than any heading."""
LONGEST_GAP = 2.0
"""Whole turns are not counted across a longer time without a heading [s]."""
FEWEST = 5
"""Pictures of which a turn can be told."""


@dataclass(eq=False)
class Glimpses:
    """How well each heading fits single pictures of a stone.

    Parameters
    ----------
    t : (n,) their times [s]
    cost : (n, k) misfit at k headings, from -π on a whole turn round, in squared standard errors
    """

    t: list[float] = field(default_factory=list)
    cost: list[Floats] = field(default_factory=list)

    def add(self, t: float, cost: Floats) -> None:
        """One more picture."""
        self.t.append(t)
        self.cost.append(np.minimum(cost - cost.min(), MOST))

    def between(self, low: float, high: float) -> Glimpses:
        """Those taken from one time on until another."""
        kept = [k for k, t in enumerate(self.t) if low <= t < high]
        return Glimpses(t=[self.t[k] for k in kept], cost=[self.cost[k] for k in kept])


class Turn:
    """A stone's heading through a throw.

    Parameters
    ----------
    moments : (n,) increasing [s]
    headings : (n,) unwrapped [rad]
    told : (n,) where the pictures about a moment agree with it; everywhere if None
    """

    def __init__(
        self,
        moments: Sequence[float] | Floats,
        headings: Sequence[float] | Floats,
        told: Flags | None = None,
    ) -> None:
        self._t, self._theta = np.asarray(moments), np.asarray(headings)
        self._told = np.ones(len(self._t), dtype=bool) if told is None else told
        self._cubics = PchipInterpolator(self._t, self._theta).c

    def at(self, t: Floats | float) -> Floats:
        """Heading at times [s]; before the first moment and after the last it runs on steadily."""
        t = np.asarray(t, dtype=np.float64)
        inside = np.clip(t, self._t[0], self._t[-1])
        piece = np.clip(np.searchsorted(self._t, inside, side="right") - 1, 0, len(self._t) - 2)
        cubic, square, slope, start = self._cubics[:, piece]
        since = inside - self._t[piece]
        # At rest the last spin is nothing; at the release the first one is the thrower's.
        rate = slope + since * (2 * square + since * 3 * cubic)
        return start + since * (slope + since * (square + since * cubic)) + rate * (t - inside)

    def told(self, t: Floats) -> Flags:
        """Whether it is to be believed at times [s], (n,)."""
        after = np.clip(np.searchsorted(self._t, t), 1, len(self._t) - 1)
        nearest = np.where(t - self._t[after - 1] < self._t[after] - t, after - 1, after)
        return self._told[nearest] & (np.abs(t - self._t[nearest]) <= LONGEST_GAP / 2)

    def differs(self, other: Turn) -> bool:
        """Whether another turn, where it is to be believed, is not this one."""
        miss = np.angle(np.exp(1j * (self.at(other._t) - other._theta)))
        return bool(np.mean(np.abs(miss[other._told]) > MATCH / 2) > 0.1)


def heading_about(turn: Turn, t: Floats, theta: Floats) -> Floats:
    """Headings near a turn, unwrapped, (n,); NaN for those that are not, and where it is not told.

    Parameters
    ----------
    t, theta : (n,) times and measured headings, modulo a turn; NaN where unknown
    """
    expected = turn.at(t)
    miss = np.angle(np.exp(1j * (theta - expected)))
    believed = (np.abs(miss) < MATCH) & turn.told(t)
    if not believed.any():
        return np.full(len(t), np.nan)
    return np.where(_longest_stretch(t, believed), expected + miss, np.nan)


def _longest_stretch(t: Floats, believed: Flags) -> Flags:
    """Of the frames believed, those of the longest stretch without a long gap."""
    at = np.flatnonzero(believed)
    stretches = np.split(at, np.flatnonzero(np.diff(t[at]) > LONGEST_GAP) + 1)
    kept = np.zeros(len(t), dtype=bool)
    kept[max(stretches, key=len)] = True
    return kept


def turn_through(glimpses: Glimpses, t: Floats, speed: Floats) -> Turn | None:
    """The turn that explains all pictures; None where they show none, or not its front.

    Parameters
    ----------
    t, speed : (m,) the stone's speed [m/s] and when it had it [s]
    """
    moments = np.array(glimpses.t)
    if len(moments) < FEWEST:
        return None
    cost = np.array(glimpses.cost)
    waves = np.fft.rfft(cost, axis=1)[:, : WAVES + 1] / cost.shape[1]
    waves[:, 1:] *= 2
    waves *= np.exp(1j * np.pi * np.arange(WAVES + 1))  # the first of the headings is -π
    theta = _steady_turn(moments, waves, t, speed)
    theta = theta + _stray(moments, waves, theta)
    # What another heading would cost more, at each moment: (n, strays)
    against = _cost_at(waves, theta[:, None] + STRAYS) - _cost_at(waves, theta)[:, None]
    views = FEWEST_VIEWS + min(np.ptp(moments), float(np.abs(np.diff(theta)).sum()) / VIEW)
    for other in (against[:, 0], against.mean(axis=1)):  # turned round; any heading
        if other.mean() < CLEAR * other.std() / np.sqrt(views):
            return None
    near = np.abs(moments[:, None] - moments) <= ABOUT
    about = near @ against
    told = about[:, np.abs(STRAYS) > MATCH].min(axis=1) > 0
    return Turn(moments, theta, told) if told.any() else None


def _cost_at(waves: NDArray[np.complex128], theta: Floats) -> Floats:
    """Misfit of each picture at headings (n,) or (n, k)."""
    flat = theta.reshape(len(waves), -1)
    turned = np.exp(1j * flat[..., None] * np.arange(WAVES + 1))
    return np.einsum("nw,nkw->nk", waves, turned).real.reshape(theta.shape)


def _steady_turn(
    moments: Floats, waves: NDArray[np.complex128], t: Floats, speed: Floats
) -> Floats:
    """The heading at each moment under the likeliest spin that falls with a power of the speed."""
    share = np.clip(speed / max(float(np.nanmax(speed)), 1e-6), 0.0, 1.0)
    fronts = np.exp(1j * np.outer(np.arange(WAVES + 1), STRAYS))
    best, least = np.zeros(len(moments)), np.inf
    for power in POWERS:
        rate = np.where(share > 0.02, share**power, 0.0)
        swept = np.concatenate([[0.0], np.cumsum(np.diff(t) * (rate[1:] + rate[:-1]) / 2)])
        way = np.interp(moments, t, swept)
        for spins in np.array_split(SPINS, 8):
            turned = np.exp(1j * spins[:, None] * way)
            total, power_of = np.empty((len(spins), WAVES + 1), dtype=complex), np.ones_like(turned)
            for wave in range(WAVES + 1):
                total[:, wave] = power_of @ waves[:, wave]
                power_of *= turned
            costs = np.real(total @ fronts)
            i, k = np.unravel_index(int(np.argmin(costs)), costs.shape)
            if costs[i, k] < least:
                least, best = float(costs[i, k]), STRAYS[k] + spins[i] * way
    return best


def _stray(moments: Floats, waves: NDArray[np.complex128], theta: Floats) -> Floats:
    """How far the pictures say that the heading strays from a turn, slowly, (n,) [rad].

    The likeliest course of a random walk, by dynamic programming.
    """
    own = _cost_at(waves, theta[:, None] + STRAYS)
    step = np.angle(np.exp(1j * (STRAYS[:, None] - STRAYS)))  # [now, before]
    value = own[0]
    came_from: list[NDArray[np.intp]] = []
    for k in range(1, len(moments)):
        options = value + step**2 / (STRAY**2 * (moments[k] - moments[k - 1]))
        came_from.append(np.argmin(options, axis=1))
        value = own[k] + options.min(axis=1)
    at = int(np.argmin(value))
    chosen = [at]
    for back in came_from[::-1]:
        at = int(back[at])
        chosen.append(at)
    stray = np.unwrap(STRAYS[chosen[::-1]])
    # Rounded to its grid it would jerk: the pictures about a moment place it between.
    bell = np.exp(-0.5 * ((moments[:, None] - moments) / (ABOUT / 4)) ** 2)
    return bell @ stray / bell.sum(axis=1)
