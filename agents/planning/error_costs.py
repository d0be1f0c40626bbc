"""Costs of small errors of a throw: a tenth of a second of weight, half a broom of line."""

from __future__ import annotations

from dataclasses import dataclass
from math import atan, tan

import numpy as np

from agents.planning.description import seconds_per_speed
from agents.planning.objective import Objective
from agents.planning.rollouts import ANGLE, SPEED, roll_out_in_play
from curling_env.ice import Ice
from curling_env.sheet import to_delivery
from curling_env.throw import MAX_SPEED, Throw
from curling_env.typing import Floats
from curling_env.units import BROOM, Units, short_length

LEAST = 0.05
"""Smallest displacement that is named [m]."""
TENTH = 0.1
"""Reported error of weight [s], from hog line to hog line: the resolution of a stop-watch."""


@dataclass(frozen=True, kw_only=True)
class ErrorCost:
    """Error of a throw and the resulting end of its stone.

    Parameters
    ----------
    error : the error in words, such as ``0.1 s heavier hog to hog``
    throw : the throw with the error
    rest : (2,) end of its stone, sheet frame [m]; NaN if it leaves play
    short, right : distance short of and to the right of the exact throw's end, from the thrower's
        view [m]; negative beyond and to the left
    miss : distance from the target [m]
    success : true if the objective is reached nevertheless
    """

    error: str
    throw: Throw
    rest: Floats
    short: float
    right: float
    miss: float
    success: bool

    def words(self, units: Units | None = None) -> str:
        """Describe the cost: ``0.1 s heavier hog to hog: 22 cm long``."""
        if not np.isfinite(self.rest).all():
            return f"{self.error}: out of play"
        parts = [
            f"{short_length(value, units)} {names[int(value > 0)]}"
            for value, names in ((self.short, ("long", "short")), (self.right, ("left", "right")))
            if abs(value) >= LEAST
        ]
        return f"{self.error}: {' and '.join(parts) or 'less than {short_length(LEAST, units)}'}"


def error_costs(
    ice: Ice, throw: Throw, objective: Objective, *, sweep: tuple[float, float] | None = None
) -> list[ErrorCost]:
    """Compute the cost of a tenth of a second of weight and half a broom of line, to both sides.

    Parameters
    ----------
    ice : ice of the throw
    throw : the throw without error
    objective : objective of the throw, with the stones on the sheet
    sweep : start and end of the sweeping, after the release [s]; None without sweeping

    Returns
    -------
    heavier, lighter, to the left, to the right. A throw that stops before the far hog line has no
    time, and no error of weight.
    """
    direction, delivery = objective.direction, objective.delivery
    slope = seconds_per_speed(ice, throw, direction, delivery)
    named: list[tuple[str, float, float]] = []
    if slope:
        change = TENTH / abs(slope)
        named += [
            (f"{TENTH:g} s heavier hog to hog", throw.speed + change, throw.angle),
            (f"{TENTH:g} s lighter hog to hog", throw.speed - change, throw.angle),
        ]
    broom = delivery.start_y * tan(throw.angle)
    for words, off in (("left", -BROOM / 2), ("right", BROOM / 2)):
        named.append((f"half a broom {words}", throw.speed, atan((broom + off) / delivery.start_y)))
    begin, end = sweep or (0.0, 0.0)
    exact = [throw.speed, throw.angle, throw.spin, throw.x, begin, end]
    table = np.tile(exact, (len(named) + 1, 1))
    table[1:, SPEED] = np.clip([speed for _, speed, _ in named], 1e-3, MAX_SPEED)
    table[1:, ANGLE] = [angle for *_, angle in named]
    ended = roll_out_in_play(ice, table, direction, objective.stones, delivery=delivery)
    judged = objective.judge(ended, ice.stone.radius)
    away = to_delivery(ended.xy, direction) - to_delivery(ended.xy[0], direction)
    return [
        ErrorCost(
            error=words,
            throw=Throw(speed=table[k, SPEED], angle=angle, spin=throw.spin, x=throw.x),
            rest=np.where(ended.in_play[k], ended.xy[k], np.nan),
            short=-float(away[k, 1]),
            right=float(away[k, 0]),
            miss=float(judged.miss[k]),
            success=bool(judged.success[k]),
        )
        for k, (words, _, angle) in enumerate(named, start=1)
    ]
