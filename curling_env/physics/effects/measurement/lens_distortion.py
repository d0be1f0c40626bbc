"""A smooth radial displacement of measured positions: lens distortion that was left in them.

Without a scene the displacement is taken as radial on the ice. Where the scene of the camera is
known, `friction_estimation` replaces it by one that is radial in the image.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from curling_env.physics.effects.card import EffectCard, Parameter, Search, Values
from curling_env.typing import Floats

REFERENCE_RADIUS = 20.0
"""Distance from the optical axis at which the strengths are quoted [m]."""


def _displacement(xy: Floats, _theta: Floats, values: Values) -> Floats:
    from_centre = xy - np.array([values["centre_x"], values["centre_y"]])
    ratio = (from_centre**2).sum(axis=1, keepdims=True) / REFERENCE_RADIUS**2
    return from_centre * (values["k1"] * ratio + values["k2"] * ratio**2)


def _finer(_: Values) -> Sequence[Values]:
    return ({"centre_x": 0.0},)


def _number(name: str, unit: str, meaning: str, furthest: float, **others: Any) -> Parameter:
    return Parameter(name=name, unit=unit, meaning=meaning, low=-furthest, high=furthest, **others)


CARD = EffectCard(
    name="lens_distortion",
    title="Lens distortion",
    readable="lens distortion left in the tracks",
    formula="reported = p + (p − c)·(k1·q + k2·q²), q = |p − c|²/(20 m)²",
    parameters=(
        _number(
            "k1", "1", f"radial displacement over radius at {REFERENCE_RADIUS:g} m", 0.3, neutral=0
        ),
        _number("k2", "1", "the same, of fifth order", 0.3, default=0.0, neutral=0.0),
        _number(
            "centre_x", "m", "where the optical axis meets the ice", 10.0, default=0.0, held=True
        ),
        _number("centre_y", "m", "where the optical axis meets the ice", 25.0, default=0.0),
    ),
    source="Brown's radial terms, seen from above",
    validity="a camera above or beside the sheet",
    evidence="paths bend with the place in the image, with v², whatever the friction",
    acts="measurement",
    dissipative=False,
    displacement=_displacement,
    search=Search(shape=("centre_y", "k2"), finer=_finer),
    shown_over="y",
)
