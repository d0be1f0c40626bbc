"""Tracked point that is fixed to the stone but not at its centre."""

import numpy as np

from curling_env.physics.effects.card import EffectCard, Parameter, Search, Values
from curling_env.typing import Floats

MAX_OFFSET_OF_POINT = 0.2
"""Maximum offset that is tried [m]: a stone's radius is 0.15 m."""


def _displacement(_xy: Floats, theta: Floats, values: Values) -> Floats:
    cosine, sine = np.cos(theta), np.sin(theta)
    a, b = values["forward"], values["left"]
    return np.column_stack([a * cosine - b * sine, a * sine + b * cosine])


def _offset(name: str, symbol: str, meaning: str) -> Parameter:
    return Parameter(name, "m", meaning, symbol).within(
        -MAX_OFFSET_OF_POINT, MAX_OFFSET_OF_POINT, neutral=0.0
    )


CARD = EffectCard(
    name="tracking_offset",
    title="Tracked point beside the centre",
    readable="a tracked point beside the stone's centre",
    formula="reported = centre + forward·heading + left·(heading turned to the left)",
    equation=r"\mathbf{p}_\text{reported} = \mathbf{p} "
    r"+ a \begin{pmatrix} \cos\theta \\ \sin\theta \end{pmatrix} "
    r"+ b \begin{pmatrix} {-}\sin\theta \\ \cos\theta \end{pmatrix}",
    parameters=(
        _offset("forward", "a", "ahead of the centre, along the heading"),
        _offset("left", "b", "to the left of the heading"),
    ),
    source="geometry: a point of a turning body",
    validity="points on the stone",
    evidence="the path winds at the rate of the spin",
    acts="measurement",
    dissipative=False,
    displacement=_displacement,
    search=Search(needs=("headings",)),
    shown_over="theta",
)
