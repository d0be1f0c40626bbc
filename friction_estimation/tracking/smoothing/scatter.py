"""Stretches where the measured places of a stone scatter as those of no stone do.

A stone slides smoothly. Where something is beside it that looks like it, such as a broom, now one
and now the other is measured: the places jump to and fro, and even where they agree for a while
they may be those of the wrong thing.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from curling_env.typing import Floats
from friction_estimation.appearance import StoneFit
from friction_estimation.camera.camera import Camera
from friction_estimation.tracking import numbers


@dataclass(frozen=True, kw_only=True)
class Scattered:
    """A stretch of a path whose places scatter.

    Parameters
    ----------
    first, last : first and last time [s]
    by : the most that they scatter around a smooth path [m]
    """

    first: float
    last: float
    by: float

    @property
    def is_wild(self) -> bool:
        """Return whether its places are useless, even with their errors.

        Where a stone is hit, its places are off a smooth path as well, but for a moment only.
        """
        return self.by > numbers.WILD_SCATTER and self.last - self.first > numbers.WILD_SECONDS


def scattered(
    t: Floats, fits: Sequence[StoneFit | None], camera: Camera, height: float
) -> list[Scattered]:
    """The stretches in which measured places scatter far more than elsewhere in the film.

    Parameters
    ----------
    t, fits : (n,) times [s] and measurements; None where the stone was not seen
    height : at which the stone is seen, above the ice [m]
    """
    seen = [k for k, fit in enumerate(fits) if fit is not None]
    if len(seen) < 2 * numbers.LEAST_SCATTERED:
        return []
    moments = np.asarray(t)[seen]
    xy = np.array([fit.xy for fit in fits if fit is not None])
    pixel = metres_per_px(camera, xy, height)
    spread = _around_smooth(moments, xy)
    far = (
        spread > max(numbers.SCATTER_PX, numbers.SCATTER_TIMES * np.median(spread / pixel)) * pixel
    )
    far &= spread > numbers.LEAST_SCATTER
    at = np.flatnonzero(far)
    if not len(at):
        return []
    apart = np.flatnonzero(np.diff(moments[at]) > numbers.SCATTER_APART) + 1
    return [
        Scattered(
            first=float(moments[part[0]]),
            last=float(moments[part[-1]]),
            by=float(spread[part].max()),
        )
        for part in np.split(at, apart)
    ]


def without_wild(
    t: Floats, fits: Sequence[StoneFit | None], stretches: Sequence[Scattered]
) -> list[StoneFit | None]:
    """The measurements without those of stretches that tell nothing."""
    wild = [one for one in stretches if one.is_wild]
    return [
        None if any(one.first <= now <= one.last for one in wild) else fit
        for now, fit in zip(t, fits, strict=True)
    ]


def scatter_sigma(t: Floats, stretches: Sequence[Scattered]) -> Floats:
    """Standard error of each coordinate by that, (n,) [m]; 0 outside of the stretches.

    Parameters
    ----------
    t : (n,) times [s]
    """
    sigma = np.zeros(len(t))
    for one in stretches:
        within = (t >= one.first) & (t <= one.last)
        sigma[within] = numbers.SCATTER_ERROR * one.by
    return sigma


def metres_per_px(camera: Camera, xy: Floats, height: float) -> Floats:
    """The most that a pixel in the picture is on the ice at places (n, 2) [m], (n,) [m]."""
    return 1 / np.linalg.norm(camera.px_per_metre(xy, height), -2, axis=(1, 2))


def _around_smooth(t: Floats, xy: Floats) -> Floats:
    """Return the scatter of places around each time about a parabola, (n,) [m]; 0 where few are."""
    spread = np.zeros(len(t))
    for k, now in enumerate(t):
        first, last = np.searchsorted(
            t, (now - numbers.SCATTER_AROUND, now + numbers.SCATTER_AROUND)
        )
        if last - first < numbers.LEAST_SCATTERED:
            continue
        since = t[first:last] - now
        powers, _ = np.linalg.qr(np.column_stack([np.ones_like(since), since, since**2]))
        left = xy[first:last] - powers @ (powers.T @ xy[first:last])
        spread[k] = np.sqrt((left**2).sum(axis=0).max() / (last - first - 3))
    return spread
