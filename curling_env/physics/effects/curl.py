"""Curl: a turning stone is pushed to the side to which its front turns."""

from math import fabs, log
from typing import Any

from curling_env.physics.compiled import effect_kernel, quick_exp
from curling_env.physics.effects.card import EffectCard, Parameter, Search
from curling_env.physics.motion import LEFT, LOG_SPEED, SPIN, spin_sign

REFERENCE_SPIN = 1.5
"""Spin at which `strength` is quoted [rad/s]."""


@effect_kernel
def _kernel(motion: Any, theta: Any, push: Any) -> None:
    spin = motion[SPIN]
    sideways = theta[0] * quick_exp(theta[1] * motion[LOG_SPEED]) * spin_sign(spin)
    if theta[2] != 0.0:
        sideways *= quick_exp(theta[2] * log((fabs(spin) + 1e-9) / REFERENCE_SPIN))
    push[LEFT] += sideways


CARD = EffectCard(
    name="curl",
    title="Curl",
    formula="a_left = sign(ω)·strength·v^speed_exponent·(|ω|/1.5)^spin_exponent, v in m/s",
    equation=r"a_\text{left} = \operatorname{sign}(\omega) \; k \; v^{\alpha} "
    r"\left( \frac{|\omega|}{1.5\,\mathrm{rad/s}} \right)^{\beta}",
    parameters=(
        Parameter(
            "strength",
            "m/s²",
            "sideways acceleration at 1 m/s and 1.5 rad/s, to the left for +ω",
            "k",
        ).within(-0.1, 0.1, neutral=0.0, usual=0.0075, spread=0.0025),
        Parameter(
            "speed_exponent", "1", "exponent of the sideways push in speed", r"\alpha"
        ).within(-1.0, 2.0, default=0.2, spread=0.25),
        Parameter(
            "spin_exponent",
            "1",
            "exponent of the push in spin; 0 on real ice within about 30 %",
            r"\beta",
        ).within(0.0, 2.0, default=0.0, spread=0.25),
    ),
    source="Digital Curling FCV1: heading rate 0.0082·v^(-0.8) rad/s; Nyberg et al. (2013): "
    "front-back asymmetry of friction alone is insufficient, so the law is empirical",
    validity="draws and takeouts, |ω| of 0.3 to 5 rad/s",
    evidence="paths bend to opposite sides for opposite spins, in both directions of play",
    measured_by="throw with both handles",
    acts="motion",
    kernel=_kernel,
    of_speed_and_spin=True,
    pushes=("left",),
    search=Search(needs=("headings",), shape=("speed_exponent", "spin_exponent")),
    observed={"strength": 0.02, "speed_exponent": 1.0, "spin_exponent": 1.0},
    observed_order=1,
    dissipative=True,
)
