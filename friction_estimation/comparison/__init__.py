"""Measured throws beside those that an estimated ice predicts."""

from curling_env.infrastructure.lazy_names import lazy_names

__getattr__, __dir__ = lazy_names(
    __name__,
    {
        "gate_times": ("GateComparison", "GateRethrow", "compare_gate_times"),
        "rethrow": ("Comparison", "Rethrow", "compare_tracks", "position_noise"),
    },
)
