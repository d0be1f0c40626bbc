"""Throws that come to rest at a target on the empty sheet, one for each spin and sweeping."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from agents.planning.tuning import REACHED, SPINS, SWEEPS, WEIGHTS_TO_TRY
from curling_env.errors import InputError
from curling_env.ice import Ice
from curling_env.physics.aim import Aim
from curling_env.sheet import BACK_LINE_Y, Direction, to_delivery
from curling_env.throw import FROM_HOG_LINE, Delivery, Throw
from curling_env.typing import Floats


def direction_to(target: Floats) -> Direction:
    """Return the end played to for a target: its half of the sheet."""
    return Direction.AWAY if target[1] >= 0 else Direction.HOME


def check_target(ice: Ice, target: Floats) -> None:
    """Refuse a target at which no stone can rest in play.

    Raises
    ------
    InputError : the target is off the ice, touches a side line, or is wholly past the back line
    """
    x, y = (float(value) for value in target)
    place = f"({x:g}, {y:g}) m"
    if not (np.isfinite(x) and np.isfinite(y)):
        raise InputError(f"expected a target of two finite numbers, got {place}")
    half_width, radius = ice.sheet.width / 2, ice.stone.radius
    if not bool(ice.sheet.contains(target)):
        raise InputError(
            f"the target {place} is off the ice, which extends to x = ±{half_width:g} and "
            f"y = ±{ice.sheet.length / 2:g} m"
        )
    if abs(x) > half_width - radius:
        raise InputError(
            f"a stone at {place} touches the side line: x must be within ±{half_width - radius:g}"
        )
    if abs(y) > BACK_LINE_Y + radius:
        raise InputError(
            f"a stone at {place} is past the back line: y must be within "
            f"±{BACK_LINE_Y + radius:.3f} m"
        )


def handles_of(ice: Ice, spins: Sequence[float]) -> Floats:
    """Return spins and sweeping to try, (n, 3): spin, and start and end of the sweeping."""
    sweeps = SWEEPS if ice.effect("sweeping") else SWEEPS[:1]
    return np.array([(spin, *sweep) for sweep in sweeps for spin in dict.fromkeys(spins)])


def find_throws(
    ice: Ice,
    target: Floats,
    *,
    spins: Sequence[float] = SPINS,
    x: float = 0.0,
    delivery: Delivery = FROM_HOG_LINE,
) -> Floats:
    """Find throws that come to rest at a target on the empty sheet.

    Parameters
    ----------
    ice : known or estimated ice
    target : (2,) target, sheet frame [m]
    spins : spins to try [rad/s]
    x : offset of the release, delivery frame [m]
    delivery : start and maximum speed of throws

    Returns
    -------
    (n, 6) one or more throws within `REACHED` of the target, with the columns of `rollouts`

    Raises
    ------
    InputError : no throw reaches it
    """
    direction = direction_to(target)
    across, along = to_delivery(target, direction).tolist()
    found: list[tuple[float, ...]] = []
    for spin, *sweep in handles_of(ice, spins).tolist():
        aim = Aim(ice, direction, delivery=delivery, x=x, sweep=(sweep[0], sweep[1]))
        throw = aim.draw(across, along, spin, within=REACHED)
        if throw is not None:
            found.append((throw.speed, throw.angle, spin, x, *sweep))
    if not found:
        weight_to(ice, along, direction, x, delivery)
        raise InputError(
            f"no throw found that comes to rest at ({target[0]:g}, {target[1]:g}) m on this ice"
        )
    return np.array(found)


def speed_range_to(
    ice: Ice, y: float, direction: Direction, x: float, delivery: Delivery = FROM_HOG_LINE
) -> tuple[float, float]:
    """Return a speed that stops well short of a place and one that goes well past it [m/s].

    Parameters
    ----------
    ice, y, direction, x, delivery : see `weight_to`

    Raises
    ------
    InputError : no speed reaches the place
    """
    weight = weight_to(ice, y, direction, x, delivery)
    slowest, fastest = WEIGHTS_TO_TRY
    return slowest * weight, min(fastest * weight, delivery.max_speed)


def weight_to(ice: Ice, y: float, direction: Direction, x: float, delivery: Delivery) -> float:
    """Return the speed at which a straight throw comes to rest level with a place [m/s].

    Parameters
    ----------
    y : the place, past the tee of the end played to [m]
    direction : the end played to
    x : offset of the release, delivery frame [m]
    delivery : start and maximum speed of throws

    Raises
    ------
    InputError : no speed reaches the place
    """
    aim = Aim(ice, direction, delivery=delivery, x=x)
    weight = aim.draw_weight(y=y)
    if weight is not None:
        return weight
    most = delivery.max_speed
    rest = aim.rest(Throw(speed=most, angle=0.0, spin=0.0, x=x))
    reach = np.inf if rest is None else rest[1] - delivery.start_y
    distance = y - delivery.start_y
    if reach < distance:
        raise InputError(
            f"the target is out of reach: at {most:g} m/s a stone stops after {reach:.1f} m on "
            f"this ice, and the target is {distance:.1f} m away"
        )
    raise InputError(f"no throw found that stops after {distance:.1f} m on this ice")
