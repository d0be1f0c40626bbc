"""Appearance of a stone in a film: its model, its fit in one frame, and its estimation.

`model` is the shape of a stone, `painting` its picture, `fit` finds it in a frame and `occlusion`
does so among other stones. `learning` estimates the properties of a stone that are not in a scene
file.
"""

from curling_env.infrastructure.lazy_names import lazy_names
from friction_estimation.appearance.crops import (
    Crop,
    clear_surroundings,
    crops_at,
    explained_crops,
    total_misfit,
    unexplained_share,
)
from friction_estimation.appearance.fit import (
    Appearance,
    PictureChannels,
    ShapeUncertainty,
    StoneFit,
    channels_of,
)
from friction_estimation.appearance.handle import heading_costs, heading_crop
from friction_estimation.appearance.learning import (
    adapt_appearance,
    as_reversible,
    learn_appearance,
)
from friction_estimation.appearance.model import PixelWindow, StoneModel
from friction_estimation.appearance.occlusion import PosedStone, fill_hidden, measure_occluded
from friction_estimation.appearance.tuning import CROPS_TO_LEARN_FROM

__all__ = [
    "CROPS_TO_LEARN_FROM",
    "Appearance",
    "Crop",
    "PictureChannels",
    "PixelWindow",
    "PosedStone",
    "ShapeUncertainty",
    "StoneFit",
    "StoneModel",
    "adapt_appearance",
    "as_reversible",
    "channels_of",
    "clear_surroundings",
    "crops_at",
    "explained_crops",
    "fill_hidden",
    "heading_costs",
    "heading_crop",
    "learn_appearance",
    "measure_occluded",
    "total_misfit",
    "unexplained_share",
]

__getattr__, __dir__ = lazy_names(
    __name__,
    {
        "colour_names": ("colour_name", "handle_colour"),
        "crops": ("composite", "coverage"),
        "model": ("window_at",),
        "prior": ("REVERSIBLE", "ShapePrior", "TURNED_ALIKE", "UPRIGHT"),
        "shape": ("PARTS",),
    },
)
