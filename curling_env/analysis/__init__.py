"""Analysis of throws on an ice: one, thousands, a swept one; and the uncertainty of the ice."""

from curling_env.infrastructure.lazy_names import lazy_names

__getattr__, __dir__ = lazy_names(
    __name__,
    {
        "ice_uncertainty": ("is_uncertain", "plausible_ices", "rest_spread"),
        "shot_times": ("shoot",),
        "sweep": ("Sweep", "run"),
        "swept_draw": ("sweeping_gain",),
    },
)
