"""One frame's pixels around the stone, and how well a look explains them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from curling_env.typing import Floats
from friction_estimation.appearance.fit import (
    MARGIN_PX,
    OUTLIER_AT,
    Appearance,
    channels_of,
    fit_stone,
)
from friction_estimation.appearance.fit_kernels import robust_misfit
from friction_estimation.appearance.model import PixelWindow, StoneModel, window_at
from friction_estimation.appearance.painting import (
    Planes,
    blurred,
    coloured,
    painted,
    shares,
)
from friction_estimation.camera.camera import Camera
from friction_estimation.film.frame import Frame

MIN_NOISE = 1.0
"""Residuals are never trusted better than one grey level: that is how films are stored."""
STONE_SHARE = 0.05
"""Pixels of which the stone covers less than this count as ice."""
COLOUR_DISTRUST = 5.0
"""Colour is stored at half resolution and shifted by the codec: it may find a handle, not move a
stone."""


@dataclass(eq=False)
class Crop:
    """One frame's pixels around the stone, with the current estimate of its place."""

    window: PixelWindow
    pixels: Floats
    background: Floats
    pose: Floats
    t: float


def crops_at(
    frames: Sequence[Frame],
    moments: Sequence[float],
    places: Sequence[Floats],
    background: Floats,
    background_origin: tuple[int, int],
    camera: Camera,
    model: StoneModel,
) -> list[Crop]:
    """Cut the stone out of the frames in which all of it is in the image."""
    found: list[Crop] = []
    u, v = background_origin
    for frame, t, xy in zip(frames, moments, places, strict=True):
        outline = model.outline_px(camera, xy)
        # The handle stands out above the body and the place is still rough: look a little wider.
        size = 0.35 * float(np.ptp(outline, axis=0).max()) if len(outline) else 0.0
        window = window_at(camera, outline, MARGIN_PX + size)
        if window is None:
            continue
        if not (
            (outline > 1).all()
            and (outline < np.array(camera.size) - 2).all()
            and u <= window.origin_px[0]
            and v <= window.origin_px[1]
            and window.origin_px[0] + window.shape[1] <= u + background.shape[1]
            and window.origin_px[1] + window.shape[0] <= v + background.shape[0]
        ):
            continue
        rows, columns = window.slices
        behind = background[
            rows.start - v : rows.stop - v, columns.start - u : columns.stop - u
        ].reshape(-1, 3)
        found.append(
            Crop(
                window=window,
                pixels=channels_of(frame[rows, columns]).reshape(-1, 3),
                background=np.ascontiguousarray(behind),
                pose=np.array([xy[0], xy[1], 0.0]),
                t=t,
            )
        )
    return found


def fit_pose(crop: Crop, look: Appearance) -> float:
    pose, _, misfit, visible = fit_stone(crop.pixels, crop.background, crop.window, look, crop.pose)
    if np.linalg.norm(pose[:2] - crop.pose[:2]) < 0.5:
        crop.pose = pose
    return misfit / max(visible, 1e-3)


def trim(crop: Crop, look: Appearance) -> None:
    """Drop the pixels that neither stone nor shadow can reach, now that the place is known."""
    reach = replace(
        look.model,
        blur_px=MARGIN_PX / 3,
        shadow_radius=1.3 * look.model.radius,
        shadow=1.0,
        mirror=1.0,
    )
    near = coverage(crop, replace(look, model=reach))[0].sum(axis=1) > 0
    if near.any():
        window = crop.window
        within = np.zeros(window.shape, dtype=bool)
        rows, columns = np.nonzero(near.reshape(window.shape))
        within[rows.min() : rows.max() + 1, columns.min() : columns.max() + 1] = True
        crop.window = window.cut(rows.min(), rows.max() + 1, columns.min(), columns.max() + 1)
        crop.pixels = np.ascontiguousarray(crop.pixels[within.ravel()])
        crop.background = np.ascontiguousarray(crop.background[within.ravel()])


def coverage(crop: Crop, look: Appearance) -> Planes:
    """What each part covers of every pixel, see `shares`."""
    return shares(crop.window, look.model.shape(), crop.pose, with_handle=look.has_handle)


def composite(cover: Planes, behind: Floats, colours: Floats) -> Floats:
    per_channel = cover[[0, 1, 1]]  # brightness is sharp, both colour differences are not
    parts = per_channel[:, :, :-1]
    bare = 1 - parts.sum(axis=2).T
    bare[:, 0] -= per_channel[0, :, -1]  # a shadow takes light, not colour
    return behind * bare + np.einsum("cnk,kc->nc", parts, colours)


def painted_planes(crop: Crop, look: Appearance) -> Planes:
    return painted(crop.window, look.model.shape(), crop.pose, with_handle=look.has_handle)


def robust_weights(residual: Floats, noise: Floats) -> Floats:
    total = np.sum((residual / noise) ** 2, axis=1)
    return 1 / (1 + total / (3 * OUTLIER_AT**2)) ** 2


def misfit_of(crop: Crop, look: Appearance, planes: Planes) -> float:
    """Robust misfit of one crop to a painting of the stone."""
    light = coloured(planes, look.colours)
    seen = blurred(light, crop.window, look.model.shape())
    return robust_misfit(crop.pixels, crop.background, seen, look.noise, OUTLIER_AT)


def total_misfit(crops: Sequence[Crop], look: Appearance) -> float:
    return sum(misfit_of(crop, look, painted_planes(crop, look)) for crop in crops)


def unexplained_share(crops: Sequence[Crop], look: Appearance) -> float:
    """What the stone's picture leaves of the difference from the ice without it, 0 to 1."""
    bare = 0.0
    for crop in crops:
        nothing = np.zeros_like(painted_planes(crop, look))
        bare += misfit_of(crop, look, nothing)
    return total_misfit(crops, look) / max(bare, 1e-9)


def residual_noise(crops: Sequence[Crop], look: Appearance) -> Floats:
    """Spread of what the model leaves on the stone, per channel.

    On the ice beside it little is left; measured there, every speckle of granite would count as
    something before the stone.
    """
    left: list[Floats] = []
    for crop in crops:
        cover = coverage(crop, look)
        residual = crop.pixels - composite(cover, crop.background, look.colours)
        left.append(residual[cover[0, :, :-1].sum(axis=1) > STONE_SHARE])
    spread = np.median(np.abs(np.concatenate(left)), axis=0)
    noise = np.maximum(1.4826 * spread, MIN_NOISE)
    return noise * np.array([1.0, COLOUR_DISTRUST, COLOUR_DISTRUST])
