"""Numbers with their standard errors."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np


class Measured(NamedTuple):
    """Measured number.

    Parameters
    ----------
    value : in SI units
    sigma : its standard error; None if the track states no errors and has too few rows for an
        estimate
    """

    value: float
    sigma: float | None = None


def difference(start: Measured | None, stop: Measured | None) -> Measured | None:
    """Return the difference from one time to a later one; None if one is unknown, or not later."""
    if start is None or stop is None or stop.value <= start.value:
        return None
    return Measured(stop.value - start.value, together(start.sigma, stop.sigma))


def together(*sigmas: float | None) -> float | None:
    """Return the standard error of a sum; unknown ones are ignored."""
    known = [sigma for sigma in sigmas if sigma is not None]
    return float(np.sqrt(sum(sigma**2 for sigma in known))) if known else None


def times(sigma: float | None, factor: float) -> float | None:
    """Return the standard error of a multiple; None if unknown."""
    return None if sigma is None else abs(factor) * sigma
