"""What a stone looks like to a camera: its body and handle, a fit in one frame, and learning both.

`model` is the body, `kernels` its compiled arithmetic, `fit` finds it in one frame; `exposure`,
`handle`, `profile` and `learning` find from a film what no scene file says of a stone.
"""

from friction_estimation.appearance.among import Posed, measure_among
from friction_estimation.appearance.exposure import (
    Exposure,
    exposures_at,
    share_left,
    total_misfit,
)
from friction_estimation.appearance.fit import Appearance, StoneFit, channels_of, measure
from friction_estimation.appearance.handle import heading_costs
from friction_estimation.appearance.learning import EXPOSURES, learn_appearance
from friction_estimation.appearance.model import StoneModel

__all__ = [
    "EXPOSURES",
    "Appearance",
    "Exposure",
    "Posed",
    "StoneFit",
    "StoneModel",
    "channels_of",
    "exposures_at",
    "heading_costs",
    "learn_appearance",
    "measure",
    "measure_among",
    "share_left",
    "total_misfit",
]
