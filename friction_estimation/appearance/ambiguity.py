"""Positions of the stone under appearances that fit nearly as well: likelihood along the line of
sight.

A higher stone nearer to the camera looks almost like a lower one farther away, if its foot and its
edges differ slightly. The curvature at the best appearance does not show this, because the shape
changes differently farther along that valley. All crops are therefore moved together along their
lines of sight, and the most likely shape is found again at each step.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.interpolate import PchipInterpolator

from curling_env.typing import Floats
from friction_estimation.appearance.crops import Crop
from friction_estimation.appearance.fit import Appearance, ShapeUncertainty
from friction_estimation.appearance.prior import ShapePrior
from friction_estimation.appearance.profile import ProfileFit, fit_profile, shape_uncertainty
from friction_estimation.appearance.tuning import (
    PLACED_ROUNDS,
    RAISED,
    RISE_SIGMA,
    RISES,
    UNLIKELY_SHAPE,
)


def sight_uncertainty(
    crops: Sequence[Crop], fit: ProfileFit, prior: ShapePrior, typical: bool
) -> ShapeUncertainty:
    """Return the misplacement of the stone by shapes that fit nearly as well.

    Parameters
    ----------
    crops : crops of one stone, with the poses of the fit
    fit : of a look to them
    prior : what stones of its kind are like
    typical : whether the middle of the prior is a real stone's; if not, the mean over shapes is no
        better than the most likely one, and what others say counts as an error only
    """
    uncertainty = shape_uncertainty(crops, fit)
    rise, sigma = likely_rise(crops, fit.look, prior)
    if not typical:
        rise, sigma = 0.0, float(np.hypot(sigma, rise))
    toward = np.array([_toward_camera(crop) for crop in crops])
    return replace(
        uncertainty,
        sigma=np.maximum(uncertainty.sigma, sigma * np.abs(toward)),
        shift=rise * toward,
    )


def likely_rise(crops: Sequence[Crop], look: Appearance, prior: ShapePrior) -> tuple[float, float]:
    """Height of the stone in the pictures above that of an appearance, with its standard error [m].

    A higher stone is nearer to the camera. If the pictures hardly determine the height, it changes
    little but has a large error.

    Parameters
    ----------
    crops, look, prior : see `sight_uncertainty`
    """
    crops = crops[:: max(1, len(crops) // RAISED)]
    found: dict[float, float] = {}
    middle = look
    for way in ((0.0, *RISES), [-rise for rise in RISES]):
        at = middle
        for rise in way:
            moved = [_raised(crop, rise) for crop in crops]
            fit = fit_profile(moved, at, prior, PLACED_ROUNDS, placed=True)
            at, found[rise] = fit.look, fit.unlikelihood()
            if rise == 0.0:
                middle = at
            if found[rise] > min(found.values()) + UNLIKELY_SHAPE:
                break
    rises = np.array(sorted(found))
    fine = np.linspace(rises[0], rises[-1], 200)
    cost = PchipInterpolator(rises, [found[rise] for rise in rises])(fine)
    weight = np.exp(-0.5 * (cost - cost.min()))
    trusted = weight * np.exp(-0.5 * (fine / RISE_SIGMA) ** 2)
    mean = float(trusted @ fine / trusted.sum())
    return mean, float(np.sqrt(weight @ (fine - mean) ** 2 / weight.sum()))


def _raised(crop: Crop, rise: float) -> Crop:
    """Return the crop with the stone moved towards the camera, as for a stone that is higher by
    this much.
    """
    return replace(crop, pose=crop.pose + rise * np.append(_toward_camera(crop), 0.0))


def _toward_camera(crop: Crop) -> Floats:
    """Return the shift of the line of sight towards the camera per metre of height, (2,)."""
    return crop.window.ray_slope.mean(axis=0)
