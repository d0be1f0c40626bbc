"""Friction that decreases with the sliding speed of the contact."""

from collections.abc import Sequence
from math import log
from typing import Any

from curling_env.physics.compiled import effect_kernel, quick_exp, quick_log
from curling_env.physics.effects.card import EffectCard, Parameter, Search, Values
from curling_env.physics.motion import CONTACT_FRICTION, CONTACTS, LOG_SLIP, SLIP

SLOWEST_SLIP = 0.01
"""Slip below which friction no longer rises [m/s]; slower contacts have not been measured."""


@effect_kernel
def _kernel(motion: Any, theta: Any, push: Any) -> None:
    exponent, offset, share = theta[0], theta[1], theta[2]
    if offset > 0.0:
        slowest = SLOWEST_SLIP if exponent < 1.0 else 0.0
        for q in range(int(motion[CONTACTS])):
            log_slip = quick_log(max(motion[SLIP + q], slowest) + offset)
            push[CONTACT_FRICTION + q] *= 1.0 - share + share * quick_exp(-exponent * log_slip)
    else:
        slowest = log(SLOWEST_SLIP)
        for q in range(int(motion[CONTACTS])):
            log_slip = max(motion[LOG_SLIP + q], slowest)
            push[CONTACT_FRICTION + q] *= 1.0 - share + share * quick_exp(-exponent * log_slip)


def _finer(given: Values) -> Sequence[Values]:
    """Return linearly decreasing friction, and a power law with an offset.

    Each starts with the slope of the fitted power law at 1 m/s: from a more distant start a fit
    would diverge.
    """
    n = given["exponent"]
    starts = [{"exponent": -1.0, "share": min(max(-n, -0.19), 0.5), "speed_offset": 0.0}]
    if n > 0.0:
        starts += [
            {"exponent": 1.0, "share": min(0.9, n * (1.0 + offset) ** 2), "speed_offset": offset}
            for offset in (0.06, 0.9)
        ]
    return starts


CARD = EffectCard(
    name="speed_dependent_friction",
    title="Friction follows the sliding speed",
    readable="friction that follows the sliding speed",
    formula="μ(s) = μ·[1 − share + share·(s + speed_offset)^(−exponent)], s in m/s",
    equation=r"\mu(s) = \mu \left[ 1 - c + c \, (s + s_0)^{-p} \right]",
    parameters=(
        Parameter(
            "exponent", "1", "exponent of the decrease with speed; ½ is the Penner–Maeno law", "p"
        ).within(-1.0, 2.0, neutral=0.0, usual=0.25, spread=0.12),
        Parameter(
            "speed_offset", "m/s", "added to the slip, which bounds friction at rest", "s_0"
        ).within(0.0, 1.0, default=0.0),
        Parameter(
            "share",
            "1",
            "part of the friction that follows the speed; with the exponent -1 friction "
            "changes linearly, falling where this is negative",
            "c",
        ).within(-0.2, 1.0, default=1.0),
    ),
    source="Penner (2001) and Maeno (2010): 0.008·v^(-1/2); Digital Curling FCV1: 1/(v + 0.064)",
    validity="slips of 0.01 to 4 m/s; the map's μ is the friction at 1 m/s",
    evidence="fast and slow throws over the same cells disagree on μ, in both directions alike",
    measured_by="throw with several weights",
    acts="contact_friction",
    kernel=_kernel,
    of_speed_and_spin=True,
    search=Search(shape=(), finer=_finer, mistaken_for=("map", "camera")),
    observed={"exponent": 1.0, "speed_offset": 0.2, "share": 2.0},
    observed_order=0,
    dissipative=True,
)
