"""Where a stone should be: as it slid so far, and as stones go on that touch each other."""

from __future__ import annotations

import numpy as np

from curling_env.typing import Floats
from friction_estimation.tracking import tuning
from friction_estimation.tracking.detection.thrown_stone import RoughPath, slid_on


class ExtrapolatedPath:
    """Where a stone should be: on a path that is known beforehand, then as it slid so far.

    Parameters
    ----------
    known : its rough path, or the place where it lies (2,) [m]
    until : until when that holds [s]
    """

    def __init__(self, known: RoughPath | Floats, until: float) -> None:
        self._known, self._until = known, until
        self._recent: list[tuple[float, Floats]] = []
        self._set_out: tuple[float, Floats, Floats] | None = None

    def add(self, t: float, xy: Floats) -> None:
        """Take in where the stone was seen."""
        self._recent = [*self._recent[1 - tuning.RECENT_FITS :], (t, xy)]

    def restart(self, t: float) -> None:
        """Forget the path before a contact at a time [s]."""
        self._until = t
        self._recent = self._recent[-1:]

    def set_out(self, t: float, xy: Floats, velocity: Floats) -> None:
        """Go on from a contact at a time [s], from a place (2,) [m] with a velocity (2,) [m/s]."""
        self.restart(min(t, self._until))
        self._recent = []
        self._set_out = t, xy, velocity

    def leads(self, t: float) -> bool:
        """Whether the path tells best where the stone is at a time [s]."""
        return t < self._until and isinstance(self._known, RoughPath) and self._known.leads(t)

    def at(self, t: float) -> Floats:
        """Place at a time [s], (2,) [m]."""
        known = self._known
        if isinstance(known, RoughPath):
            if t < min(self._until, known.sightings[-1].t):
                return known.at(t)
        elif t < self._until:
            return known
        motion = self.motion()
        if motion is None:
            return known.at(t) if isinstance(known, RoughPath) else known
        last, place, velocity = motion
        return place + slid_on(velocity, t - last)

    def doubt(self, t: float) -> float:
        """Nothing [m]: the path goes on from where the stone was seen last."""
        return 0.0

    def motion(self) -> tuple[float, Floats, Floats] | None:
        """The latest time [s], place (2,) [m] and velocity (2,) [m/s] known; None if none is."""
        if not self._recent:
            return self._set_out
        last, place = self._recent[-1]
        if len(self._recent) < 3:
            return last, place, np.zeros(2) if self._set_out is None else self._set_out[2]
        times = np.array([time for time, _ in self._recent]) - last
        places = np.array([xy for _, xy in self._recent])
        return last, place, np.polynomial.polynomial.polyfit(times, places, 1)[1]

    def meets(self, xy: Floats, touching: float, until: float) -> float | None:
        """When it comes to touch a stone that lies at a place (2,) [m]; None if not in time.

        Parameters
        ----------
        touching : how far the centres are apart then [m]
        until : latest time [s]
        """
        motion = self.motion()
        if motion is None:
            return None
        last, place, velocity = motion
        wait = time_to_touch(place - xy, velocity, touching)
        if wait is None or not -tuning.MAX_CONTACT_DELAY / 2 < wait <= until - last:
            return None
        return last + wait


def time_to_touch(apart: Floats, velocity: Floats, touching: float) -> float | None:
    """After what time the centres of two stones are so far apart as they come nearer [s].

    Parameters
    ----------
    apart : (2,) from one to the other, which comes nearer [m]
    velocity : (2,) of the other [m/s]
    touching : [m]

    Returns
    -------
    negative where that was before; None where it stands or passes by
    """
    square = float(velocity @ velocity)
    if square < tuning.STANDS**2:
        return None
    nearest = -float(apart @ velocity) / square
    aside = float(apart @ apart) - nearest**2 * square
    if aside > touching**2:
        return None
    return nearest - float(np.sqrt((touching**2 - aside) / square))


def after_contact(at: Floats, hit: Floats, velocity: Floats) -> tuple[Floats, Floats]:
    """Velocities (2,) [m/s] of a stone that hits another of its weight at rest, and of that one.

    Parameters
    ----------
    at, hit : (2,) places of the two when they touch [m]
    velocity : (2,) of the stone that comes [m/s]
    """
    normal = (hit - at) / max(float(np.linalg.norm(hit - at)), 1e-9)
    given = tuning.GIVEN_ON * max(float(velocity @ normal), 0.0) * normal
    return velocity - given, given
