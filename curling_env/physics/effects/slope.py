"""Slope of the ice."""

from typing import Any, Literal

from curling_env.physics.compiled import effect_kernel
from curling_env.physics.effects.card import EffectCard, Parameter, Search
from curling_env.physics.motion import GRAVITY, PUSH_X, PUSH_Y


@effect_kernel
def _kernel(motion: Any, theta: Any, push: Any) -> None:
    push[PUSH_X] += GRAVITY * theta[0]
    push[PUSH_Y] += GRAVITY * theta[1]


def _gradient(axis: Literal["x", "y"], side: str) -> Parameter:
    return Parameter(axis, "m/m", f"fall of the ice towards {side}", f"h_{axis}").within(
        -5e-3, 5e-3, default=0.0, neutral=0.0, axis=axis
    )


CARD = EffectCard(
    name="slope",
    title="Slope of the ice",
    readable="a slope of the ice",
    formula="a = g·(x, y): the gradient of the fall, fixed in the sheet frame",
    equation=r"\mathbf{a} = g \begin{pmatrix} h_x \\ h_y \end{pmatrix}",
    parameters=(_gradient("x", "+x"), _gradient("y", "the away end")),
    source="mechanics; 1 mm across the sheet moves a draw by 0.3 m",
    validity="gradients well below the friction, so that a resting stone stays",
    evidence="a constant acceleration that keeps its world direction when the direction of play "
    "reverses",
    measured_by="throw in both directions",
    acts="motion",
    kernel=_kernel,
    pushes=("along the sheet", "across the sheet"),
    search=Search(mistaken_for=("map", "camera")),
    shown_over="y",
    observed={"x": 2e-3, "y": 2e-3},
    observed_order=4,
    dissipative=False,
)
