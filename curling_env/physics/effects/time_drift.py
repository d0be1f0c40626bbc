"""Drift of the friction in the course of the session."""

from math import exp
from typing import Any

from curling_env.physics.compiled import effect_kernel
from curling_env.physics.effects.card import EffectCard, Parameter, Search
from curling_env.physics.motion import CLOCK, FRICTION


@effect_kernel
def _kernel(motion: Any, theta: Any, push: Any) -> None:
    push[FRICTION] *= exp(theta[0] * motion[CLOCK])


CARD = EffectCard(
    name="time_drift",
    title="Friction drifts with time",
    readable="friction that drifts with time",
    formula="μ → μ·exp(rate·clock)",
    equation=r"\mu \to \mu \, e^{r\,t_\text{clock}}",
    parameters=(
        Parameter(
            "rate",
            "1/s",
            "relative change of friction per second of the session; frost is positive",
            "r",
        ).within(-1e-3, 1e-3, neutral=0.0),
    ),
    source="frost and temperature; about 8 % over a game is usual",
    validity="one session, sheet-wide",
    evidence="friction follows the session's clock rather than the number of throws",
    acts="friction",
    kernel=_kernel,
    scope="between throws",
    search=Search(needs=("clocks",), mistaken_for=("map",)),
    shown_over="clock",
    observed={"rate": 2e-5},
    observed_order=6,
    dissipative=True,
)
