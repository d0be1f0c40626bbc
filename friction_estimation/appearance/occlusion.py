"""Measurement of a stone among others: stones behind it are part of its background, nearer ones
hide it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np

from curling_env.typing import Flags, Floats
from friction_estimation.appearance.crops import Crop, composite, coverage
from friction_estimation.appearance.fit import Appearance, Channels, StoneFit, cut_out, fit_window
from friction_estimation.appearance.model import PixelWindow
from friction_estimation.appearance.shape import PARTS
from friction_estimation.appearance.tuning import (
    FILL_ROUNDS,
    MARGIN_PX,
    MAX_HIDDEN,
    MIN_STONE_SHARE,
    OUTLIER_AT,
)
from friction_estimation.camera.camera import Camera
from friction_estimation.film.frame import Frame


@dataclass(frozen=True, kw_only=True, eq=False)
class PosedStone:
    """Stone of known appearance and pose.

    Parameters
    ----------
    look : its look
    pose : (3,) x, y [m] and heading [rad]
    in_background : whether the background shows it already; then it only hides others
    """

    look: Appearance
    pose: Floats
    in_background: bool = False


def measure_occluded(
    frame: Frame,
    background: Channels,
    background_origin: tuple[int, int],
    camera: Camera,
    appearance: Appearance,
    start: Floats,
    others: Sequence[PosedStone] = (),
    people: bool = False,
) -> StoneFit | None:
    """Fit the stone near `start` in a frame, perhaps with other stones or people around it.

    Hidden pixels are filled, round by round, with the painted stone at the present pose, so that
    they do not influence it (expectation maximisation).

    Parameters
    ----------
    frame : (height, width, 3) BGR
    background : (rows, columns, 3) channels (`channels_of`) of the ice without the stone
    background_origin : column and row of the background's upper left pixel in the frame
    start : (3,) x, y [m], theta [rad]
    others : the stones around it, where they are in this frame
    people : whether a person may be in the way: what neither stone nor ice explains counts as
        hidden, and so do its neighbours, into which it is blurred

    Returns
    -------
    None where nothing of it is in the image, or too much of it is hidden
    """
    cut = cut_out(frame, background, background_origin, camera, appearance, start)
    if cut is None:
        return None
    window, picture, behind = cut
    own = Crop(window=window, pixels=picture, background=behind, pose=start, t=0.0)
    hidden = add_neighbours(own, others, camera)
    behind = own.background
    if not hidden.any():
        fit = fit_window(picture, behind, window, camera, appearance, start)
        return _without_people(own, fit, camera, appearance) if people else fit
    body = coverage(own, appearance)[0, :, : len(PARTS)].sum(axis=1)
    if body[hidden].sum() > MAX_HIDDEN * body.sum():
        return None
    fit: StoneFit | None = None
    pose = np.array(start, dtype=np.float64)
    for _ in range(FILL_ROUNDS):
        own.pose = pose
        shown = composite(coverage(own, appearance), behind, appearance.colours)
        picture[hidden] = shown[hidden]
        fit = fit_window(picture, behind, window, camera, appearance, pose)
        pose = np.array([*fit.xy, fit.theta if appearance.has_handle else pose[2]])
    return fit


def _without_people(crop: Crop, fit: StoneFit, camera: Camera, appearance: Appearance) -> StoneFit:
    """Fit without the pixels that neither the stone nor the ice explains.

    Parameters
    ----------
    crop : the stone; its pose is changed
    fit : to all of its pixels
    """
    found, seen = fit, crop.pixels
    for _ in range(FILL_ROUNDS):
        turned = found.theta if appearance.has_handle else crop.pose[2]
        crop.pose = np.array([*found.xy, turned])
        crop.pixels = seen
        hidden = fill_hidden(crop, appearance)
        if hidden is None:
            break
        if hidden > MAX_HIDDEN:
            return replace(fit, hidden=hidden)
        found = fit_window(crop.pixels, crop.background, crop.window, camera, appearance, crop.pose)
        found = replace(
            found,
            covariance=found.covariance / (1 - hidden) ** 2,
            visible=fit.visible,
            hidden=hidden,
        )
    return found


def fill_hidden(crop: Crop, appearance: Appearance) -> float | None:
    """Fill occluded pixels of a crop, and those around them, with the painted stone, in place.

    Returns
    -------
    the share of the stone that was filled in; None where all pixels show it or the ice
    """
    cover = coverage(crop, appearance)
    shown = composite(cover, crop.background, appearance.colours)
    off = (crop.pixels - shown) / (OUTLIER_AT * appearance.noise)
    strange = np.mean(off**2, axis=1) > 1
    if not strange.any():
        return None
    wide = cv2.dilate(strange.reshape(crop.window.shape).view(np.uint8), np.ones((3, 3), np.uint8))
    strange = wide.ravel() > 0
    crop.pixels = np.where(strange[:, None], shown, crop.pixels)
    body = cover[0, :, : len(PARTS)].sum(axis=1)
    return float(body[strange].sum() / max(body.sum(), 1e-9))


def add_neighbours(crop: Crop, others: Sequence[PosedStone], camera: Camera) -> Flags:
    """Put other stones into the background of a crop, in place.

    Returns
    -------
    (n,) the pixels in which a nearer stone may hide that of the crop
    """
    hidden = np.zeros(len(crop.pixels), dtype=bool)
    distance = _distance(camera, crop.pose)
    for other in sorted(others, key=lambda other: -_distance(camera, other.pose)):
        if not _reaches(crop.window, other, camera):
            continue
        cover = coverage(replace(crop, pose=other.pose), other.look)
        if not other.in_background:
            crop.background = np.ascontiguousarray(
                composite(cover, crop.background, other.look.colours)
            )
        if _distance(camera, other.pose) < distance:
            hidden |= cover[0, :, : len(PARTS)].sum(axis=1) > MIN_STONE_SHARE
    return hidden


def _distance(camera: Camera, pose: Floats) -> float:
    return float(np.linalg.norm(camera.position[:2] - pose[:2]))


def _reaches(window: PixelWindow, other: PosedStone, camera: Camera) -> bool:
    """Return whether another stone, its handle or its shadow, may touch a window's pixels."""
    outline = other.look.model.outline_px(camera, other.pose[:2])
    if len(outline) == 0:
        return False
    size = np.ptp(outline, axis=0)
    low, high = outline.min(axis=0) - size / 2 - MARGIN_PX, outline.max(axis=0) + size / 2
    u, v = window.origin_px
    rows, columns = window.shape
    return bool(low[0] < u + columns and high[0] > u and low[1] < v + rows and high[1] > v)
