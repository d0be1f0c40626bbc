"""A camera at the sheet: its lens, and its pose from known points and the painted lines."""

from curling_env.infrastructure.lazy_names import lazy_names

__getattr__, __dir__ = lazy_names(
    __name__,
    {
        "agreement": ("disagreeing", "seen_curves"),
        "annotation.annotate": ("Annotation",),
        "annotation.server": ("AnnotationServer",),
        "camera": ("Camera",),
        "chessboard": ("Board", "calibrate_lens", "find_board"),
        "lens": ("FreeLens", "TERMS"),
        "markings": ("grey_levels", "keypoints_of", "markings_of", "measure_markings"),
        "pose": ("camera_from_scene", "place_sigma"),
        "refined": ("log_height_prior", "unrefined"),
        "refinement": ("refine", "refine_at_focal"),
        "scene": ("CORNERS", "Scene", "load_lens", "load_scene", "save_scene"),
        "locate": ("camera_from_photo",),
        "top_view": ("TopView",),
    },
)
