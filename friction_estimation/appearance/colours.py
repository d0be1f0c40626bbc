"""Colours of a stone's parts, from its crops."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from curling_env.typing import Floats
from friction_estimation.appearance.crops import (
    Crop,
    composite,
    coverage,
    light_of_parts,
    robust_weights,
)
from friction_estimation.appearance.fit import Appearance
from friction_estimation.appearance.model import StoneModel
from friction_estimation.appearance.painting import Planes
from friction_estimation.appearance.shape import PARTS
from friction_estimation.appearance.tuning import COLOUR_ROUNDS


def body_colour(crops: Sequence[Crop], model: StoneModel) -> Floats:
    """Median colour (3,) of the stone's pixels, as if it had a single colour."""
    black = np.zeros((len(PARTS), 3))
    look = Appearance(model=model, colours=black, noise=np.ones(3), has_handle=False)
    covered = np.concatenate(
        [coverage(crop, look)[0, :, : len(PARTS)].sum(axis=1) for crop in crops]
    )
    pixels = np.concatenate([crop.pixels for crop in crops])
    # A stone of a few pixels fills none of them.
    return np.median(pixels[covered > 0.9 * min(covered.max(), 1.0)], axis=0)


def colours_of(crops: Sequence[Crop], look: Appearance) -> Floats:
    """Colours of the parts by robust linear least squares, near their present values."""
    colours = look.colours.copy()
    active = len(PARTS) if look.has_handle else len(PARTS) - 1
    pictures = [_by_colours(crop, look) for crop in crops]
    for _ in range(COLOUR_ROUNDS):
        normal = np.zeros((3, active, active))
        right = np.zeros((3, active))
        for target, shares in pictures:
            residual = target - np.einsum("cnp,pc->nc", shares, colours)
            weighted = shares[:, :, :active] * robust_weights(residual, look.noise)[None, :, None]
            normal += np.swapaxes(weighted, 1, 2) @ shares[:, :, :active]
            right += np.einsum("cnp,nc->cp", weighted, target)
        for channel in range(3):
            pull = 1e-3 * np.trace(normal[channel]) / active
            colours[:active, channel] = np.linalg.solve(
                normal[channel] + pull * np.eye(active),
                right[channel] + pull * colours[:active, channel],
            )
    return colours


def _by_colours(crop: Crop, look: Appearance) -> tuple[Floats, Planes]:
    """Return a crop as a linear function of the parts' colours.

    Returns
    -------
    (n, 3) what the colours must explain of its pixels; (3, n, 5) how much each part's colour adds
    to each pixel, by channel
    """
    cover = coverage(crop, look)
    target = crop.pixels - composite(cover, crop.background, np.zeros_like(look.colours))
    return target, np.stack([light_of_parts(cover, channel) for channel in range(3)])
