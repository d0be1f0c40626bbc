"""Motion of one stone: a Kalman filter of each coordinate, and its backward pass.

The state of a coordinate is position, velocity and the deviation of the acceleration from that of a
stone on ice. The deviation is a random walk, slow while the stone slides and fast while someone
holds it. A collision lets the velocity jump; a stone at rest has none.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from curling_env.physics.compiled import compiled
from curling_env.typing import Floats
from friction_estimation.tracking import tuning

REST_SIGMA = 0.01
"""Standard deviation of the velocity in the first frame in which a stone rests [m/s]."""


HELD_MEMORY = 0.5
"""Memory of the acceleration of a stone that someone holds, see `predict` [s]."""


def acceleration_of(way: Floats, held: ArrayLike) -> tuple[Floats, Floats, Floats]:
    """Return what is known of the acceleration of stones on ice.

    Parameters
    ----------
    way : (..., 2) direction of travel, a unit vector; shorter where the stone hardly moves
    held : (...) whether someone holds it

    Returns
    -------
    its mean and standard deviation (..., 2) [m/s²], and its memory (...), see `predict`
    """
    hand = np.asarray(held)[..., None]
    slides = np.hypot(tuning.DECELERATION_SIGMA * way, tuning.CURL_SIGMA * way[..., ::-1])
    sigma = np.where(hand, tuning.CARRIED_ACCELERATION, np.maximum(slides, tuning.CURL_SIGMA))
    mean = np.where(hand, 0.0, -tuning.DECELERATION * way)
    return mean, sigma, np.where(held, HELD_MEMORY, tuning.DECELERATION_MEMORY)


@dataclass(eq=False)
class Motion:
    """Place and velocity of a stone, predicted to a time and corrected by what is seen then.

    Parameters
    ----------
    t : time [s]
    state, p : (2, 3) state of each coordinate, and (2, 3, 3) its covariance
    """

    t: float = -np.inf
    state: Floats = field(default_factory=lambda: np.zeros((2, 3)))
    p: Floats = field(default_factory=lambda: np.zeros((2, 3, 3)))

    @property
    def place(self) -> Floats:
        """Place, (2,) [m]."""
        return self.state[:, 0].copy()

    @property
    def velocity(self) -> Floats:
        """Velocity, (2,) [m/s]."""
        return self.state[:, 1].copy()

    @property
    def variance(self) -> Floats:
        """Variance of the place, (2,) [m²]."""
        return self.p[:, 0, 0].copy()

    def put(self, t: float, place: Floats, velocity: Floats, *sigma: float) -> None:
        """Set the state at a time [s].

        Parameters
        ----------
        place, velocity : (2,) [m] and [m/s]
        sigma : standard errors of both [m] and [m/s]
        """
        self.t = t
        self.state[:] = np.column_stack([place, velocity, np.zeros(2)])
        self.p[:] = np.diag(np.square([*sigma, tuning.DECELERATION_SIGMA]))

    def move_to(self, t: float, *, held: bool = False) -> None:
        """Predict the state at a later time [s]; a stone that is not held may stop before."""
        dt, speed = t - self.t, float(np.hypot(*self.state[:, 1]))
        self.t = t
        if not held and speed < tuning.DECELERATION * dt:
            self.state[:, 0] += 0.5 * self.state[:, 1] * speed / tuning.DECELERATION
            self.state[:, 1:] = 0.0
            self.p[:, 0, 0] += (tuning.REST_SPEED_SIGMA * dt) ** 2
            return
        way = self.state[:, 1] / max(speed, tuning.LEAST_SPEED)
        mean, sigma, memory = acceleration_of(way, held)
        state, p = self.state.copy(), self.p.copy()
        for k in range(2):
            predict(dt, mean[k], sigma[k], float(memory), state[k], p[k], self.state[k], self.p[k])

    def correct(self, xy: Floats, variance: Floats) -> None:
        """Correct the state by a place (2,) [m] with the variances of its coordinates (2,)."""
        for k in range(2):
            correct(0, xy[k], variance[k], self.state[k], self.p[k])


@compiled
def predict(dt, expected, sigma, memory, state, p, ahead, ahead_p):
    """Predict state (3,) and covariance (3, 3) a time `dt` later, in place of `ahead`, `ahead_p`.

    Parameters
    ----------
    dt : time to predict over [s]
    expected : mean acceleration of this coordinate [m/s²]
    sigma : standard deviation of the acceleration about it [m/s²]
    memory : half the time in which the deviation changes by about `sigma` [s]
    """
    half = 0.5 * dt * dt
    ahead[0] = state[0] + dt * state[1] + half * (state[2] + expected)
    ahead[1] = state[1] + dt * (state[2] + expected)
    ahead[2] = state[2]
    for j in range(3):
        ahead_p[0, j] = p[0, j] + dt * p[1, j] + half * p[2, j]
        ahead_p[1, j] = p[1, j] + dt * p[2, j]
        ahead_p[2, j] = p[2, j]
    for i in range(3):
        a, b, c = ahead_p[i, 0], ahead_p[i, 1], ahead_p[i, 2]
        ahead_p[i, 0] = a + dt * b + half * c
        ahead_p[i, 1] = b + dt * c
    new = 2 * sigma * sigma * dt / memory
    ahead_p[0, 0] += new * dt**4 / 20
    ahead_p[0, 1] += new * dt**3 / 8
    ahead_p[1, 0] += new * dt**3 / 8
    ahead_p[0, 2] += new * dt**2 / 6
    ahead_p[2, 0] += new * dt**2 / 6
    ahead_p[1, 1] += new * dt**2 / 3
    ahead_p[1, 2] += new * dt / 2
    ahead_p[2, 1] += new * dt / 2
    ahead_p[2, 2] += new


@compiled
def correct(which, value, variance, state, p):
    """Correct state and covariance by a measured component, in place; returns its innovation.

    Returns
    -------
    the innovation and its variance
    """
    total = p[which, which] + variance
    miss = value - state[which]
    a, b, c = p[0, which], p[1, which], p[2, which]
    for i in range(3):
        share = (a, b, c)[i] / total
        state[i] += share * miss
        p[i, 0] -= share * a
        p[i, 1] -= share * b
        p[i, 2] -= share * c
    for i in range(3):
        for j in range(i):
            p[i, j] = p[j, i] = 0.5 * (p[i, j] + p[j, i])
    return miss, total


@compiled
def _clear(state, p):
    for i in range(3):
        state[i] = 0.0
        for j in range(3):
            p[i, j] = 0.0


@compiled
def filtered(
    t, z, variance, expected, sigma, memory, jump, rests, before, before_p, after, after_p
):
    """Filter one coordinate over all frames; returns the log likelihood.

    Parameters
    ----------
    t : (n,) times [s]
    z, variance : (n,) measurements [m] and their variances [m²]; infinite without a measurement
    expected, sigma, memory : (n,) as of `predict`, for the step that ends with each frame
    jump : (n,) variance of the jump of the velocity in that step [m²/s²]
    rests : index of the first frame in which the stone rests; n if it does not
    before, before_p, after, after_p : (n, 3) and (n, 3, 3) predicted and filtered states, filled
    """
    likelihood, seen = 0.0, 0
    for k in range(len(t)):
        if k == 0:
            _clear(before[0], before_p[0])
            before_p[0, 0, 0], before_p[0, 1, 1], before_p[0, 2, 2] = 1e4, 10.0, sigma[0] ** 2
        elif k > rests:
            _clear(before[k], before_p[k])
            before[k, 0] = after[k - 1, 0]
            before_p[k, 0, 0] = after_p[k - 1, 0, 0]
        else:
            predict(
                t[k] - t[k - 1], expected[k], sigma[k], memory[k],
                after[k - 1], after_p[k - 1], before[k], before_p[k],
            )  # fmt: skip
            if sigma[k] < 0.5 * sigma[k - 1]:  # the hand's acceleration is not the ice's
                before[k, 2] = 0.0
                for i in range(2):
                    before_p[k, i, 2] = before_p[k, 2, i] = 0.0
                before_p[k, 2, 2] = sigma[k] ** 2
            before_p[k, 1, 1] += jump[k]
        for i in range(3):
            after[k, i] = before[k, i]
            for j in range(3):
                after_p[k, i, j] = before_p[k, i, j]
        if k == rests:
            miss, total = correct(1, 0.0, REST_SIGMA**2, after[k], after_p[k])
            likelihood -= 0.5 * (math.log(total) + miss * miss / total)
        if variance[k] < 1e30:
            miss, total = correct(0, z[k], variance[k], after[k], after_p[k])
            seen += 1
            if seen > 2:
                likelihood -= 0.5 * (math.log(total) + miss * miss / total)
    return likelihood


@compiled
def smoothed_back(t, sigma, rests, before, before_p, after, after_p, work):
    """Turn filtered states into smoothed ones, in place.

    Parameters
    ----------
    as of `filtered`; `work` is (4, 3, 3)
    """
    inverse, carried, gain, apart = work[0], work[1], work[2], work[3]
    for k in range(len(t) - 2, -1, -1):
        p = before_p[k + 1]
        if k >= rests:  # only the position is kept
            miss = after[k + 1, 0] - before[k + 1, 0]
            less = (after_p[k + 1, 0, 0] - p[0, 0]) / (p[0, 0] + 1e-18)
            a, b, c = after_p[k, 0, 0], after_p[k, 1, 0], after_p[k, 2, 0]
            for i in range(3):
                share = (a, b, c)[i] / (p[0, 0] + 1e-18)
                after[k, i] += share * miss
                after_p[k, i, 0] += share * less * a
                after_p[k, i, 1] += share * less * b
                after_p[k, i, 2] += share * less * c
            continue
        dt = t[k + 1] - t[k]
        half = 0.5 * dt * dt
        kept = 0.0 if sigma[k + 1] < 0.5 * sigma[k] else 1.0
        for i in range(3):  # the inverse by cofactors
            a, b = (i + 1) % 3, (i + 2) % 3
            for j in range(3):
                c, d = (j + 1) % 3, (j + 2) % 3
                inverse[j, i] = p[a, c] * p[b, d] - p[a, d] * p[b, c]
        det = p[0, 0] * inverse[0, 0] + p[0, 1] * inverse[1, 0] + p[0, 2] * inverse[2, 0]
        for i in range(3):  # after_p Fᵀ
            carried[i, 2] = kept * after_p[k, i, 2]
            carried[i, 1] = after_p[k, i, 1] + dt * after_p[k, i, 2]
            carried[i, 0] = after_p[k, i, 0] + dt * after_p[k, i, 1] + half * after_p[k, i, 2]
        for i in range(3):
            for j in range(3):
                total = 0.0
                for m in range(3):
                    total += carried[i, m] * inverse[m, j]
                gain[i, j] = total / det
                apart[i, j] = after_p[k + 1, i, j] - p[i, j]
        for i in range(3):
            for j in range(3):
                after[k, i] += gain[i, j] * (after[k + 1, j] - before[k + 1, j])
        for i in range(3):
            for j in range(3):
                total = 0.0
                for m in range(3):
                    for n in range(3):
                        total += gain[i, m] * apart[m, n] * gain[j, n]
                after_p[k, i, j] += total
