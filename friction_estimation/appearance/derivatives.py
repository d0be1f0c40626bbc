"""Derivatives of a crop's picture by a stone's shape, its colours and its pose."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from curling_env.typing import Floats
from friction_estimation.appearance.crops import (
    Crop,
    light_of_parts,
    painted_planes,
    robust_weights,
)
from friction_estimation.appearance.fit import Appearance
from friction_estimation.appearance.kernels.change_kernels import change_of_picture
from friction_estimation.appearance.model import ShapeValues
from friction_estimation.appearance.painting import (
    Planes,
    blurred,
    coloured,
    composite_change,
    shares,
)
from friction_estimation.appearance.prior import HANDLE_PREFIXES, SHAPE_PRIOR

SHADE_PREFIXES = ("shadow", "contact")
"""Parameters with these prefixes change only the light on the ice."""
LENGTH_STEP, STEP = 2e-3, 0.05
"""Steps of parameters that are lengths [m], and of all others, for derivatives."""
LONGEST_SPREAD = 0.1
"""Maximum prior standard deviation of a parameter that counts as a length."""
TURN_STEP = 1e-2
"""The same of the heading [rad]."""


def picture_derivatives(
    crop: Crop, look: Appearance, names: Sequence[str], parts: int, poses: int
) -> tuple[Floats, Floats, Floats]:
    """Derivatives of a crop's picture by shape, colours and pose, with residuals and weights.

    Parameters
    ----------
    names : the parameters of the shape, see `StoneModel`
    parts : number of parts with a colour
    poses : number of the pose's coordinates: none, two or three

    Returns
    -------
    derivatives (m, 3, n) and residuals (3, n) of each channel [standard deviations of the noise],
    and weights (n,) of the pixels
    """
    window, shape, noise = crop.window, look.model.values, look.noise[:, None, None]
    rows, columns = window.shape
    behind = np.asarray(crop.background.T.reshape(3, rows, columns), dtype=np.float32, order="C")
    planes = painted_planes(crop, look)
    light = coloured(planes, look.colours)
    seen = blurred(light, window, shape, sloped=True)
    picture = composite_change(seen[:, 0], behind)
    residual = (crop.pixels - crop.background).T - picture.reshape(3, -1)
    jacobian = np.zeros((len(names) + 3 * parts + poses, 3, rows, columns))
    by_shape, by_colours = jacobian[: len(names)], jacobian[len(names) :][: 3 * parts]
    for name, change in zip(names, by_shape, strict=True):
        step = step_of(name)
        moved = shape._replace(**{name: getattr(shape, name) + step})
        if name in ("blur_px", "colour_blur_px"):
            changed = blurred(light, window, moved)[:, 0] - seen[:, 0]
            np.divide(composite_change(changed, behind), step * noise, out=change)
        else:
            _fill_change(change, step, crop, look, (planes, light, behind), name, moved)
    cover = shares(planes, window, shape)
    for channel in range(3):
        light_of = light_of_parts(cover, channel)[:, :parts]
        by_colours[channel::3, channel] = light_of.T.reshape(parts, rows, columns)
        by_colours[channel::3, channel] /= look.noise[channel]
    if poses:
        # A small movement of the stone shifts its picture.
        by_shift = np.stack([composite_change(seen[:, d], behind) for d in (1, 2)])
        px = np.linalg.inv(window.scale[0] + 0.5 * look.model.height * window.scale[1])
        jacobian[-poses:][:2] = np.einsum("sp,s...->p...", px, by_shift) / noise
    if poses == 3:
        turned = replace(crop, pose=crop.pose + np.array([0.0, 0.0, TURN_STEP]))
        before = planes, light, behind
        _fill_change(jacobian[-1], TURN_STEP, turned, look, before, "handle", shape)
    weight = robust_weights(residual.T, look.noise)
    return jacobian.reshape(-1, 3, rows * columns), residual / look.noise[:, None], weight


def step_of(name: str) -> float:
    """Return the step of a parameter of the shape [its unit]."""
    return LENGTH_STEP if SHAPE_PRIOR[name][0] < LONGEST_SPREAD else STEP


def _fill_change(
    change: Floats,
    step: float,
    crop: Crop,
    look: Appearance,
    before: tuple[Planes, Planes, Planes],
    name: str,
    moved: ShapeValues,
) -> None:
    """Fill in the change of the picture by another shape or pose, (3, rows, columns) [standard
    deviations of the noise, per unit of the step].

    Parameters
    ----------
    crop : with the changed pose
    before : the stone before, as `painted` and `coloured`, and the channels of the ice
    name : the parameter that changed, or what it begins with
    moved : the changed shape
    """
    window = crop.window
    handle, shade = name.startswith(HANDLE_PREFIXES), name.startswith(SHADE_PREFIXES)
    change_of_picture(
        crop.pose,
        moved,
        not (handle or shade),
        shade or name == "foot_inset",  # the contact shade begins below the foot
        handle,
        look.colours.astype(np.float32),
        (look.model.blur_px, look.model.colour_blur_px),
        window.ray_xy,
        window.ray_slope,
        window.scale,
        *before,
        step * look.noise,
        change,
    )
