"""Search for a stone's handle and headings in the residual of the painted body."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from curling_env.typing import Floats
from friction_estimation.appearance.colours import colours_of
from friction_estimation.appearance.crops import (
    Crop,
    composite,
    coverage,
    crops_at,
    fit_pose,
    misfit_of,
    painted_planes,
    total_misfit,
)
from friction_estimation.appearance.fit import Appearance, Channels
from friction_estimation.appearance.occlusion import PosedStone, add_neighbours
from friction_estimation.appearance.painting import repaint_handle
from friction_estimation.appearance.shape import HANDLE, PARTS, TOP
from friction_estimation.appearance.tuning import (
    HANDLE_COLLARS,
    HANDLE_RISES,
    HEADINGS_COMPARED,
    HEADINGS_TRIED,
    MAX_HIDDEN_HEADING,
    MIN_HANDLE_CONTRAST,
    PIXEL_CORRELATION,
    SPIN_CHANGE,
    SPINS_TRIED,
)
from friction_estimation.camera.camera import Camera
from friction_estimation.film.frame import Frame


def find_handle(crops: Sequence[Crop], look: Appearance) -> Appearance:
    """Add a handle to the appearance if one is found, and set the heading of every crop.

    The colour of the handle is that of the pixels on the stone's top that differ most from the
    body, or else fitted. Several heights of the handle and sizes of its base are tried.
    """
    unexplained: list[Floats] = []
    for crop in crops:
        cover = coverage(crop, look)
        residual = crop.pixels - composite(cover, crop.background, look.colours)
        x, y = crop.pose[:2]
        z = look.model.height + look.model.handle_rise
        above = crop.window.ray_xy + z * crop.window.ray_slope - np.array([x, y])
        near = np.hypot(*above.T) < 0.8 * look.model.radius
        unexplained.append(np.column_stack([crop.pixels, _contrast(residual)])[near])
    pixels = np.concatenate(unexplained)
    if len(pixels) < 20:
        return look
    limit = max(MIN_HANDLE_CONTRAST, float(np.quantile(pixels[:, 3], 0.97)))
    marked = pixels[pixels[:, 3] >= limit]
    if len(marked) < 0.02 * len(pixels):
        return look
    colour = np.median(marked[:, :3], axis=0)
    colours = look.colours.copy()
    colours[-1] = colour
    for crop in crops:
        fit_pose(crop, look)
    before = total_misfit(crops, look)
    poses = _poses(crops)
    # Of a small stone no pixel may show the handle alone; its colour is then fitted.
    for solved in (False, True):
        found, misfit = _best_handle(crops, look, colours, solved=solved)
        top, handle = found.colours[[TOP, HANDLE]]
        if misfit < before and _contrast(handle - top) >= MIN_HANDLE_CONTRAST:
            return found
        _place(crops, poses)
    return look


def _contrast(difference: Floats) -> Floats:
    """Return the contrast of two colours, by their channels (..., 3) [grey levels].

    Colour counts more than brightness, because light and shade change only brightness.
    """
    return np.linalg.norm(difference * [1.0, 2.0, 2.0], axis=-1)


def _best_handle(
    crops: Sequence[Crop], look: Appearance, colours: Floats, *, solved: bool
) -> tuple[Appearance, float]:
    """Find the handle with the smallest unexplained share of the crops; set their poses.

    Parameters
    ----------
    colours : of all parts, the handle's to begin with
    solved : whether they are found again for each handle that is tried
    """
    poses = _poses(crops)
    best, best_misfit, best_poses = look, np.inf, poses
    for rise in HANDLE_RISES:
        turned = poses
        for collar in HANDLE_COLLARS:
            _place(crops, turned)
            model = replace(
                look.model, handle_rise=rise, collar_radius=collar, neck_length=collar / 2
            )
            found = replace(look, model=model, colours=colours, has_handle=True)
            if turned is poses:  # The base hardly changes the headings.
                fit_headings(crops, found)
                turned = _poses(crops)
            for crop in crops:
                fit_pose(crop, found)
            if solved:
                found = replace(found, colours=colours_of(crops, found))
            misfit = total_misfit(crops, found)
            if misfit < best_misfit:
                best, best_misfit = found, misfit
                best_poses = _poses(crops)
    _place(crops, best_poses)
    return best, best_misfit


def _poses(crops: Sequence[Crop]) -> list[tuple[Floats, float | None]]:
    return [(crop.pose, crop.expected) for crop in crops]


def _place(crops: Sequence[Crop], poses: Sequence[tuple[Floats, float | None]]) -> None:
    """Restore the poses of crops, in place."""
    for crop, placed in zip(crops, poses, strict=True):
        crop.pose, crop.expected = placed


def fit_headings(crops: Sequence[Crop], look: Appearance) -> None:
    """Set the headings of all crops to the most likely ones of a stone that turns steadily.

    In a single frame the handle may be reversed. Dynamic programming over heading and spin avoids
    this, because the spin changes slowly from frame to frame.
    """
    headings = np.linspace(-np.pi, np.pi, HEADINGS_TRIED, endpoint=False)
    step = 2 * np.pi / HEADINGS_TRIED
    ordered = sorted(crops, key=lambda crop: crop.t)
    change_costs = np.abs(SPINS_TRIED[:, None] - SPINS_TRIED[None, :]) / SPIN_CHANGE
    value = np.zeros((HEADINGS_TRIED, len(SPINS_TRIED)))
    came_from: list[NDArray[np.intp]] = []
    for k, crop in enumerate(ordered):
        if k > 0:
            turned = SPINS_TRIED * (crop.t - ordered[k - 1].t) / step
            source = np.arange(HEADINGS_TRIED)[:, None] - turned[None, :]
            low = np.floor(source).astype(int)
            share = source - low
            columns = np.arange(len(SPINS_TRIED))[None, :]
            carried = (1 - share) * value[low % HEADINGS_TRIED, columns]
            carried += share * value[(low + 1) % HEADINGS_TRIED, columns]
            # The axes are heading, previous spin and spin.
            options = carried[:, :, None] + change_costs[None]
            came_from.append(np.argmin(options, axis=1))
            value = np.min(options, axis=1)
        costs = heading_costs(crop, look, HEADINGS_TRIED)
        value = value + (costs - costs.min())[:, None]
    at, spin = np.unravel_index(int(np.argmin(value)), value.shape)
    heading = float(headings[at])
    for k in range(len(ordered) - 1, -1, -1):
        ordered[k].pose = np.array([*ordered[k].pose[:2], heading])
        ordered[k].expected = heading
        if k > 0:
            near = round((heading + np.pi) / step) % HEADINGS_TRIED
            spin = came_from[k - 1][near, spin]
            heading -= float(SPINS_TRIED[spin]) * (ordered[k].t - ordered[k - 1].t)


def heading_crop(
    frame: Frame,
    xy: Floats,
    background: Channels,
    background_origin: tuple[int, int],
    camera: Camera,
    look: Appearance,
    others: Sequence[PosedStone] = (),
) -> Crop | None:
    """Crop of a stone in one frame, for its heading.

    Parameters
    ----------
    frame : the picture
    xy : (2,) place of the stone [m]
    background : the picture without the stone
    background_origin : column and row of the background's upper left pixel in the image
    camera : the film's camera
    look : the stone's appearance
    others : the stones around it, where they are in this frame

    Returns
    -------
    None if the stone is not entirely in the image, or nearer ones hide it
    """
    found = crops_at([frame], [0.0], [xy], background, background_origin, camera, look.model)
    if not found:
        return None
    hidden = add_neighbours(found[0], others, camera)
    if hidden.any():
        body = replace(look, has_handle=False)
        cover = coverage(found[0], body)
        share = cover[0, :, : len(PARTS)].sum(axis=1)
        if share[hidden].sum() > MAX_HIDDEN_HEADING * share.sum():
            return None
        shown = composite(cover, found[0].background, look.colours)
        found[0].pixels = np.where(hidden[:, None], shown, found[0].pixels)
    return found[0]


def heading_costs(crop: Crop, look: Appearance, count: int = HEADINGS_COMPARED) -> Floats:
    """Misfit of a stone at evenly spaced headings, beginning at -π, (count,) [squared standard
    errors]; the body is painted only once.

    Parameters
    ----------
    crop : its picture, see `heading_crop`
    """
    planes = painted_planes(crop, look)
    costs = np.empty(count)
    for k, heading in enumerate(np.linspace(-np.pi, np.pi, count, endpoint=False)):
        pose = np.array([*crop.pose[:2], heading])
        repaint_handle(planes, crop.window, look.model.values, pose)
        costs[k] = misfit_of(crop, look, planes)
    return costs / PIXEL_CORRELATION
