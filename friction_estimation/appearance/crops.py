"""Crops of a film around a stone, for the estimation of its appearance."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np

from curling_env.typing import Floats
from friction_estimation.appearance.fit import Appearance, Channels, fit_stone, pixels_in
from friction_estimation.appearance.model import CIRCLE, PixelWindow, StoneModel, window_at
from friction_estimation.appearance.painting import (
    Planes,
    blurred,
    coloured,
    composite_change,
    painted,
    shares,
)
from friction_estimation.appearance.shape import LIT, PARTS, SHADE, SIDE
from friction_estimation.appearance.tuning import (
    COLOUR_NOISE_FACTOR,
    MARGIN_PX,
    MIN_NOISE,
    MIN_STONE_SHARE,
    OUTLIER_AT,
    SHADOW_REACH,
    STRANGE_PICTURE,
)
from friction_estimation.camera.camera import Camera
from friction_estimation.film.frame import Frame


@dataclass(eq=False)
class Crop:
    """One frame around the stone.

    Parameters
    ----------
    window : the pixels and their rays
    pixels, background : (n, 3) channels of the frame, and of the ice without the stone
    pose : (3,) the present estimate of x, y [m] and heading [rad]
    t : time of the frame [s]
    expected : heading that a stone that turns steadily has then [rad]; None where it is not known
    """

    window: PixelWindow
    pixels: Floats
    background: Floats
    pose: Floats
    t: float
    expected: float | None = None

    @property
    def off_expected(self) -> float:
        """Deviation of the heading from that of a steadily turning stone [rad]; 0 if unknown."""
        if self.expected is None:
            return 0.0
        return math.remainder(self.expected - float(self.pose[2]), 2 * math.pi)


def crops_at(
    frames: Sequence[Frame],
    moments: Sequence[float],
    places: Sequence[Floats],
    background: Channels,
    background_origin: tuple[int, int],
    camera: Camera,
    model: StoneModel,
    windows: Mapping[float, PixelWindow] | None = None,
) -> list[Crop]:
    """Return crops of the frames in which the whole stone is in the image.

    Parameters
    ----------
    frames, moments, places : the frames, their times [s], and where the stone is in each (2,) [m]
    background : (rows, columns, 3) channels of the ice without the stone
    background_origin : column and row of its upper left pixel in the frame
    camera, model : what filmed, and the shape of the stone
    windows : the pixels of each crop by its time [s], where they are not to follow the camera;
        moments without any are skipped
    """
    found: list[Crop] = []
    u, v = background_origin
    for frame, t, xy in zip(frames, moments, places, strict=True):
        outline = model.outline_px(camera, xy)
        # Slightly wider: the handle is above the body, and the position is still rough.
        size = 0.35 * float(np.ptp(outline, axis=0).max()) if len(outline) else 0.0
        window = window_at(camera, outline, MARGIN_PX + size)
        if windows is not None:
            window = None if t not in windows else windows[t].seen_by(camera)
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
        pixels, behind = pixels_in(window, frame, background, background_origin)
        pose = np.array([xy[0], xy[1], 0.0])
        found.append(Crop(window=window, pixels=pixels, background=behind, pose=pose, t=t))
    return found


def clear_surroundings(crop: Crop, camera: Camera, model: StoneModel) -> None:
    """Put bare ice where stone, handle, shadow and mirror image do not reach, in place.

    People may be there.
    """
    reach = model.radius + SHADOW_REACH
    levels = (-model.height, 0.0, model.height, model.height + model.handle_rise)
    around = np.concatenate(
        [np.column_stack([crop.pose[:2] + reach * CIRCLE, np.full(len(CIRCLE), z)]) for z in levels]
    )
    px = camera.project(around)
    if not np.isfinite(px).all():
        return
    hull = cv2.convexHull((px - np.array(crop.window.origin_px)).astype(np.float32))
    near = np.zeros(crop.window.shape, dtype=np.uint8)
    cv2.fillConvexPoly(near, np.rint(hull).astype(np.int32), 1)
    near = cv2.dilate(near, np.ones((3, 3), np.uint8))
    beyond = near.ravel() == 0
    crop.pixels[beyond] = crop.background[beyond]


def fit_pose(crop: Crop, look: Appearance) -> float:
    """Fit the pose of a crop, in place; returns the misfit per visible share."""
    pose, _, misfit, visible = fit_stone(
        crop.pixels, crop.background, crop.window, look, crop.pose, crop.expected
    )
    if np.linalg.norm(pose[:2] - crop.pose[:2]) < 0.5:
        crop.pose = pose
    return misfit / max(visible, 1e-3)


def trim(crop: Crop, look: Appearance) -> None:
    """Drop the pixels that neither the stone nor its shadow can reach."""
    reach = replace(
        look.model,
        blur_px=MARGIN_PX / 3,
        shadow_radius=1.3 * look.model.radius,
        shadow=1.0,
        mirror=1.0,
    )
    near = coverage(crop, replace(look, model=reach))[0, :, : SHADE + 1].sum(axis=1) > 0
    if near.any():
        inside = np.zeros(crop.window.shape, dtype=bool)
        rows, columns = np.nonzero(near.reshape(inside.shape))
        inside[rows.min() : rows.max() + 1, columns.min() : columns.max() + 1] = True
        crop.window = crop.window.cut(inside)
        crop.pixels = crop.pixels[inside.ravel()]
        crop.background = crop.background[inside.ravel()]


def coverage(crop: Crop, look: Appearance) -> Planes:
    """Return the share of each pixel that every part covers, see `painting.shares`."""
    return shares(painted_planes(crop, look), crop.window, look.model.values)


def composite(cover: Planes, behind: Floats, colours: Floats) -> Floats:
    """Return the picture (n, 3) of a stone with these colours over the ice; see `coverage` for
    `cover`.
    """
    bare = 1 - cover[[0, 1, 1], :, : len(PARTS)].sum(axis=2).T
    bare[:, 0] -= cover[0, :, SHADE]  # a shadow reduces light, not colour
    own = [light_of_parts(cover, channel) @ colours[:, channel] for channel in range(3)]
    return behind * bare + np.column_stack(own)


def light_of_parts(cover: Planes, channel: int) -> Planes:
    """Return the contribution of each part's colour to the pixels of a channel, (n, 5)."""
    # Brightness is sharp, both colour differences are not.
    parts = cover[min(channel, 1), :, : len(PARTS)]
    if channel == 0:
        parts = parts.copy()
        parts[:, SIDE] += cover[0, :, LIT]
    return parts


def painted_planes(crop: Crop, look: Appearance) -> Planes:
    return painted(crop.window, look.model.values, crop.pose, with_handle=look.has_handle)


def robust_weights(residual: Floats, noise: Floats) -> Floats:
    """Weights (n,) of pixels with residuals (n, 3); outliers get small weights."""
    total = np.sum((residual / noise) ** 2, axis=1)
    return 1 / (1 + total / (3 * OUTLIER_AT**2)) ** 2


def misfit_of(crop: Crop, look: Appearance, planes: Planes) -> float:
    """Robust misfit of a crop to painted planes [squared standard errors, correlated pixels]."""
    seen = blurred(coloured(planes, look.colours), crop.window, look.model.values)[:, 0]
    change = composite_change(seen.reshape(5, -1), crop.background.T)
    residual = crop.pixels - crop.background - change.T
    squares = residual**2 @ look.noise**-2.0
    return float(np.sum(squares / (1 + squares / (3 * OUTLIER_AT**2))))


def total_misfit(crops: Sequence[Crop], look: Appearance) -> float:
    """Sum of the crops' robust misfits to an appearance."""
    return sum(misfit_of(crop, look, painted_planes(crop, look)) for crop in crops)


def unexplained_share(crops: Sequence[Crop], look: Appearance, grain: float = 0.0) -> float:
    """Unexplained share of the difference from bare ice, 0 to 1.

    Parameters
    ----------
    grain : standard deviation of what the camera adds to each pixel's brightness, which nothing
        explains [grey levels]
    """
    bare = 0.0
    pixels = sum(len(crop.pixels) for crop in crops)
    noise = pixels * min(grain / float(look.noise[0]), 1.0) ** 2
    for crop in crops:
        nothing = np.zeros_like(painted_planes(crop, look))
        bare += misfit_of(crop, look, nothing)
    return max(total_misfit(crops, look) - noise, 0.0) / max(bare - noise, 1e-9)


def explained_crops(crops: Sequence[Crop], look: Appearance) -> list[Crop]:
    """Return the crops that an appearance explains by more than half; all if these are a
    minority.
    """
    like = [crop for crop in crops if unexplained_share([crop], look) < STRANGE_PICTURE]
    return like if len(like) > len(crops) / 2 else list(crops)


def residual_noise(crops: Sequence[Crop], look: Appearance) -> Floats:
    """Robust standard deviation of the residuals on the stone, per channel (3,).

    Residuals on the ice beside it are smaller: with these, every speckle of granite would count as
    an occlusion.
    """
    left: list[Floats] = []
    for crop in crops:
        cover = coverage(crop, look)
        residual = crop.pixels - composite(cover, crop.background, look.colours)
        left.append(residual[cover[0, :, : len(PARTS)].sum(axis=1) > MIN_STONE_SHARE])
    spread = np.median(np.abs(np.concatenate(left)), axis=0)
    noise = np.maximum(1.4826 * spread, MIN_NOISE)
    return noise * np.array([1.0, COLOUR_NOISE_FACTOR, COLOUR_NOISE_FACTOR])
