"""Pebble that wears with every throw played."""

from math import exp
from typing import Any

from curling_env.physics.compiled import effect_kernel
from curling_env.physics.effects.card import EffectCard, Parameter
from curling_env.physics.effects.motion import FRICTION, ORDER


@effect_kernel
def _kernel(motion: Any, theta: Any, push: Any) -> None:
    push[FRICTION] *= exp(theta[0] * motion[ORDER])


CARD = EffectCard(
    name="pebble_wear",
    title="Pebble wear",
    formula="μ → μ·exp(rate·throws played)",
    parameters=(
        Parameter(
            name="rate",
            unit="1/throw",
            meaning="relative change of friction per throw played; keener ice is negative",
            low=-0.1,
            high=0.1,
            neutral=0.0,
        ),
    ),
    source="0.2–0.5 % per pass at worn spots",
    validity="averaged over the sheet, up to some tens of throws on one pebble",
    evidence="friction follows the number of throws rather than the clock",
    acts="friction",
    kernel=_kernel,
    dissipative=True,
)
