"""Identity of stones after a contact: all moving stones are followed together from there.

At a contact, a path of the association continues with the stone that keeps its velocity. From the
first contact on the stones are therefore followed together, frame by frame. At a contact the
velocities jump as those of two equal masses along the line of their centres; in every frame the
detections are assigned to the stones at the lowest total cost.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.optimize import linear_sum_assignment

from curling_env.typing import Floats, Integers
from friction_estimation.tracking import tuning
from friction_estimation.tracking.association.motion import Motion
from friction_estimation.tracking.association.paths import RESTING, SLIDING, Path
from friction_estimation.tracking.detection.detections import Detections


@dataclass(frozen=True, kw_only=True, eq=False)
class RestingPlace:
    """Resting place of a stone when the film begins.

    Parameters
    ----------
    xy : (2,) the place [m]
    until : when it is seen there last [s]; infinite where it stays
    at : indices of its detections there
    """

    xy: Floats
    until: float
    at: Integers


@dataclass(eq=False)
class Mover:
    """Moving stone.

    Parameters
    ----------
    at, mode : indices of its detections and its mode at each
    contacts : about when it touches others [s]
    rested : where it rested at first; None for one that did not
    """

    at: list[int]
    mode: list[int]
    contacts: list[float] = field(default_factory=list)
    rested: RestingPlace | None = None
    motion: Motion = field(default_factory=Motion)

    def cost(self, xy: Floats, variance: Floats) -> Floats:
        """Return `misses` with the normalisation of the errors, (n,)."""
        return self.misses(xy, variance) + np.log(self.motion.variance + variance).sum(axis=1)

    def misses(self, xy: Floats, variance: Floats) -> Floats:
        """Squared distances of detections (n, 2) [standard errors], (n,)."""
        total = self.motion.variance + variance
        return ((xy - self.motion.place) ** 2 / total).sum(axis=1)

    def add(self, at: int, seen: Detections) -> None:
        """Update it with a detection."""
        self.motion.correct(seen.xy[at], seen.sigma[at] ** 2)
        self.at.append(at)
        self.mode.append(SLIDING)


def vacated_near(
    path: Path, places: Sequence[RestingPlace], seen: Detections, touching: float
) -> list[RestingPlace]:
    """Return places that stones leave while a path passes near them, in order of time.

    Parameters
    ----------
    path : of a stone that moves
    places : where stones rest at first
    seen : all detections
    touching : distance of the centres of two stones that touch [m]
    """
    t, xy = seen.t[path.at], seen.xy[path.at]
    reach = 3 * (touching + 2 * tuning.SAME_PLACE)
    left: list[RestingPlace] = []
    for place in places:
        around = np.abs(t - place.until) < 2 * tuning.CONTACT_WITHIN
        near = np.hypot(*(xy[around] - place.xy).T).min(initial=np.inf) < reach
        if near and t[0] < place.until < np.inf:
            left.append(place)
    return sorted(left, key=lambda place: place.until)


def link(
    thrown: Path, places: Sequence[RestingPlace], seen: Detections, touching: float
) -> list[Mover]:
    """Return the thrown stone and the struck ones, in order of their contacts.

    Parameters
    ----------
    thrown : path of the association
    places : where stones rest at first
    seen : all detections
    touching : distance of the centres of two stones that touch [m]
    """
    t = seen.t[thrown.at]
    events = vacated_near(thrown, places, seen, touching)
    rests = np.zeros(len(seen.t), dtype=bool)
    for place in places:
        rests[place.at] = True
    first = Mover(at=thrown.at.tolist(), mode=thrown.mode.tolist())
    if not events:
        return [first]
    begin = events[0].until
    kept = thrown.at[t <= begin + 1e-6]
    if len(kept) < 2:
        return [first]
    movers = [Mover(at=kept.tolist(), mode=thrown.mode[: len(kept)].tolist())]
    last = kept[-tuning.LINK_FITS :]
    place, velocity = np.polynomial.polynomial.polyfit(seen.t[last] - begin, seen.xy[last], 1)
    movers[0].motion.put(begin, place, velocity, tuning.DETECTION_M, 0.1)
    for moment in seen.times[seen.times > begin]:
        while events and events[0].until < moment:
            _hit(movers, events.pop(0), touching)
        for one in movers:
            one.motion.move_to(float(moment))
        here = np.flatnonzero((seen.t == moment) & ~rests & ~seen.still)
        if not len(here):
            continue
        there, variance = seen.xy[here], seen.sigma[here] ** 2
        cost = np.array([one.cost(there, variance) for one in movers])
        misses = np.array([one.misses(there, variance) for one in movers])
        cost = np.where(misses < tuning.LINK_GATE, cost - 2 * seen.score[here], _FAR)
        for row, column in zip(*linear_sum_assignment(cost), strict=True):
            if cost[row, column] < _FAR:
                movers[row].add(int(here[column]), seen)
    return movers


_FAR = 1e6
"""Cost of an unassigned detection."""


def _hit(movers: list[Mover], place: RestingPlace, touching: float) -> None:
    """Apply a contact of the nearest moving stone with a resting one, if it is near enough."""
    rested, when = place.xy, place.until + tuning.DENSE_STEP / 2
    striker = min(movers, key=lambda one: float(np.hypot(*(one.motion.place - rested))))
    way = rested - striker.motion.place
    if np.hypot(*way) > touching + 2 * tuning.SAME_PLACE:
        return
    velocity = striker.motion.velocity
    speed = float(np.hypot(*velocity))
    # it has reached the distance of contact
    along = velocity / max(speed, 1e-9)
    ahead = float(way @ along)
    aside = way - ahead * along
    room = touching**2 - float(aside @ aside)
    at = striker.motion.place + (ahead - np.sqrt(max(room, 0.0))) * along
    normal = (rested - at) / max(float(np.hypot(*(rested - at))), 1e-9)
    given = tuning.COLLISION_TRANSFER * max(float(velocity @ normal), 0.0) * normal
    sigma = tuning.COLLISION_SIGMA * speed
    last = place.at[-3:].tolist()
    struck = Mover(at=last, mode=[RESTING] * len(last), contacts=[when], rested=place)
    for one, there, new in ((striker, at, velocity - given), (struck, rested, given)):
        one.motion.put(when, there, new, tuning.DETECTION_M, sigma)
    striker.contacts.append(when)
    movers.append(struck)
