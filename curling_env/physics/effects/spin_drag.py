"""Torque that slows the rotation in addition to the running band."""

from math import fabs, log
from typing import Any

from curling_env.physics.compiled import effect_kernel, quick_exp
from curling_env.physics.effects.card import EffectCard, Parameter, Search
from curling_env.physics.motion import LOG_SPEED, SPEED, SPIN, TURN, spin_sign

REFERENCE_SPIN = 1.5
"""Spin at which `rate` is quoted [rad/s]."""


@effect_kernel
def _kernel(motion: Any, theta: Any, push: Any) -> None:
    floor = theta[2]
    log_speed = motion[LOG_SPEED] if motion[SPEED] > floor else log(floor)
    torque = spin_sign(motion[SPIN]) * theta[0] * quick_exp(-theta[1] * log_speed)
    if theta[3] != 0.0:
        torque *= quick_exp(theta[3] * log((fabs(motion[SPIN]) + 1e-9) / REFERENCE_SPIN))
    push[TURN] -= torque


CARD = EffectCard(
    name="spin_drag",
    title="Spin drag",
    readable="spin that fades faster than the band explains",
    formula="dω/dt = −sign(ω)·rate·max(v, speed_floor)^(−speed_exponent)·(|ω|/1.5)^spin_exponent",
    equation=r"\dot\omega = {-}\operatorname{sign}(\omega) \; r \; \max(v, v_0)^{-p} "
    r"\left( \frac{|\omega|}{1.5\,\mathrm{rad/s}} \right)^{q}",
    parameters=(
        Parameter("rate", "rad/s²", "loss of spin at 1 m/s and 1.5 rad/s", "r").within(
            0.0, 0.5, neutral=0.0, usual=0.0115, spread=0.006
        ),
        Parameter("speed_exponent", "1", "exponent of the loss as the stone slows", "p").within(
            0.0, 1.5, default=0.6, spread=0.25
        ),
        Parameter("speed_floor", "m/s", "speed below which the loss no longer grows", "v_0").within(
            1e-4, 1.0, default=0.05, held=True
        ),
        Parameter(
            "spin_exponent", "1", "exponent of the loss in spin; 1 is a loss in proportion", "q"
        ).within(0.0, 2.0, default=0.0, spread=0.3),
    ),
    source="Digital Curling FCV1: 0.025/max(v, 0.001); measured spins fall as v^0.4, a symmetric "
    "band alone gives v^0.19",
    validity="sliding stones",
    evidence="the heading turns less than the band's own friction explains",
    measured_by="film more stones with their handles in sight",
    acts="motion",
    kernel=_kernel,
    of_speed_and_spin=True,
    pushes=("turn",),
    search=Search(
        needs=("headings",),
        shape=("speed_exponent", "spin_exponent"),
        # A fixed wrong shape can hold a nonnegative rate at zero.
        other_start={"rate": 0.01, "speed_exponent": 0.0, "spin_exponent": 1.0},
    ),
    observed={"rate": 0.05, "speed_exponent": 1.5, "speed_floor": 0.2, "spin_exponent": 1.5},
    observed_order=3,
    dissipative=True,
)
