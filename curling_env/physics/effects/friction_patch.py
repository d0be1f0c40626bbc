"""Area whose friction differs from the map."""

from collections.abc import Sequence
from functools import partial
from math import tanh
from typing import Any

from curling_env.physics.compiled import effect_kernel
from curling_env.physics.effects.card import EffectCard, Parameter, Search, Values
from curling_env.physics.motion import FRICTION, X, Y


@effect_kernel
def _kernel(motion: Any, theta: Any, push: Any) -> None:
    edge = theta[5]
    if edge > 0.0:
        across = tanh((motion[X] - theta[0]) / edge) - tanh((motion[X] - theta[1]) / edge)
        along = tanh((motion[Y] - theta[2]) / edge) - tanh((motion[Y] - theta[3]) / edge)
        push[FRICTION] *= 1.0 + (theta[4] - 1.0) * 0.25 * across * along
        return
    inside_x = theta[0] <= motion[X] <= theta[1]
    if inside_x and theta[2] <= motion[Y] <= theta[3]:
        push[FRICTION] *= theta[4]


def _edge(name: str, symbol: str, meaning: str) -> Parameter:
    return Parameter(name, "m", meaning, symbol).within(-25.0, 25.0, held=True)


SIDES = ("x_min", "x_max", "y_min", "y_max")
SOFT_BREAKS = tuple(0.75 * k for k in range(-6, 7))
"""Places where a soft side counts as bent, in units of `edge`: tanh is straight enough between."""


def _turned(given: Values) -> Values:
    """Return the patch as seen from the other end."""
    opposite = dict(zip(SIDES, ("x_max", "x_min", "y_max", "y_min"), strict=True))
    return {**given, **{side: -given[opposite[side]] for side in SIDES}}


def _breaks(axis: str, given: Values) -> tuple[float, ...]:
    edge = given.get("edge", 0.0)
    units = SOFT_BREAKS if edge > 0.0 else (0.0,)
    return tuple(given[f"{axis}_{side}"] + edge * u for side in ("min", "max") for u in units)


def _finer(given: Values) -> Sequence[Values]:
    """Return soft sides, all of them free."""
    sides = {side: given[side] for side in SIDES}
    return tuple({"edge": edge, **sides} for edge in (0.5, 1.5))


CARD = EffectCard(
    name="friction_patch",
    title="A patch of different ice",
    readable="a patch of different ice",
    formula="μ → factor·μ within x_min ≤ x ≤ x_max, y_min ≤ y ≤ y_max; tanh sides if edge > 0, "
    "which become sharp as it goes to 0",
    equation=r"\mu \to \mu \left[ 1 + \frac{f - 1}{4} \, T_x T_y \right], \qquad "
    r"T_x = \tanh\frac{x - x_0}{\varepsilon} - \tanh\frac{x - x_1}{\varepsilon}, \qquad "
    r"T_y = \tanh\frac{y - y_0}{\varepsilon} - \tanh\frac{y - y_1}{\varepsilon}",
    parameters=(
        _edge("x_min", "x_0", "left edge, sheet frame"),
        _edge("x_max", "x_1", "right edge, sheet frame"),
        _edge("y_min", "y_0", "edge nearer the home end, sheet frame"),
        _edge("y_max", "y_1", "edge nearer the away end, sheet frame"),
        Parameter("factor", "1", "friction inside over friction of the map", "f").within(
            0.2, 5.0, neutral=1.0
        ),
        Parameter(
            "edge",
            "m",
            "width in which friction changes at the sides, half of it inside; 0 is sharp",
            r"\varepsilon",
        ).within(0.0, 5.0, default=0.0, held=True),
    ),
    source="a worn, wet or freshly pebbled area",
    validity="a rectangle larger than the stone",
    evidence="throws that cross the area change their deceleration at its edges, at any speed",
    acts="friction",
    kernel=_kernel,
    search=Search(area=SIDES, shape=("y_min", "y_max"), finer=_finer),
    shown_over="y",
    turned=_turned,
    observed={"x_min": 4.0, "x_max": 4.0, "y_min": 40.0, "y_max": 40.0, "factor": 0.2, "edge": 2.0},
    observed_order=9,
    observed_times=2,
    dissipative=True,
    x_breaks=partial(_breaks, "x"),
    y_breaks=partial(_breaks, "y"),
)
