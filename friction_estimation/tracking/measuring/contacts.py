"""Contact times: moments at which the distance of a path from a resting stone is two radii."""

from __future__ import annotations

import numpy as np

from curling_env.typing import Floats
from friction_estimation.tracking import tuning
from friction_estimation.tracking.measuring.measurements import Measurements


def contact_time(
    striker: Measurements, rested: Floats, touching: float, about: float
) -> float | None:
    """Return the time at which a stone touches a resting one [s]; None if its path passes by or
    ends.

    Parameters
    ----------
    striker : measurements of the stone that comes
    rested : (2,) where the other one rests [m]
    touching : distance of their centres then [m]
    about : latest time [s]
    """
    seen = [
        (t, fit.xy)
        for t, fit in zip(striker.t, striker.fits, strict=True)
        if fit is not None and about - tuning.CONTACT_WITHIN < t < about
    ]
    away = np.array([np.hypot(*(xy - rested)) for _, xy in seen])
    if not len(away):
        return None
    met = np.flatnonzero(away < touching + tuning.DETECTION_M)
    nearest = int(met[0]) if len(met) else int(np.argmin(away))
    seen = seen[max(nearest - tuning.CONTACT_FITS, 0) : nearest]
    if len(seen) < 3:
        return None
    t = np.array([moment for moment, _ in seen])
    places = np.array([xy for _, xy in seen]) - rested
    start, velocity = np.polynomial.polynomial.polyfit(t - t[-1], places, 1)
    square = float(velocity @ velocity)
    if square < tuning.LEAST_SPEED**2:
        return None
    until = -float(start @ velocity) / square
    aside = float(start @ start) - until**2 * square
    if aside > (touching + tuning.DETECTION_M) ** 2:
        return None
    return float(t[-1] + until - np.sqrt(max(touching**2 - aside, 0.0) / square))
