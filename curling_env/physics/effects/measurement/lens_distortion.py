"""Smooth radial displacement of measured positions: residual lens distortion.

Without a scene the displacement is assumed to be radial on the ice. If the scene of the camera is
known, `friction_estimation` replaces it by one that is radial in the image.
"""

from collections.abc import Sequence

import numpy as np

from curling_env.physics.effects.card import EffectCard, Parameter, Search, Values
from curling_env.typing import Floats

REFERENCE_RADIUS = 20.0
"""Distance from the optical axis at which the strengths are quoted [m]."""


def _displacement(xy: Floats, _theta: Floats, values: Values) -> Floats:
    x, y = xy[:, 0] - values["centre_x"], xy[:, 1] - values["centre_y"]
    ratio = (x * x + y * y) / REFERENCE_RADIUS**2
    shift = values["k1"] * ratio + values["k2"] * ratio**2
    return np.stack([x * shift, y * shift], axis=1)


def _finer(_: Values) -> Sequence[Values]:
    return ({"centre_x": 0.0},)


_CENTRE = "point where the optical axis meets the ice"

CARD = EffectCard(
    name="lens_distortion",
    title="Lens distortion",
    readable="lens distortion left in the tracks",
    formula="reported = p + (p − c)·(k1·q + k2·q²), q = |p − c|²/(20 m)²",
    equation=r"\mathbf{p}_\text{reported} = \mathbf{p} + (\mathbf{p} - \mathbf{c}) "
    r"\left( k_1 q + k_2 q^2 \right), \qquad "
    r"q = \frac{|\mathbf{p} - \mathbf{c}|^2}{(20\,\mathrm{m})^2}, "
    r"\qquad \mathbf{c} = \begin{pmatrix} c_x \\ c_y \end{pmatrix}",
    parameters=(
        Parameter(
            "k1", "1", f"radial displacement over radius at {REFERENCE_RADIUS:g} m", "k_1"
        ).within(-0.3, 0.3, neutral=0),
        Parameter("k2", "1", "the same, of fifth order", "k_2").within(
            -0.3, 0.3, default=0.0, neutral=0.0
        ),
        Parameter("centre_x", "m", _CENTRE, "c_x").within(-10.0, 10.0, default=0.0, held=True),
        Parameter("centre_y", "m", _CENTRE, "c_y").within(-25.0, 25.0, default=0.0),
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
