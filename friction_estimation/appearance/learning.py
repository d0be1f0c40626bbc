"""Learning a stone's look from a film: the profile that no scene file gives, colours, blur.

The film itself tells: over a throw the camera sees the stone from many distances and sides, and
only the right profile leaves no residual in all of them. Places are projected out, so that an error
of the profile cannot hide in them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from curling_env.typing import Floats
from friction_estimation.appearance.exposure import (
    MIN_NOISE,
    Exposure,
    cover_of,
    keep_near,
    rendered,
    residual_noise,
    settle,
    total_misfit,
    weights_of,
)
from friction_estimation.appearance.fit import Appearance
from friction_estimation.appearance.handle import turn_together, with_handle
from friction_estimation.appearance.model import PARTS, StoneModel
from friction_estimation.appearance.profile import refine_profile

SHADOW_TRIED = 0.1
REFINEMENTS = ((3, 8), (2, 8), (1, 20))
"""Every how manyth exposure is adjusted to, and in how many rounds at most; between them noise and
headings are found anew from all."""
ENOUGH_PIXELS = 24_000
FEWEST = 8
"""Where the stone is large, so many pixels or exposures, whichever are more, are adjusted to."""
EXPOSURES = 20
"""Frames that the look is learnt from; more only cost time."""


def learn_appearance(exposures: Sequence[Exposure], model: StoneModel, noise: float) -> Appearance:
    """Colours, handle, profile and blur that explain all exposures together.

    Parameters
    ----------
    exposures : of one stone; their poses are refined in place
    model : with the scene's radius and height, and typical values for the rest
    noise : of a pixel, standard deviation in grey levels
    """
    sigma = np.maximum([3 * noise, 2 * noise, 2 * noise], MIN_NOISE)
    body = _body_colour(exposures, model)
    look = Appearance(
        model=model, colours=np.tile(body, (len(PARTS), 1)), noise=4 * sigma, has_handle=False
    )
    for exposure in exposures:
        settle(exposure, look)
    look = replace(look, colours=colours_of(exposures, look))
    for exposure in exposures:
        settle(exposure, look)
    look = with_handle(exposures, look)
    for exposure in exposures:
        keep_near(exposure, look)
    look = _with_shadow(exposures, look)
    ordered = sorted(exposures, key=lambda exposure: exposure.t)
    pixels = sum(len(exposure.picture) for exposure in exposures)
    spare = max(1, min(pixels // ENOUGH_PIXELS, len(exposures) // FEWEST))
    for every, rounds in REFINEMENTS:
        some = ordered[:: max(every, spare)]
        look = refine_profile(some, look, model, rounds)
        look = replace(look, noise=residual_noise(some, look))
        if look.has_handle:
            turn_together(exposures, look)
        for exposure in exposures:
            settle(exposure, look)
    return look


def _body_colour(exposures: Sequence[Exposure], model: StoneModel) -> Floats:
    black = np.zeros((len(PARTS), 3))
    look = Appearance(model=model, colours=black, noise=np.ones(3), has_handle=False)
    inside = [
        exposure.picture[cover_of(exposure, look)[0, :, :-1].sum(axis=1) > 0.9]
        for exposure in exposures
    ]
    return np.median(np.concatenate(inside), axis=0)


def colours_of(exposures: Sequence[Exposure], look: Appearance) -> Floats:
    """Colours of the parts by robust linear least squares, drawn weakly to the present ones."""
    colours = look.colours.copy()
    active = len(PARTS) if look.has_handle else len(PARTS) - 1
    covers = [cover_of(exposure, look) for exposure in exposures]
    for _ in range(4):
        normal = np.zeros((3, active, active))
        right = np.zeros((3, active))
        for exposure, cover in zip(exposures, covers, strict=True):
            residual = exposure.picture - rendered(cover, exposure.behind, colours)
            weight = weights_of(residual, look.noise)
            for channel, blur in enumerate((0, 1, 1)):
                share = cover[blur, :, :active]
                rest = rendered(cover, exposure.behind, np.zeros_like(colours))[:, channel]
                target = exposure.picture[:, channel] - rest
                normal[channel] += (share * weight[:, None]).T @ share
                right[channel] += (share * weight[:, None]).T @ target
        for channel in range(3):
            pull = 1e-3 * np.trace(normal[channel]) / active
            colours[:active, channel] = np.linalg.solve(
                normal[channel] + pull * np.eye(active),
                right[channel] + pull * colours[:active, channel],
            )
    return colours


def _with_shadow(exposures: Sequence[Exposure], look: Appearance) -> Appearance:
    """Start a shadow on the side where the ice beside the stone is darkest."""
    costs: list[tuple[float, Appearance]] = []
    tried = [(0.0, 0.0)]
    tried += [(0.04 * np.cos(a), 0.04 * np.sin(a)) for a in np.arange(8) * np.pi / 4]
    for dx, dy in tried:
        model = replace(
            look.model,
            shadow_x=dx,
            shadow_y=dy,
            shadow_radius=look.model.radius,
            shadow=SHADOW_TRIED,
            contact=SHADOW_TRIED,
            mirror=SHADOW_TRIED,
        )
        shaded = replace(look, model=model)
        costs.append((total_misfit(exposures, shaded), shaded))
    return min(costs, key=lambda item: item[0])[1]
