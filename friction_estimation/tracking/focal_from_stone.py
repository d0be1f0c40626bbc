"""The focal length from the stone, where the paint on the ice leaves it open.

To a camera that looks straight down, a longer lens further away shows the same ice. A body of known
height looks different, though: the nearer the camera, the more its top appears shifted outwards
from its foot, the more so towards the edge of the picture. Only the right camera height fits the
stone all along its path. What little the paint says about the height is weighed in.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from friction_estimation.appearance import Crop, StoneModel, learn_appearance, total_misfit
from friction_estimation.appearance.tuning import PIXEL_CORRELATION
from friction_estimation.camera.camera import Camera
from friction_estimation.camera.refinement import RefinedCamera, log_height_prior
from friction_estimation.tracking import tuning


def focal_from_stone(
    refined: RefinedCamera,
    refine_at_focal: Callable[[float], RefinedCamera | None],
    crops_of: Callable[[Camera], Sequence[Crop]],
    model: StoneModel,
    noise: float,
) -> RefinedCamera:
    """The camera whose height fits the stone's picture all along its path.

    Parameters
    ----------
    refined : a camera whose focal length the paint leaves open
    refine_at_focal : refits the camera's pose and lens to the paint at a changed log focal length
    crops_of : gives the pictures of the stone as a camera places them
    model, noise : see `learn_appearance`
    """
    first = learn_appearance(crops_of(refined.camera)[:: tuning.FOCAL_CROP_STEP], model, noise)

    def cost(change: float) -> float:
        found = refine_at_focal(change)
        if found is None:
            return np.inf
        crops = crops_of(found.camera)[:: tuning.FOCAL_CROP_STEP]
        if not crops:
            return np.inf
        appearance = learn_appearance(crops, model, noise)
        misfit = total_misfit(crops, replace(appearance, noise=first.noise)) / PIXEL_CORRELATION
        return misfit + log_height_prior(found.camera) + found.misfit - refined.misfit

    at = refined.camera.position[2]
    # The shift of the top goes by 1 / height, so heights are tried in even steps of that.
    lowest, highest = 1 / np.array(tuning.CAMERA_HEIGHTS)[::-1]
    step = (highest - lowest) / (tuning.COARSE_HEIGHTS - 1)

    def costs(leans: Sequence[float]) -> list[tuple[float, float]]:
        found = [(lean, cost(float(np.log(1 / (lean * at))))) for lean in leans]
        return [(lean, value) for lean, value in found if np.isfinite(value)]

    seen = costs(np.linspace(lowest, highest, tuning.COARSE_HEIGHTS).tolist())
    if not seen:
        return refined
    best = min(seen, key=lambda one: one[1])[0]
    fine = [best + part * step for part in tuning.FINE_HEIGHT_STEPS]
    seen += costs([lean for lean in fine if lean > lowest / 2])
    near = tuning.PARABOLA_STEPS * step
    lean, sigma = lowest_of([one for one in seen if abs(one[0] - best) < near])
    change = float(np.log(1 / (lean * at)))
    found = refine_at_focal(change)
    if found is None:
        return refined
    one_sigma = max(sigma / lean, tuning.MIN_LOG_HEIGHT_SIGMA)
    return replace(found, farther=_camera(refine_at_focal(change + one_sigma)))


def _camera(found: RefinedCamera | None) -> Camera | None:
    return None if found is None else found.camera


def lowest_of(seen: Sequence[tuple[float, float]]) -> tuple[float, float]:
    """Where a parabola through scattered values is lowest, with the standard error of that.

    The appearance that is learnt at each height is one of several that fit nearly as well, so
    single misfits scatter more than noise alone explains.

    Parameters
    ----------
    seen : positions and values; a unit of value is a squared standard error
    """
    x, value = np.array(sorted(seen)).T
    at, reach = float(x[np.argmin(value)]), float(np.ptp(x))
    if len(x) < 4:
        return at, reach
    u = (x - x.mean()) / reach
    design = np.column_stack([u**2, u, np.ones(len(u))])
    weight = 1 / (1 + ((value / value.min() - 1) / tuning.PARABOLA_RISE) ** 2) ** 2
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
