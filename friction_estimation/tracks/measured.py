"""Numbers with their standard errors."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np


class Measured(NamedTuple):
    """A measured number.

    Parameters
    ----------
    value : in SI units
    sigma : its standard error; None where the track states no errors and too few rows show them
    """

    value: float
    sigma: float | None = None


def difference(start: Measured | None, stop: Measured | None) -> Measured | None:
    """From one time to a later one; None where one of them is not known, or is not the later."""
    if start is None or stop is None or stop.value <= start.value:
        return None
    return Measured(stop.value - start.value, together(start.sigma, stop.sigma))


def together(*sigmas: float | None) -> float | None:
    """The standard error of a sum; what is not known is left out."""
    known = [sigma for sigma in sigmas if sigma is not None]
    return float(np.sqrt(sum(sigma**2 for sigma in known))) if known else None


def times(sigma: float | None, factor: float) -> float | None:
    """The standard error of a multiple; None where it is not known."""
    return None if sigma is None else abs(factor) * sigma
