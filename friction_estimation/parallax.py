"""The focal length where paint cannot tell it: from how the stone's top leans over its foot.

Straight down, a longer lens further away shows the ice just the same. Not so a body of known
height: the nearer the camera, the more its top is seen shifted outwards against its foot, and the
more so towards the picture's rim. Only the right height leaves no residual all along the path.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from scipy.optimize import minimize_scalar

from friction_estimation.appearance import Exposure, StoneModel, learn_appearance, total_misfit
from friction_estimation.appearance.fit import PIXEL_CORRELATION
from friction_estimation.camera import Camera
from friction_estimation.refinement import Refined, log_height_prior

UNDECIDED = 0.02
"""Standard error of the log focal length from which on the stone is asked."""
HEIGHTS = (2.5, 25.0)
"""Cameras above a rink hang between these heights [m]."""
TOLERANCE = 0.02
"""Of the logarithm of the height at which the search ends."""
STEPS = 7
THINNED = 3
"""Every third picture of the stone is enough to tell one height from another."""


def focal_from_stone(
    landmarks: Refined,
    at_focal: Callable[[float], Refined | None],
    exposures_of: Callable[[Camera], Sequence[Exposure]],
    model: StoneModel,
    noise: float,
) -> Refined:
    """The camera whose height explains the stone's picture all along its path.

    Parameters
    ----------
    landmarks : with a focal length that the paint does not fix
    at_focal : the camera with its log focal length changed, pose and lens refitted to the paint
    exposures_of : the stone's pictures as a camera places them
    model, noise : as `learn_appearance` takes them
    """
    first = learn_appearance(exposures_of(landmarks.camera)[::THINNED], model, noise)
    tried: dict[float, Refined] = {}

    def cost(change: float) -> float:
        found = at_focal(change)
        if found is None:
            return np.inf
        exposures = exposures_of(found.camera)[::THINNED]
        if not exposures:
            return np.inf
        look = learn_appearance(exposures, model, noise)
        tried[change] = found
        misfit = total_misfit(exposures, replace(look, noise=first.noise)) / PIXEL_CORRELATION
        return misfit + log_height_prior(found.camera)

    low, high = np.log(np.array(HEIGHTS) / landmarks.camera.position[2])
    coarse = np.linspace(low, high, 4)
    costs = [cost(float(change)) for change in coarse]
    best = int(np.argmin(costs))
    if not np.isfinite(costs[best]):
        return landmarks
    bracket = coarse[max(best - 1, 0)], coarse[min(best + 1, len(coarse) - 1)]
    limits = {"xatol": TOLERANCE, "maxiter": STEPS}
    found = minimize_scalar(cost, bounds=bracket, method="bounded", options=limits)
    change = min(tried, key=lambda c: abs(c - found.x))
    return tried[change]
