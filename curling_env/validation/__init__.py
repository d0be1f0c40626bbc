"""Comparison of an ice with published measurements: agreement, and reasons for differences."""

from curling_env.infrastructure.lazy_names import lazy_names
from curling_env.validation.row import Comparison, Row, Verdict
from curling_env.validation.shots import Shots
from curling_env.validation.table import ICE_ROWS, OTHER_ROWS, compare

__all__ = ["ICE_ROWS", "OTHER_ROWS", "Comparison", "Row", "Shots", "Verdict", "compare"]

__getattr__, __dir__ = lazy_names(
    __name__,
    {
        "shots": ("HOG_TO_HOG",),
        "table": ("as_text", "counts", "in_words", "preset_of"),
    },
)
