"""Appearance of another stone on the sheet: the shape of the thrown one, in different colours."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from curling_env.typing import Floats
from friction_estimation.appearance import Appearance
from friction_estimation.appearance.crops import (
    Crop,
    composite,
    coverage,
    light_of_parts,
    misfit_of,
    painted_planes,
    robust_weights,
)
from friction_estimation.appearance.shape import HANDLE, PARTS
from friction_estimation.appearance.tuning import HEADINGS_TRIED, PIXEL_CORRELATION
from friction_estimation.film.channels import blue_and_red, channels_of_colour, green_beside
from friction_estimation.tracking import tuning


@dataclass(frozen=True, kw_only=True, eq=False)
class OwnLook:
    """Appearance of a stone in its pictures.

    Parameters
    ----------
    look : with its own colours
    heading : the most likely [rad]; 0 where it has no handle
    clear : whether all others are far less likely
    """

    look: Appearance
    heading: float
    clear: bool


def own_look(crop: Crop, thrown: Appearance) -> OwnLook:
    """Estimate the appearance of the stone in a picture, with its heading.

    All stones have similar granite, and the colours of handles are limited to those that film can
    show: otherwise the colours of a reversed handle could explain the picture.

    Parameters
    ----------
    crop : the picture; its place is nearly right
    thrown : the look of the thrown stone
    """
    placed = replace(crop, pose=np.array([*crop.pose[:2], 0.0]))
    if not thrown.has_handle:
        return OwnLook(look=_coloured(placed, thrown)[0], heading=0.0, clear=False)
    headings = np.linspace(-np.pi, np.pi, HEADINGS_TRIED, endpoint=False)
    found: list[tuple[Appearance, float]] = []
    for heading in headings:
        placed.pose[2] = heading
        found.append(_coloured(placed, thrown))
    costs = np.array([cost for _, cost in found])
    best = int(np.argmin(costs))
    away = np.abs(np.angle(np.exp(1j * (headings - headings[best]))))
    others = costs[away > tuning.HEADING_MATCH].min()
    return OwnLook(
        look=found[best][0],
        heading=float(headings[best]),
        clear=bool(others - costs[best] > tuning.CLEAR_HEADING**2),
    )


def _coloured(crop: Crop, thrown: Appearance) -> tuple[Appearance, float]:
    """Return the look of a stone in its most likely colours, and the misfit of its picture [squared
    standard errors].
    """
    cover = coverage(crop, thrown)
    usual, spread = _usual(thrown)
    active = len(PARTS) if thrown.has_handle else len(PARTS) - 1
    colours = usual.copy()
    rest = crop.pixels - composite(cover, crop.background, np.zeros_like(colours))
    for _ in range(tuning.COLOUR_ROUNDS):
        shown = composite(cover, crop.background, colours)
        weight = robust_weights(crop.pixels - shown, thrown.noise) / PIXEL_CORRELATION
        for channel in range(3):
            share = light_of_parts(cover, channel)[:, :active]
            result = (share * weight[:, None]).T / thrown.noise[channel] ** 2
            believed = spread[:active, channel] ** -2.0
            colours[:active, channel] = np.linalg.solve(
                result @ share + np.diag(believed),
                result @ rest[:, channel] + believed * usual[:active, channel],
            )
        if thrown.has_handle:
            colours[HANDLE] = _filmable(colours[HANDLE])
    look = replace(thrown, colours=colours)
    misfit = float((((colours - usual) / spread)[:active] ** 2).sum())
    return look, misfit + misfit_of(crop, look, painted_planes(crop, look)) / PIXEL_CORRELATION


def _usual(thrown: Appearance) -> tuple[Floats, Floats]:
    """Mean and standard deviation of a stone's colours, each (5, 3)."""
    usual = thrown.colours.copy()
    spread = np.tile(np.array(tuning.GRANITE_SPREAD), (len(PARTS), 1))
    usual[HANDLE], spread[HANDLE] = tuning.USUAL_HANDLE, tuning.HANDLE_SPREAD
    return usual, spread


def _filmable(colour: Floats) -> Floats:
    """Return the nearest colour that a film can show, between black and white."""
    blue, red = np.clip(blue_and_red(colour), 0.0, 255.0).tolist()
    green = float(np.clip(green_beside(float(colour[0]), blue, red), 0.0, 255.0))
    return channels_of_colour(blue, green, red)
