"""Air drag of the stone."""

from typing import Any

from curling_env.physics.compiled import effect_kernel
from curling_env.physics.effects.card import EffectCard, Parameter, Search
from curling_env.physics.motion import ALONG, SPEED


@effect_kernel
def _kernel(motion: Any, theta: Any, push: Any) -> None:
    push[ALONG] -= theta[0] * motion[SPEED] * motion[SPEED]


CARD = EffectCard(
    name="air_drag",
    title="Air drag",
    formula="dv/dt = −coefficient·v², coefficient = ρ·C_d·A/(2m)",
    equation=r"\dot v = {-}c\,v^2, \qquad c = \frac{\rho\,C_d\,A}{2m}",
    parameters=(
        Parameter(
            "coefficient",
            "1/m",
            "air drag of the stone over its mass; 9.5e-4 ±30 % for a curling stone",
            "c",
        ).within(0.0, 0.02, neutral=0.0, usual=9.5e-4, spread=5e-4),
    ),
    source="drag of a short cylinder at Reynolds number 2e4 to 6e4; 1 % of friction at 1 m/s, "
    "14 % at 3 m/s",
    validity="still air",
    evidence="deceleration that grows with v²: needs takeout speeds in addition to draws",
    acts="motion",
    kernel=_kernel,
    of_speed_and_spin=True,
    search=Search(mistaken_for=("map",)),
    observed={"coefficient": 2e-3},
    observed_order=2,
    dissipative=True,
)
