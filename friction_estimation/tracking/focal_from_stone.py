"""The focal length where paint cannot tell it: from how the stone's top leans over its foot.

Straight down, a longer lens further away shows the ice just the same. Not so a body of known
height: the nearer the camera, the more its top is seen shifted outwards against its foot, and the
more so towards the picture's rim. Only the right height leaves no residual all along the path. What
the paint says of the height, little as it may be, is weighed with it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from friction_estimation.appearance import Crop, StoneModel, learn_appearance, total_misfit
from friction_estimation.appearance.fit import PIXEL_CORRELATION
from friction_estimation.camera.camera import Camera
from friction_estimation.camera.refinement import RefinedCamera, log_height_prior

UNDECIDED = 0.02
"""Standard error of the log focal length from which on the stone is asked."""
HEIGHTS = (2.5, 25.0)
"""Cameras above a rink hang between these heights [m]."""
COARSE = 7
"""Heights tried first. The lean goes by one over the height, and so do their steps."""
FINE = (-0.5, -0.25, 0.25, 0.5)
"""Then these parts of a step from the best."""
REACH = 1.1
"""Steps from the best within which heights are compared."""
RISE = 0.25
"""Where the misfit is higher by about this share, it is no parabola any more."""
LEAST_SIGMA = 0.02
"""The logarithm of the height is never known better than this."""
THINNED = 3
"""Every third picture of the stone is enough to tell one height from another."""


def focal_from_stone(
    landmarks: RefinedCamera,
    refine_at_focal: Callable[[float], RefinedCamera | None],
    crops_of: Callable[[Camera], Sequence[Crop]],
    model: StoneModel,
    noise: float,
) -> RefinedCamera:
    """The camera whose height explains the stone's picture all along its path.

    Parameters
    ----------
    landmarks : with a focal length that the paint does not fix
    refine_at_focal : refits the camera's pose and lens to the paint at a changed log focal length
    crops_of : the stone's pictures as a camera places them
    model, noise : as `learn_appearance` takes them
    """
    first = learn_appearance(crops_of(landmarks.camera)[::THINNED], model, noise)

    def cost(change: float) -> float:
        found = refine_at_focal(change)
        if found is None:
            return np.inf
        crops = crops_of(found.camera)[::THINNED]
        if not crops:
            return np.inf
        look = learn_appearance(crops, model, noise)
        misfit = total_misfit(crops, replace(look, noise=first.noise)) / PIXEL_CORRELATION
        return misfit + log_height_prior(found.camera) + found.misfit - landmarks.misfit

    at = landmarks.camera.position[2]
    lowest, highest = 1 / np.array(HEIGHTS)[::-1]
    step = (highest - lowest) / (COARSE - 1)

    def costs(leans: Sequence[float]) -> list[tuple[float, float]]:
        found = [(lean, cost(float(np.log(1 / (lean * at))))) for lean in leans]
        return [(lean, value) for lean, value in found if np.isfinite(value)]

    seen = costs(np.linspace(lowest, highest, COARSE).tolist())
    if not seen:
        return landmarks
    best = min(seen, key=lambda one: one[1])[0]
    seen += costs([best + part * step for part in FINE if best + part * step > lowest / 2])
    lean, sigma = lowest_of([one for one in seen if abs(one[0] - best) < REACH * step])
    change = float(np.log(1 / (lean * at)))
    found = refine_at_focal(change)
    if found is None:
        return landmarks
    return replace(found, farther=_camera(refine_at_focal(change + max(sigma / lean, LEAST_SIGMA))))


def _camera(refined: RefinedCamera | None) -> Camera | None:
    return None if refined is None else refined.camera


def lowest_of(seen: Sequence[tuple[float, float]]) -> tuple[float, float]:
    """Where a parabola through scattered values is lowest, and its standard error.

    The look that is learnt at each height is one of several that fit nearly as well, so that single
    misfits scatter by more than noise.

    Parameters
    ----------
    seen : places and values there; one unit of value is one squared standard error
    """
    x, value = np.array(sorted(seen)).T
    at, reach = float(x[np.argmin(value)]), float(np.ptp(x))
    if len(x) < 4:
        return at, reach
    u = (x - x.mean()) / reach
    design = np.column_stack([u**2, u, np.ones(len(u))])
    weight = 1 / (1 + ((value / value.min() - 1) / RISE) ** 2) ** 2
    inverse = np.linalg.inv((design.T * weight) @ design)
    bend, slope, level = inverse @ (design.T @ (weight * value))
    if bend <= 0:
        return at, reach
    lowest = float(np.clip(-slope / (2 * bend), u.min(), u.max()))
    left = value - design @ [bend, slope, level]
    scatter = (weight * left) @ left / max(weight.sum() - 3, 1.0) * inverse
    turn = np.array([-lowest / bend, -1 / (2 * bend), 0.0])
    sigma = float(np.sqrt(turn @ scatter @ turn + 1 / bend))
    return x.mean() + reach * lowest, reach * sigma
