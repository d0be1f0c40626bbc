"""Values of the rows on sweeping, on ice that is not level, and on wear of the pebble."""

from __future__ import annotations

import numpy as np

from curling_env.physics.effects import catalogue
from curling_env.validation.shots import Shots

MARMO_SPEED, MARMO_UNSWEPT = 1.0, 5.84
"""Release speed and distance of the unswept stones of the source [m/s, m]."""
LAST_THIRD = 2.0 / 3.0
SLOPE = 0.43e-3 / 4.75
"""0.43 mm across a sheet of 4.75 m, as a gradient."""
ONE_PASS = 0.005
"""A micrometre of a pebble 0.2 mm high."""


def brooms(shots: Shots) -> Shots:
    """Return the same ice with its effect of sweeping, or the published factor if it has none."""
    if shots.ice.effect("sweeping") is not None:
        return shots
    card = catalogue()["sweeping"]
    defaults = {p.name: p.default for p in card.parameters if p.default is not None}
    return shots.with_effect("sweeping", **defaults)


def swept_gain(shots: Shots, begin: float, what: str) -> float | None:
    """Return the extra metres or seconds of a draw swept from a share of its path on."""
    swept, speed = brooms(shots), shots.draw_speed
    path = None if speed is None else shots.followed(speed, 50.0)
    if path is None or speed is None:
        return None
    way = path.xy[:, 1] - path.xy[0, 1]
    run = swept.run(speed, swept_from=float(np.interp(begin * float(way[-1]), way, path.t)))
    if run is None:
        return None
    return {"metres": run.y - float(path.xy[-1, 1]), "seconds": run.time - float(path.t[-1])}[what]


def marmo_carry(shots: Shots) -> float:
    """Return the distance of the unswept stone [m]."""
    return shots.carry(MARMO_SPEED)


def marmo(shots: Shots) -> float | None:
    """Return the distance of the swept stone on ice scaled to the unswept one's."""
    scaled = shots.scaled_until(marmo_carry, MARMO_UNSWEPT)
    run = None if scaled is None else brooms(scaled).run(MARMO_SPEED, swept_from=0.0)
    start = None if scaled is None else scaled.run(MARMO_SPEED)
    if run is None or start is None:
        return None
    return MARMO_UNSWEPT + run.y - start.y


def drift_of_slope(shots: Shots) -> float | None:
    """Return the drift of a draw on ice that falls to one side [m]."""
    slope = shots.ice.effect("slope")
    already = {"x": 0.0, "y": 0.0} if slope is None else dict(slope.parameters)
    tilted = shots.with_effect("slope", x=already["x"] + SLOPE, y=already["y"])
    speed, level = shots.draw_speed, shots.draw
    run = None if speed is None else tilted.run(speed)
    return None if run is None or level is None else run.x - level.x


def one_pass(shots: Shots) -> float | None:
    """Return the extra distance of a draw on friction lower by a pass's share of the pebble [m]."""
    speed, draw = shots.draw_speed, shots.draw
    run = None if speed is None else shots.scaled(1.0 - ONE_PASS).run(speed)
    return None if run is None or draw is None else run.y - draw.y
