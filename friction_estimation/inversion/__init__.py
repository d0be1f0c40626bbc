"""From measured paths to the friction of the ice they ran on, its effects being known."""

from friction_estimation.inversion.design.cramer_rao import CellBound, cell_bound, uniform_bound
from friction_estimation.inversion.estimate import METHODS, Estimate, Method, estimate_friction
from friction_estimation.inversion.friction.information import StoredInformation
from friction_estimation.inversion.systematic.camera_bias_evidence import CameraBiasSearch
from friction_estimation.inversion.trajectory_fit import CameraBiasChoice

__all__ = [
    "METHODS",
    "CameraBiasChoice",
    "CameraBiasSearch",
    "CellBound",
    "Estimate",
    "Method",
    "StoredInformation",
    "cell_bound",
    "estimate_friction",
    "uniform_bound",
]
