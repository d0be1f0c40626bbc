"""From measured paths to the ice they ran on; `estimate_ice` is the way in."""

from friction_estimation.inversion.design.cramer_rao import CellBound, cell_bound, uniform_bound
from friction_estimation.inversion.estimate import METHODS, Estimate, Method, estimate_ice
from friction_estimation.inversion.information import Knowledge
from friction_estimation.inversion.systematic.bias_search import BiasSearch
from friction_estimation.inversion.trajectory_fit import CameraBiasChoice

__all__ = [
    "METHODS",
    "BiasSearch",
    "CameraBiasChoice",
    "CellBound",
    "Estimate",
    "Knowledge",
    "Method",
    "cell_bound",
    "estimate_ice",
    "uniform_bound",
]
