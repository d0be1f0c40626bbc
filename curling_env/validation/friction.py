"""Values of the rows on friction against speed, and on one shot measured from end to end."""

from __future__ import annotations

import math

import numpy as np

from curling_env.ice import ActiveEffect, Ice
from curling_env.sheet import Stone
from curling_env.validation.shots import Shots

SAMPLES_PER_SECOND = 200.0
JENSEN_SPEED, JENSEN_SPIN = 2.09, 1.01
"""Speed and spin of the published shot [m/s, rad/s]."""
JENSEN_DISTANCE = 25.6
_POINT_CONTACT = Stone(band_radius=0.0)


def friction_between(shots: Shots, fast: float, slow: float) -> float | None:
    """Return the mean deceleration over g between two speeds, as measured on a film.

    The stone is that of a draw, with its spin at that point; above draw weight that of a faster
    throw.
    """
    speed = max(shots.draw_speed or 0.0, 1.05 * fast)
    path = shots.followed(speed, SAMPLES_PER_SECOND)
    if path is None:
        return None
    middle = 0.5 * (path.t[1:] + path.t[:-1])
    speeds = np.hypot(*np.diff(path.xy, axis=0).T) / np.diff(path.t)
    falling = slice(None, int(np.argmin(speeds)) + 1)
    begin, end = np.interp([-fast, -slow], -speeds[falling], middle[falling])
    return (fast - slow) / (9.80665 * float(end - begin)) if end > begin else None


def steepness(shots: Shots) -> float | None:
    """Return the exponent of the friction's decrease with speed, from 0.25 to 2.15 m/s."""
    slow, fast = friction_between(shots, 0.3, 0.2), friction_between(shots, 2.2, 2.1)
    return None if slow is None or fast is None else math.log(slow / fast) / math.log(2.15 / 0.25)


def jensen_carry(shots: Shots) -> float:
    """Return the distance of the published shot [m]."""
    return shots.carry(JENSEN_SPEED, JENSEN_SPIN)


def jensen(shots: Shots, what: str) -> float | None:
    """Return time, curl or turns of the published shot on the ice scaled to its distance."""
    scaled = shots.scaled_until(jensen_carry, JENSEN_DISTANCE)
    run = None if scaled is None else scaled.run(JENSEN_SPEED, JENSEN_SPIN)
    if run is None:
        return None
    return {"time": run.time, "curl": -run.x, "turns": run.theta / (2 * math.pi)}[what]


def _power_law(exponent: float) -> Shots:
    """Return ice of a power law alone, on a stone whose contact is a point: no spin, no drag."""
    falls = ActiveEffect(name="speed_dependent_friction", parameters={"exponent": exponent})
    return Shots(Ice.uniform(0.008, effects=(falls,), stone=_POINT_CONTACT))


def time_of_power_law(_: Shots, exponent: float) -> float | None:
    """Return the time of the published shot under a power law of friction alone [s]."""
    return jensen(_power_law(exponent), "time")
