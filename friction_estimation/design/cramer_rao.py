"""Cramér–Rao bounds of friction measured from tracks: the σ that no unbiased method can beat.

They serve to plan a measurement and to judge an estimator. No code is shared with the estimator:
stones slide straight under Coulomb friction, in closed form.

Source
------
s(t) = s₀ + v₀t − ½gμt² along the path, release unknown; a field of friction enters by
δs(t) = −g ∫∫ δμ dt dt. Bayesian where a prior field is given (van Trees).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.integrate import cumulative_trapezoid

from curling_env.errors import InputError
from curling_env.physics.motion import GRAVITY
from curling_env.sheet import Sheet
from curling_env.throw import Release
from curling_env.typing import Floats, Indices

_TIME_STEP = 0.01
"""Step of the double integrals [s]."""
_LEVEL_PRIOR_SD = 1.0
"""Prior standard deviation of the level of ln μ: a factor e either way."""


def uniform_bound(
    speeds: ArrayLike, *, mu: float, noise: float, fps: float, distance: float = np.inf
) -> float:
    """Smallest standard error of one μ for the whole sheet.

    Parameters
    ----------
    speeds : release speed of each throw [m/s]
    mu : coefficient of friction
    noise : standard deviation of a measured position [m], independent from frame to frame
    fps : frames a second
    distance : distance over which each throw is seen, at most until it rests [m]

    Raises
    ------
    InputError : a number that is not positive, or throws that are too short
    """
    check_positive(mu=mu, noise=noise, fps=fps)
    information = 0.0
    for speed in np.atleast_1d(np.asarray(speeds, dtype=np.float64)):
        check_positive(speed=float(speed))
        remaining = speed**2 - 2 * GRAVITY * mu * distance
        end = (speed - (np.sqrt(remaining) if remaining > 0 else 0.0)) / (GRAVITY * mu)
        t = np.arange(0.0, end + 1e-9, 1.0 / fps)
        if len(t) < 4:
            continue
        response = _beyond_release(t, -0.5 * GRAVITY * t[:, None] ** 2)
        information += float((response**2).sum()) / noise**2
    if information == 0.0:
        raise InputError("the throws are too short; expected at least 4 frames each")
    return information**-0.5


@dataclass(frozen=True, kw_only=True)
class ThrowResponse:
    """Information of one throw with an unknown release about the cells.

    Parameters
    ----------
    touched : (m,) flat indices of the cells whose friction changes its path
    response : (frames, m) part of ∂s/∂ln μ of those cells that no start and speed can imitate [m]
    crossed : flat indices of the cells that its centre crosses
    """

    touched: Indices
    response: Floats
    crossed: Indices


def throw_response(release: Release, *, mu: float, fps: float, sheet: Sheet) -> ThrowResponse:
    """Return the response of a straight throw's path to the friction of each cell.

    Parameters
    ----------
    release : release of the throw, sheet frame
    mu : level of the friction
    fps : frames a second
    sheet : sheet with its cells
    """
    t, xy = _straight_path(release, mu, sheet)
    by_cell = -GRAVITY * mu * _bilinear_weights(xy, sheet)
    touched = np.flatnonzero(np.abs(by_cell).max(axis=0) > 0)
    seen = np.arange(0.0, t[-1] + 1e-9, 1.0 / fps)
    at = np.clip(np.rint(seen / _TIME_STEP).astype(int), 0, len(t) - 1)
    response = by_cell[:, touched]
    for _ in range(2):
        response = cumulative_trapezoid(response, dx=_TIME_STEP, axis=0, initial=0)
    row, column = sheet.cell_of(xy)
    return ThrowResponse(
        touched=touched,
        response=_beyond_release(t[at], response[at]),
        crossed=np.unique(row * sheet.shape[1] + column),
    )


def matern(distance: Floats, length: float, smoothness: float) -> Floats:
    """Matérn correlation at distances.

    Parameters
    ----------
    distance : distances between two places [m]
    length : correlation length [m]
    smoothness : order of the correlation: 1.5, 2.5 or infinity (Gaussian)
    """
    if smoothness == np.inf:
        return np.exp(-0.5 * (distance / length) ** 2)
    r = np.sqrt(2.0 * smoothness) * distance / length
    return (1.0 + r + (r**2 / 3.0 if smoothness == 2.5 else 0.0)) * np.exp(-r)


def field_covariance(
    sheet: Sheet, *, spread: float, length: float, smoothness: float = 2.5
) -> Floats:
    """Prior covariance of ln μ between all cells: a Matérn field on a poorly known level."""
    x = np.tile(sheet.x_centres, sheet.shape[0])
    y = np.repeat(sheet.y_centres, sheet.shape[1])
    apart = np.hypot(x[:, None] - x, y[:, None] - y)
    return spread**2 * matern(apart, length, smoothness) + _LEVEL_PRIOR_SD**2


def _straight_path(release: Release, mu: float, sheet: Sheet) -> tuple[Floats, Floats]:
    """Times and places until the stone rests or leaves the sheet."""
    t = np.arange(0.0, release.speed / (GRAVITY * mu), _TIME_STEP)
    along = release.speed * t - 0.5 * GRAVITY * mu * t**2
    travel = np.array([release.vx, release.vy]) / release.speed
    xy = np.array([release.x, release.y]) + along[:, None] * travel
    inside = sheet.contains(xy)
    count = len(t) if inside.all() else max(int(np.argmin(inside)), 2)
    return t[:count], xy[:count]


def _bilinear_weights(xy: Floats, sheet: Sheet) -> Floats:
    """Weight of every cell in the bilinear friction at each place, (n, cells)."""

    def hat(at: Floats, centres: Floats) -> Floats:
        held = np.clip(at, centres[0], centres[-1])
        return np.maximum(0.0, 1.0 - np.abs(held[:, None] - centres) / sheet.cell_size)

    across, along = hat(xy[:, 0], sheet.x_centres), hat(xy[:, 1], sheet.y_centres)
    return (along[:, :, None] * across[:, None, :]).reshape(len(xy), -1)


def _beyond_release(t: Floats, response: Floats) -> Floats:
    """Part of a response that differs from that of another start and speed."""
    q, _ = np.linalg.qr(np.column_stack([np.ones_like(t), t]))
    return response - q @ (q.T @ response)


def check_positive(**numbers: float) -> None:
    """Refuse numbers that are not positive and finite, by their names.

    Raises
    ------
    InputError : the first such number
    """
    for name, value in numbers.items():
        if not 0 < value < np.inf:
            raise InputError(f"{name} must be positive and finite, got {value}")
