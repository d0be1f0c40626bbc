"""What no named effect explains: a table of friction over one variable."""

from collections.abc import Mapping
from math import exp, fabs
from typing import Any

from curling_env.physics.compiled import effect_kernel
from curling_env.physics.effects.card import EffectCard, Parameter
from curling_env.physics.motion import CLOCK, FRICTION, ORDER, SPEED, SPIN, X, Y

VARIABLES = ("speed", "x", "y", "spin", "clock", "order")
"""What the table may run over, by the number its parameter `variable` takes; spin without sign."""
KNOTS = 7
"""Equally spaced places of the table, from `low` to `high`."""


@effect_kernel
def _kernel(motion: Any, theta: Any, push: Any) -> None:
    variable = int(theta[0])
    value = motion[SPEED]
    if variable == 1:
        value = motion[X]
    elif variable == 2:
        value = motion[Y]
    elif variable == 3:
        value = fabs(motion[SPIN])
    elif variable == 4:
        value = motion[CLOCK]
    elif variable == 5:
        value = motion[ORDER]
    place = (value - theta[1]) / (theta[2] - theta[1]) * (KNOTS - 1)
    place = min(max(place, 0.0), KNOTS - 1.0)
    k = min(int(place), KNOTS - 2)
    part = place - k
    push[FRICTION] *= exp((1.0 - part) * theta[3 + k] + part * theta[4 + k])


def _places(given: Mapping[str, float], variable: int) -> tuple[float, ...]:
    if int(given["variable"]) != variable:
        return ()
    low, high = given["low"], given["high"]
    return tuple(low + (high - low) * k / (KNOTS - 1) for k in range(KNOTS))


def _x_breaks(given: Mapping[str, float]) -> tuple[float, ...]:
    return _places(given, VARIABLES.index("x"))


def _y_breaks(given: Mapping[str, float]) -> tuple[float, ...]:
    return _places(given, VARIABLES.index("y"))


def _turned(given: Mapping[str, float]) -> dict[str, float]:
    """The table as it reads seen from the other end: one over x or y is read backwards."""
    if VARIABLES[int(given["variable"])] not in ("x", "y"):
        return dict(given)
    knots = {f"log_factor_{k}": given.get(f"log_factor_{KNOTS - 1 - k}", 0.0) for k in range(KNOTS)}
    return {**given, **knots, "low": -given["high"], "high": -given["low"]}


def _knot(k: int) -> Parameter:
    return Parameter(
        name=f"log_factor_{k}",
        symbol=f"f_{k}",
        unit="1",
        meaning=f"logarithm of the factor on friction {k}/{KNOTS - 1} of the way",
        low=-2.0,
        high=2.0,
        default=0.0,
    )


CARD = EffectCard(
    name="residual",
    title="Unexplained friction",
    readable="friction that no effect explains",
    formula="μ → μ·exp(f(variable)), f piecewise linear through seven values, constant beyond",
    equation=r"\mu \to \mu \, e^{f(u)}, \qquad "
    r"f\left( u_0 + \frac{k}{6} (u_6 - u_0) \right) = f_k, \qquad k = 0 \ldots 6",
    parameters=(
        Parameter(
            name="variable",
            symbol=r"u",
            unit="1",
            meaning="what it runs over: "
            + ", ".join(f"{number} {name}" for number, name in enumerate(VARIABLES)),
            low=0.0,
            high=len(VARIABLES) - 1.0,
        ),
        Parameter(
            name="low", symbol="u_0", unit="of the variable", meaning="value at the first place"
        ),
        Parameter(
            name="high",
            symbol="u_6",
            unit="of the variable",
            meaning="value at the last place, above low",
        ),
        *(_knot(k) for k in range(KNOTS)),
    ),
    source="none: a description, to be replaced by a mechanism once one is found",
    validity="the range of the variable that measured throws covered",
    evidence="what is left follows this variable, and the table shrinks the gap on throws held out",
    acts="friction",
    kernel=_kernel,
    turned=_turned,
    observed={
        "variable": 2.0 * len(VARIABLES),
        "low": 40.0,
        "high": 40.0,
        **{f"log_factor_{k}": 0.2 for k in range(KNOTS)},
    },
    observed_order=10,
    dissipative=True,
    x_breaks=_x_breaks,
    y_breaks=_y_breaks,
)
