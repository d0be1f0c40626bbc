"""From measured paths to the ice they ran on: its friction map, its effects, and their errors."""

from curling_env.infrastructure.lazy_names import lazy_names

__getattr__, __dir__ = lazy_names(
    __name__,
    {
        "estimate": ("Estimate",),
        "evidence_file": ("Choices", "evidence_path", "load_evidence", "save_evidence"),
        "paper_method": ("average_cells", "estimate_by_paper"),
        "whole_ice": ("estimate_ice",),
    },
)
