"""Derivatives of a crop's picture by a stone's shape, its colours and its pose."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

import numpy as np
from numpy.typing import NDArray

from curling_env.typing import Floats
from friction_estimation.appearance.crops import Crop, painted_planes, robust_weights
from friction_estimation.appearance.fit import Appearance
from friction_estimation.appearance.kernels.change_kernels import (
    BLUR,
    BODY,
    DARK,
    GRIP,
    LIGHT,
    picture_changes,
)
from friction_estimation.appearance.kernels.picture_kernels import blur
from friction_estimation.appearance.painting import Planes, blurred, coloured, composite_change
from friction_estimation.appearance.prior import HANDLE_PREFIXES, SHAPE_SPREAD
from friction_estimation.appearance.shape import (
    BLUR_PX,
    COLOUR_BLUR_PX,
    HANDLE,
    LIT,
    SHAPE_PARAMETERS,
    SIDE,
)

KINDS = (
    (HANDLE_PREFIXES, GRIP),
    (("shadow", "contact"), DARK),
    (("light",), LIGHT),
    (("blur", "colour_blur"), BLUR),
)
"""Parts that parameters with these prefixes change; all others change the body."""
LENGTH_STEP, STEP = 2e-3, 0.05
"""Steps of parameters that are lengths [m], and of all others, for derivatives."""
LONGEST_SPREAD = 0.1
"""Maximum prior standard deviation of a parameter that counts as a length."""
TURN_STEP = 1e-2
"""The same of the heading [rad]."""


def picture_derivatives(
    crop: Crop, look: Appearance, index: Sequence[int], parts: int, poses: int
) -> tuple[Floats, Floats, Floats]:
    """Derivatives of a crop's picture by shape, colours and pose, with residuals and weights.

    Parameters
    ----------
    index : the parameters of the shape, see `SHAPE_PARAMETERS`
    parts : number of parts with a colour
    poses : number of the pose's coordinates: none, two or three

    Returns
    -------
    derivatives (m, 3, n) and residuals (3, n) of each channel [standard deviations of the noise],
    and weights (n,) of the pixels
    """
    window = crop.window
    rows, columns = window.shape
    shape, noise = look.model.shape(), look.noise[:, None, None]
    behind = np.asarray(crop.background.T.reshape(3, rows, columns), dtype=np.float32, order="C")
    planes = painted_planes(crop, look)
    light = coloured(planes, look.colours)
    seen = blurred(light, window, shape, sloped=True)
    picture = composite_change(seen, behind)
    residual = (crop.pixels - crop.background).T.reshape(3, rows, columns) - picture
    weight = robust_weights(residual.reshape(3, -1).T, look.noise)
    jacobian = np.empty((len(index) + 3 * parts + poses, 3, rows, columns))
    places, steps, kinds = _steps(tuple(index), len(jacobian), turned=poses == 3)
    picture_changes(
        crop.pose,
        shape,
        look.colours.astype(np.float32),
        steps,
        kinds,
        window.ray_xy,
        window.ray_slope,
        window.scale,
        planes,
        light,
        seen,
        behind,
        look.noise,
        places,
        jacobian,
    )
    _add_colours(planes, shape, noise, jacobian[len(index) :][: 3 * parts])
    if poses:
        # A small movement of the stone shifts its picture.
        by_shift = np.stack([composite_change(seen[:, [d, 0, 0]], behind) for d in (1, 2)])
        px = np.linalg.inv(window.scale[0] + 0.5 * look.model.height * window.scale[1])
        jacobian[-poses:][:2] = np.einsum("sp,s...->p...", px, by_shift) / noise
    pixels = rows * columns
    return jacobian.reshape(-1, 3, pixels), (residual / noise).reshape(3, pixels), weight


def step_of(name: str) -> float:
    """Return the step of a parameter of the shape [its unit]."""
    return LENGTH_STEP if SHAPE_SPREAD[name] < LONGEST_SPREAD else STEP


@cache
def _steps(
    index: tuple[int, ...], size: int, *, turned: bool
) -> tuple[NDArray[np.int64], Floats, NDArray[np.int64]]:
    """Steps for the derivatives; see `picture_changes`.

    Parameters
    ----------
    index, size : parameters of the shape, which come first, and number of all
    turned : whether the heading comes last

    Returns
    -------
    places (n,), steps (n, 30) and kinds (n,)
    """
    places, kinds = list(range(len(index))), list[int]()
    steps = np.zeros((len(index) + turned, len(SHAPE_PARAMETERS) + 1))
    for row, i in enumerate(index):
        name = SHAPE_PARAMETERS[i]
        steps[row, i] = step_of(name)
        kinds.append(next((kind for prefixes, kind in KINDS if name.startswith(prefixes)), BODY))
    if turned:
        steps[-1, -1] = TURN_STEP
        places, kinds = [*places, size - 1], [*kinds, GRIP]
    return np.array(places), steps, np.array(kinds)


def _add_colours(planes: Planes, shape: Floats, noise: Floats, jacobian: Floats) -> None:
    """Fill in derivatives (3·parts, 3, rows, columns) by the colours of parts, in place."""
    parts, rows, columns = len(jacobian) // 3, *jacobian.shape[2:]
    jacobian[:] = 0.0
    visible = planes * (1 - planes[HANDLE])
    visible[HANDLE] = planes[HANDLE]
    lit = visible[:parts].copy()
    lit[SIDE] += visible[LIT]  # light changes brightness, not colour
    of_parts = np.empty((parts, 3, rows, columns), dtype=np.float32)
    blur(lit, rows, columns, shape[BLUR_PX], 0.0, 0.0, False, of_parts)
    jacobian[::3, 0] = of_parts[:, 0] / noise[0]
    blur(visible[:parts], rows, columns, shape[COLOUR_BLUR_PX], 0.0, 0.0, False, of_parts)
    for channel in (1, 2):
        jacobian[channel::3, channel] = of_parts[:, 0] / noise[channel]
