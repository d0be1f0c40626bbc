"""The closed loop: throws on hidden ice, an estimate of the ice from them, and better throws.

- `demo`: one hidden ice, filmed throws and a page of pictures; `curling demo` runs it
- `experiment`: the measured form, with exact and erring throws planned on four kinds of knowledge
- `hidden_ice`, `integrator`: ice that nothing else knows, and how stones run on it
- `practice`, `filming`: practice throws, and what a camera sees of them
- `execution`: planned throws carried out on the hidden ice
- `areas`: heavy and keen areas in a curler's words
"""

from curling_env.infrastructure.lazy_names import lazy_names

__getattr__, __dir__ = lazy_names(
    __name__,
    {
        "areas": ("find_areas",),
        "demo": ("find_missing_effect", "run_demo"),
        "execution": ("execute_plan",),
        "hidden_ice": ("draw_hidden_ice", "patchy_ice"),
        "integrator": ("run_stone",),
        "practice": (
            "POSITION_NOISE",
            "draw_practice",
            "film_camera",
            "mixed_practice",
            "noisy_track",
            "track_errors",
        ),
    },
)
