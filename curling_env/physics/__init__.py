"""Sliding stones: one force law, the effects it sums, and the engines that use it."""

from curling_env.infrastructure.lazy_names import lazy_names

__getattr__, __dir__ = lazy_names(
    __name__,
    {
        ".analysis.swept_draw": ("sweeping_gain",),  # formerly documented there
        "aim": ("Aim",),
        "batch": (
            "BatchEngine",
            "Positions",
            "RELEASE_DTYPE",
            "play_batch",
            "release_table",
            "throw_batch",
        ),
        "contacts": ("Entry", "contact_law", "find_contacts", "new_contacts", "solve_contacts"),
        "effects": ("EffectCard", "catalogue", "register", "unregister"),
        "engine": ("Engine", "Outcome", "Status", "StoneState"),
        "law": ("Law", "accelerate", "acceleration", "compile_law"),
        "motion": (
            "CLOCK",
            "GRAVITY",
            "HEADING",
            "MOTION_SIZE",
            "ORDER",
            "PUSH_SIZE",
            "STONE",
            "SWEPT",
            "T",
        ),
        "session": ("simulate", "slides_in_turn"),
        "slides": ("NO_BOUNDS", "Slide", "SlideEnd", "play_bounds", "slide"),
        "state": ("State",),
        "tuning": ("FINE_TOLERANCE", "QUICK_TOLERANCE"),
        "wear": (
            "IceInUse",
            "PATH_FPS",
            "wear_along_path",
            "wear_of",
            "wear_under_contacts",
            "with_wear_in_map",
            "worn",
        ),
    },
)
