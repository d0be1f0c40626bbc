"""What an ice does to throws: one, thousands, a swept one; and what is uncertain about the ice."""

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
