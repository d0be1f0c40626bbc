"""Extra distance of a swept stone on an ice: the size of the effect in curlers' terms."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from curling_env.errors import InputError
from curling_env.ice import Ice
from curling_env.physics.aim import Aim
from curling_env.physics.effects import catalogue
from curling_env.physics.session import simulate
from curling_env.physics.slides import edge_bounds
from curling_env.throw import Release, Throw
from curling_env.typing import Floats

DRAW_SPIN = 1.5
"""Spin of the draw [rad/s]: two and a half turns until rest."""
SWEPT_PART = 1.0 / 3.0
"""Share of its path, at the end, over which the draw is swept."""
FACTOR_STEP = 0.005
"""Step of the derivative by the friction factor."""
SWEEP_DURATION = 600.0
"""Duration of the sweeping [s]: no stone slides longer."""
AT_EDGE = 1e-3
"""Distance from an edge of the ice at which a slide counts as ended there [m]."""


class SweepingGain(NamedTuple):
    """Extra distance of a draw swept over its last third, along the sheet [m]."""

    metres: float
    stderr: float
    """Standard error that follows from that of the friction under the brooms [m]."""


def sweeping_gain(
    ice: Ice, *, clock: float = 0.0, order: int = 0, stone: int = 0
) -> SweepingGain | None:
    """Return the gain of a draw to the tee; some effects depend on its clock, order and stone.

    None if the ice has no effect `sweeping`, or the draw does not rest on the sheet.
    """
    effect = ice.effect("sweeping")
    if effect is None:
        return None
    own = catalogue()["sweeping"].parameter("friction_factor")
    factor = effect.parameters.get(own.name, own.default)
    assert factor is not None  # the card has a default
    speed = Aim(ice, clock=clock, order=order, stone=stone).draw_weight(DRAW_SPIN)
    if speed is None:
        return None
    draw = Throw(speed=speed, spin=DRAW_SPIN).release(clock=clock, order=order, stone=stone)
    plain = simulate(ice, [draw])[0]
    way: Floats = plain.xy[:, 1] - plain.xy[0, 1]
    begin = float(np.interp((1.0 - SWEPT_PART) * float(way[-1]), way, plain.t))
    swept = replace(draw, sweep_start=begin, sweep_end=begin + SWEEP_DURATION)

    def rest(release: Release, friction_factor: float) -> float:
        changed = replace(effect, parameters={**effect.parameters, own.name: friction_factor})
        effects = tuple(changed if e is effect else e for e in ice.effects)
        end = simulate(replace(ice, effects=effects), [release])[0].xy[-1]
        if (np.abs(end) > edge_bounds(ice)[[1, 3]] - AT_EDGE).any():
            raise InputError("the stone runs off the sheet")
        return float(end[1])

    low, high = max(factor - FACTOR_STEP, own.low), min(factor + FACTOR_STEP, own.high)
    try:
        metres = rest(swept, factor) - rest(draw, factor)
        slope = (rest(swept, high) - rest(swept, low)) / (high - low)
    except InputError:
        return None
    return SweepingGain(metres, abs(slope) * effect.sigma.get(own.name, 0.0))
