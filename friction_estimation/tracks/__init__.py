"""Measured paths: free slides, wrong rows, several cameras, tables of other programs."""

from curling_env.infrastructure.lazy_names import lazy_names

__getattr__, __dir__ = lazy_names(
    __name__,
    {
        "camera_fusion": ("join_cameras",),
        "contacts": ("contacts_of",),
        "free_slide": ("FreeSlide", "free_slides"),
        "gates": ("GateLog", "read_gates"),
        "importers": ("Along", "on_sheet", "read_export"),
        "measured": ("Measured",),
        "outliers": ("wild_rows",),
        "plausible_friction": ("friction_question", "rough_friction"),
        "session_pairs": ("same_throws",),
        "smoothing": ("local_fit", "smooth_motion"),
        "spin": ("fit_spin", "has_heading"),
        "throw_list": ("ThrowNote", "load_tracks", "throws_beside"),
        "throw_table": ("ThrowMeasures", "measure_throw"),
    },
)
