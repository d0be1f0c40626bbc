"""Distance, speed and acceleration of a tracked stone, by local quadratic fits.

Distance is measured along the path, not along the sheet: curl turns a stone without braking it,
so the speed along the path changes by friction alone.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from curling_env.errors import TrackTooShortError
from curling_env.typing import Floats


@dataclass(frozen=True, kw_only=True)
class SmoothedMotion:
    """Smoothed motion of a stone along its path.

    Parameters
    ----------
    t : (n,) times [s]
    distance : (n,) distance along the path since the first sample [m]
    speed : (n,) speed [m/s]
    acceleration : (n,) acceleration along the path, negative for deceleration [m/s²]
    speed_sigma, acceleration_sigma : (n,) standard errors of the two
    """

    t: Floats
    distance: Floats
    speed: Floats
    acceleration: Floats
    speed_sigma: Floats
    acceleration_sigma: Floats


def local_fit(t: Floats, values: Floats, window: float) -> tuple[Floats, Floats]:
    """Return value and derivatives of a quadratic fitted around every sample.

    This is the Savitzky–Golay filter for times that need not be even, since lost frames leave gaps.

    Parameters
    ----------
    t : (n,) increasing times [s]
    values : (n,) samples
    window : full width of the fit [s]; widened if it contains fewer than 5 samples

    Returns
    -------
    derivatives : (3, n) value, first and second derivative at each sample
    gains : (3, n) standard error of each for independent samples of unit noise

    Raises
    ------
    TrackTooShortError : fewer than 5 samples
    """
    n, least = len(t), 5
    if n < least:
        raise TrackTooShortError(f"expected at least {least} samples, got {n}")
    first = np.searchsorted(t, t - window / 2 - 1e-9)
    last = np.searchsorted(t, t + window / 2 + 1e-9)
    few = last - first < least
    first = np.where(few, np.clip(np.arange(n) - least // 2, 0, n - least), first)
    last = np.where(few, first + least, last)
    # Moments about each sample, summed over the places of the widest window.
    moments, weighted = np.zeros((5, n)), np.zeros((3, n))
    scale = np.maximum(t - t[first], t[last - 1] - t)
    for place in range(int((last - first).max())):
        index = np.minimum(first + place, n - 1)
        inside = first + place < last
        u = (t[index] - t) / scale
        power = inside.astype(np.float64)
        for order in range(5):
            moments[order] += power
            if order < 3:
                weighted[order] += power * values[index]
            power = power * u
    normal = moments[np.add.outer(np.arange(3), np.arange(3))].transpose(2, 0, 1)
    inverse = np.linalg.inv(normal)
    coefficients = np.einsum("nij,jn->in", inverse, weighted)
    size = np.sqrt(np.einsum("nii->in", inverse))
    units = np.stack([np.ones(n), 1.0 / scale, 2.0 / scale**2])
    return coefficients * units, size * units


def smooth_motion(
    t: Floats, xy: Floats, *, window: float = 1.0, noise: float = 0.005
) -> SmoothedMotion:
    """Return distance, speed and acceleration along the path.

    Parameters
    ----------
    t : (n,) times [s]
    xy : (n, 2) measured positions, without outliers [m]
    window : width of the local quadratic fits [s]
    noise : standard deviation of one coordinate, for the standard errors [m]

    Raises
    ------
    TrackTooShortError : fewer than 5 samples

    Source
    ------
    The paper, section 3: speed and acceleration from the distance travelled. σ of a quadratic
    fit over T at f frames a second: σ_a = σ √(720/(fT))/T².
    """
    (x, vx, ax), gains = local_fit(t, xy[:, 0], window)
    (y, vy, ay), _ = local_fit(t, xy[:, 1], window)
    speed = np.hypot(vx, vy)
    acceleration = (vx * ax + vy * ay) / np.maximum(speed, 1e-9)
    steps = np.hypot(np.diff(x), np.diff(y))
    return SmoothedMotion(
        t=t,
        distance=np.concatenate([[0.0], np.cumsum(steps)]),
        speed=speed,
        acceleration=acceleration,
        speed_sigma=noise * gains[1],
        acceleration_sigma=noise * gains[2],
    )
