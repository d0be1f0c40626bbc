"""Deviation of one stone: heavier or keener than the others, or more or less curl."""

from math import fabs
from typing import Any

from curling_env.physics.compiled import effect_kernel
from curling_env.physics.effects.card import EffectCard, Parameter, Search, Variant
from curling_env.physics.motion import BEND, FRICTION, STONE


@effect_kernel
def _kernel(motion: Any, theta: Any, push: Any) -> None:
    if fabs(motion[STONE] - theta[0]) < 0.5:
        push[FRICTION] *= theta[1]
        push[BEND] *= theta[2]


CARD = EffectCard(
    name="stone_bias",
    title="Stone with its own friction",
    readable="a stone with its own friction",
    formula="for one stone: μ → factor·μ and sideways push → curl_factor·push; give the effect "
    "once for each such stone",
    equation=r"\mu \to f\,\mu, \quad a_\text{left} \to c\,a_\text{left} "
    r"\qquad \text{for stone}\ i",
    parameters=(
        Parameter("stone", "1", "identifier of the stone", "i").within(0.0, 1e6, held=True),
        Parameter("factor", "1", "its friction over that of the others", "f").within(
            0.5, 2.0, default=1.0, neutral=1.0
        ),
        Parameter("curl_factor", "1", "its curl over that of the others", "c").within(
            0.0, 3.0, default=1.0, neutral=1.0, scales="left"
        ),
    ),
    source="stone to stone spread of 0.5–1 % in friction; the rougher the running band, the more a "
    "stone curls (Nyberg et al., Wear 301 (2013))",
    validity="a matched set of stones",
    evidence="every throw of one stone stops short, or runs long, by the same factor",
    measured_by="throw every stone several times",
    acts="friction",
    kernel=_kernel,
    scope="between throws",
    search=Search(
        needs=("several stones",),
        first=("factor",),
        variants=(
            Variant(
                parameter="curl_factor",
                readable="a stone with its own curl",
                evidence="the paths of one stone bend more, or less, than those of the others",
                pushes=("left",),
                needs=("headings",),
                shown_over="stone",
            ),
        ),
        stone="stone",
    ),
    shown_over="stone",
    observed={"factor": 0.1, "curl_factor": 0.5},
    observed_order=8,
    dissipative=True,
)
