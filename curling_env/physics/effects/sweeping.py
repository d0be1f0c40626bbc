"""Sweeping in front of the stone."""

from typing import Any

from curling_env.physics.compiled import effect_kernel
from curling_env.physics.effects.card import EffectCard, Parameter, Search
from curling_env.physics.motion import BEND, FRICTION, SWEPT


@effect_kernel
def _kernel(motion: Any, theta: Any, push: Any) -> None:
    if motion[SWEPT] > 0.5:
        push[FRICTION] *= theta[0]
        push[BEND] *= theta[1]


CARD = EffectCard(
    name="sweeping",
    title="Sweeping",
    formula="while swept: μ → friction_factor·μ and sideways push → curl_factor·push",
    equation=r"\mu \to f\,\mu, \quad a_\text{left} \to c\,a_\text{left} "
    r"\qquad \text{while swept}",
    parameters=(
        Parameter(
            "friction_factor", "1", "friction under the brooms over friction without", "f"
        ).within(0.3, 1.5, default=0.912, neutral=1.0),
        Parameter("curl_factor", "1", "curl under the brooms over curl without", "c").within(
            0.0, 2.0, default=1.0, neutral=1.0, scales="left"
        ),
    ),
    source="Marmo et al.: 5.84 m unswept against 6.40 m swept from 1 m/s, a factor of 0.912",
    validity="two sweepers at full effort",
    evidence="friction differs between swept and unswept stretches of the same ice",
    measured_by="sweep some throws and mark them as swept",
    acts="friction",
    kernel=_kernel,
    search=Search(needs=("swept",)),
    shown_over="swept",
    observed={"friction_factor": 0.3, "curl_factor": 1.0},
    observed_order=5,
    dissipative=True,
)
