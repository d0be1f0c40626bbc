"""Residual friction, which no named effect explains: a table over one variable."""

from functools import partial
from math import exp, fabs
from typing import Any

from curling_env.physics.compiled import effect_kernel
from curling_env.physics.effects.card import EffectCard, Parameter, Values
from curling_env.physics.motion import CLOCK, FRICTION, ORDER, SPEED, SPIN, X, Y

VARIABLES = ("speed", "x", "y", "spin", "clock", "order")
"""Names of the table's possible variables, by the number of its `variable`; spin without sign."""
_NUMBERED = ", ".join(f"{number} {name}" for number, name in enumerate(VARIABLES))
_PLACES = (SPEED, X, Y, SPIN, CLOCK, ORDER)
KNOTS = 7
"""Equally spaced places of the table, from `low` to `high`."""


@effect_kernel
def _kernel(motion: Any, theta: Any, push: Any) -> None:
    variable = int(theta[0])
    value = motion[_PLACES[variable]]
    if _PLACES[variable] == SPIN:
        value = fabs(value)
    place = (value - theta[1]) / (theta[2] - theta[1]) * (KNOTS - 1)
    place = min(max(place, 0.0), KNOTS - 1.0)
    k = min(int(place), KNOTS - 2)
    part = place - k
    push[FRICTION] *= exp((1.0 - part) * theta[3 + k] + part * theta[4 + k])


def _breaks(axis: str, given: Values) -> tuple[float, ...]:
    if VARIABLES[int(given["variable"])] != axis:
        return ()
    low, high = given["low"], given["high"]
    return tuple(low + (high - low) * k / (KNOTS - 1) for k in range(KNOTS))


def _turned(given: Values) -> Values:
    """Return the table as read from the other end: one over x or y is reversed."""
    if VARIABLES[int(given["variable"])] not in ("x", "y"):
        return given
    knots = {f"log_factor_{k}": given.get(f"log_factor_{KNOTS - 1 - k}", 0.0) for k in range(KNOTS)}
    return {**given, **knots, "low": -given["high"], "high": -given["low"]}


CARD = EffectCard(
    name="residual",
    title="Unexplained friction",
    readable="friction that no effect explains",
    formula="μ → μ·exp(f(variable)), f piecewise linear through seven values, constant beyond",
    equation=r"\mu \to \mu \, e^{f(u)}, \qquad "
    r"f\left( u_0 + \frac{k}{6} (u_6 - u_0) \right) = f_k, \qquad k = 0 \ldots 6",
    parameters=(
        Parameter("variable", "1", f"variable of the table: {_NUMBERED}", "u").within(
            0.0, len(VARIABLES) - 1.0
        ),
        Parameter("low", "of the variable", "value at the first place", "u_0"),
        Parameter("high", "of the variable", "value at the last place, above low", "u_6"),
        *(
            Parameter(
                f"log_factor_{k}",
                "1",
                f"logarithm of the factor on friction {k}/{KNOTS - 1} of the way",
                f"f_{k}",
            ).within(-2.0, 2.0, default=0.0)
            for k in range(KNOTS)
        ),
    ),
    source="none: a description, to be replaced by a mechanism once one is found",
    validity="the range of the variable that measured throws covered",
    evidence="the residual follows this variable, and the table shrinks the gap on held-out throws",
    acts="friction",
    kernel=_kernel,
    turned=_turned,
    observed={"variable": 2.0 * len(VARIABLES), "low": 40.0, "high": 40.0}
    | {f"log_factor_{k}": 0.2 for k in range(KNOTS)},
    observed_order=10,
    dissipative=True,
    x_breaks=partial(_breaks, "x"),
    y_breaks=partial(_breaks, "y"),
)
