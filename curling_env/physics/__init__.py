"""Sliding stones: one force law, the effects it sums, and the engines that use it."""

from curling_env.infrastructure.lazy_names import lazy_names

__getattr__, __dir__ = lazy_names(
    __name__,
    {
        "effects": ("EffectCard", "catalogue", "register", "unregister"),
        "ice_uncertainty": ("is_uncertain", "plausible_ices", "rest_spread"),
        "law": ("Law", "accelerate", "acceleration", "compile_law"),
        "many_stones.batch": (
            "BatchEngine",
            "Positions",
            "RELEASE_DTYPE",
            "play_batch",
            "release_table",
            "throw_batch",
        ),
        "many_stones.contacts": (
            "Entry",
            "contact_law",
            "find_contacts",
            "new_contacts",
            "solve_contacts",
        ),
        "many_stones.engine": ("Engine", "Outcome", "Status", "StoneState"),
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
        "one_stone.aim": ("Aim",),
        "one_stone.shot_times": ("shoot",),
        "one_stone.slide": ("NO_BOUNDS", "Slide", "SlideEnd", "play_bounds", "slide"),
        "one_stone.sweeping_gain": ("sweeping_gain",),
        "one_stone.tuning": ("FINE_TOLERANCE", "QUICK_TOLERANCE"),
        "session": ("simulate", "slides_in_turn"),
        "state": ("State",),
        "sweep": ("Sweep", "run"),
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
