"""Smoothed path from all measurements of a stone: the motion model run forward and backward."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from curling_env.typing import Flags, Floats
from friction_estimation.tracking import tuning
from friction_estimation.tracking.association.motion import (
    acceleration_of,
    filtered,
    smoothed_back,
)

_PASSES = 5
"""Number of rounds for weights, scale and direction."""
_SAME = 1e-6
"""Maximum time between a contact and a frame in which it counts [s]."""
_LEAST_SPEED = 0.1
"""Minimum speed for a change of direction [m/s]."""
_REST_CANDIDATES = 9
"""Number of times of rest that are compared at once."""


@dataclass(frozen=True, kw_only=True, eq=False)
class SmoothPath:
    """A smoothed path.

    Parameters
    ----------
    t : (n,) times [s]
    place, velocity, sigma : (n, 2) place [m], velocity [m/s] and standard error of the place [m]
    weight : (n,) weight of each measurement, 0 to about 1; 0 without one
    off : (n,) distance of each measurement from the path [m]; 0 without one
    scale : factor by which the given standard errors had to be multiplied
    rests_from : when it comes to rest [s]; infinite if it does not in the film
    """

    t: Floats
    place: Floats
    velocity: Floats
    sigma: Floats
    weight: Floats
    off: Floats
    scale: float
    rests_from: float

    @property
    def unlikelihood(self) -> float:
        """Negative log likelihood of the measurements about the path, up to a constant."""
        used = self.weight[self.weight > 0]
        unlikely = -0.5 * (tuning.STUDENT_FREEDOM + 2) * np.log(used) + 2 * np.log(self.scale)
        return float(unlikely.sum())

    def at(self, rows: Flags) -> SmoothPath:
        """Some of its rows, (n,)."""
        return replace(
            self,
            t=self.t[rows],
            place=self.place[rows],
            velocity=self.velocity[rows],
            sigma=self.sigma[rows],
            weight=self.weight[rows],
            off=self.off[rows],
        )


Smoothing = Callable[..., SmoothPath]
"""Smoother of the measurements of a stone whose velocity jumps at some times [s]."""


def smooth_path(
    t: Floats,
    measured: Floats,
    sigma: Floats,
    *,
    released: float = -np.inf,
    contacts: Sequence[float] = (),
    scaled: bool = True,
) -> SmoothPath:
    """Smooth a stone's measurements.

    Parameters
    ----------
    t : (n,) increasing times [s]
    measured, sigma : (n, 2) places and their standard errors up to a common factor [m]; NaN where
        it was not measured
    released : when the thrower lets go [s]
    contacts : when it hits or is hit [s]
    scaled : whether the standard errors are scaled by the film
    """
    moments = np.array([c for c in contacts if t[0] < c < t[-1] and np.abs(t - c).min() > _SAME])
    if len(moments):  # the velocity jumps then, not at the next frame
        rows = len(t)
        t = np.concatenate([t, moments])
        order = np.argsort(t)
        nothing = np.full((len(moments), 2), np.nan)
        all_measured, all_sigma = (
            np.concatenate([part, nothing])[order] for part in (measured, sigma)
        )
        found = smooth_path(
            t[order],
            all_measured,
            all_sigma,
            released=released,
            contacts=contacts,
            scaled=scaled,
        )
        return found.at(order < rows)
    seen = np.isfinite(measured[:, 0])
    states = _States(t, np.nan_to_num(measured), released, contacts)
    weight, scale = seen.astype(np.float64), 1.0
    velocity = np.zeros((len(t), 2))
    for k in range(2):
        velocity[:, k] = np.gradient(np.interp(t, t[seen], measured[seen, k]), t)
    width = max(1, len(t) // 20)
    velocity = np.column_stack(
        [np.convolve(axis, np.ones(width) / width, "same") for axis in velocity.T]
    )
    variance = np.full((len(t), 2), np.inf)
    place = spread = miss = velocity
    for turn in range(_PASSES):
        used = seen & (weight > 0)
        variance[used] = (scale * sigma[used]) ** 2 / weight[used, None]
        states.head(velocity)
        states.settle(variance, turn)
        place, velocity, spread = states.smoothed(variance)
        miss = np.where(seen[:, None], measured - place, 0.0)
        own = np.where(seen[:, None], (scale * sigma) ** 2, 1.0)
        left = (miss**2 / own).mean(axis=1)
        if scaled and turn > 0:
            free = np.sqrt(np.median(left[seen]) / _MEDIAN)
            scale *= float(np.clip(free, 0.2, 5.0))
        freedom = tuning.STUDENT_FREEDOM
        weight = np.where(seen, (freedom + 2) / (freedom + 2 * left), 0.0)
    rest = states.rests
    return SmoothPath(
        t=t,
        place=place,
        velocity=velocity,
        sigma=np.sqrt(np.maximum(spread, 0.0)),
        weight=weight,
        off=np.hypot(*miss.T),
        scale=scale,
        rests_from=float(t[rest]) if rest < len(t) else np.inf,
    )


_MEDIAN = 0.5 * 1.678
"""Median of half of a sum of two squares, Student-distributed with 4 degrees of freedom."""
_MEDIAN_OF_ONE = 0.549
"""Median of one such square."""


def smooth_heading(t: Floats, measured: Floats, sigma: Floats) -> tuple[Floats, Floats, Floats]:
    """Heading [rad], spin [rad/s] and the standard error of the heading, each (n,).

    Parameters
    ----------
    t : (n,) increasing times [s]
    measured, sigma : (n,) unwrapped headings and their standard errors up to a common factor [rad];
        NaN without a heading
    """
    n = len(t)
    seen = np.isfinite(measured) & np.isfinite(sigma)
    theta, nothing = np.nan_to_num(measured), np.zeros(n)
    change, memory = np.full(n, tuning.SPIN_CHANGE), np.full(n, tuning.DECELERATION_MEMORY)
    before, after = np.empty((2, n, 3))
    before_p, after_p = np.empty((2, n, 3, 3))
    weight, scale = seen.astype(np.float64), 1.0
    freedom = tuning.STUDENT_FREEDOM
    for _ in range(_PASSES):
        variance = np.full(n, np.inf)
        variance[seen] = (scale * sigma[seen]) ** 2 / weight[seen]
        filtered(
            t, theta, variance, nothing, change, memory, nothing, n,
            before, before_p, after, after_p,
        )  # fmt: skip
        smoothed_back(t, change, n, before, before_p, after, after_p, np.empty((4, 3, 3)))
        left = ((theta - after[:, 0])[seen] / (scale * sigma[seen])) ** 2
        scale *= float(np.clip(np.sqrt(np.median(left) / _MEDIAN_OF_ONE), 0.2, 5.0))
        weight[seen] = (freedom + 1) / (freedom + left)
    return after[:, 0], after[:, 1], np.sqrt(np.maximum(after_p[:, 0, 0], 0.0))


class _States:
    """The two coordinates, their expected accelerations, and filtered and smoothed states."""

    def __init__(
        self, t: Floats, measured: Floats, released: float, contacts: Sequence[float]
    ) -> None:
        self._t, self._measured = t, measured
        n = len(t)
        self._held: Flags = t <= released
        self._jump = np.zeros(n)
        for contact in contacts:
            at = int(np.searchsorted(t, contact))
            if 0 < at < n:
                self._jump[at] = tuning.JUMP_SIGMA**2
        self._after_contacts = max(contacts, default=-np.inf)
        self._memory = np.zeros(n)
        self._expected, self._sigma = np.zeros((2, n)), np.zeros((2, n))
        self._velocity = np.zeros((n, 2))
        self._before, self._after = np.empty((2, 2, n, 3))
        self._before_p, self._after_p = np.empty((2, 2, n, 3, 3))
        self._work = np.empty((4, 3, 3))
        self.rests = n

    def head(self, velocity: Floats) -> None:
        """Set the expected acceleration from the velocity (n, 2) [m/s]."""
        self._velocity = velocity
        speed = np.hypot(*velocity.T)
        fast = np.flatnonzero(speed > _LEAST_SPEED)
        if len(fast):
            last = fast[np.clip(np.searchsorted(fast, np.arange(len(speed)), "right") - 1, 0, None)]
            way = velocity[last] / speed[last, None]
        else:
            way = np.zeros_like(velocity)
        expected, sigma, self._memory = acceleration_of(way, self._held)
        self._expected, self._sigma = expected.T.copy(), sigma.T.copy()

    def settle(self, variance: Floats, turn: int) -> None:
        """Set the most likely frame in which it comes to rest."""
        n = len(self._t)
        if turn == 0:
            return
        speed = np.hypot(*self._velocity.T)
        later = np.flatnonzero((self._t > self._after_contacts) & ~self._held)
        if not len(later):
            return
        moving = later[speed[later] > 2 * tuning.DECELERATION * 0.2]
        guess = int(moving[-1]) if len(moving) else int(later[0])
        low, high = max(guess - n // 10, int(later[0])), min(guess + n // 5, n)
        while True:
            tried = np.unique(np.linspace(low, high, _REST_CANDIDATES).astype(int))
            values = [self._likelihood(variance, int(k)) for k in tried]
            at = int(np.argmax(values))
            self.rests = int(tried[at])
            if high - low < _REST_CANDIDATES:
                return
            low, high = int(tried[max(at - 1, 0)]), int(tried[min(at + 1, len(tried) - 1)])

    def _likelihood(self, variance: Floats, rests: int) -> float:
        return sum(self._filter(k, variance, rests) for k in range(2))

    def _filter(self, k: int, variance: Floats, rests: int) -> float:
        return filtered(
            self._t, self._measured[:, k].copy(), variance[:, k].copy(), self._expected[k],
            self._sigma[k], self._memory, self._jump, rests,
            self._before[k], self._before_p[k], self._after[k], self._after_p[k],
        )  # fmt: skip

    def smoothed(self, variance: Floats) -> tuple[Floats, Floats, Floats]:
        """Place, velocity and the place's variance, each (n, 2)."""
        for k in range(2):
            self._filter(k, variance, self.rests)
            smoothed_back(
                self._t, self._sigma[k], self.rests,
                self._before[k], self._before_p[k], self._after[k], self._after_p[k], self._work,
            )  # fmt: skip
        velocity = self._after[:, :, 1].T.copy()
        velocity[self.rests :] = 0.0
        return self._after[:, :, 0].T.copy(), velocity, self._after_p[:, :, 0, 0].T.copy()
