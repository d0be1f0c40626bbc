"""The other stones on the sheet: positions, appearances, and the ice beneath them."""

# OpenCV's stubs widen the element type of every array that they return.
# pyright: reportArgumentType=false, reportCallIssue=false

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np

from curling_env.sheet import TEE_Y
from curling_env.typing import Flags, Floats, Image
from friction_estimation.appearance import (
    Appearance,
    PosedStone,
    StoneFit,
    StoneModel,
    crops_at,
    measure_occluded,
)
from friction_estimation.camera.camera import Camera
from friction_estimation.tracking import tuning
from friction_estimation.tracking.association.coarse import CoarsePath
from friction_estimation.tracking.detection.background import Background
from friction_estimation.tracking.measuring.own_look import own_look

_SHADOW = 0.12
"""Width of the ring around a stone that its shadow may darken [m]."""
_PICTURES = 9
"""Number of frames for the picture of a resting stone."""
_HOUSE = 2.0
"""Radius around a tee within which its paint is round [m]."""
_TURNS, _MOVES = 24, (-1.2, -0.9, -0.6, 0.6, 0.9, 1.2)
"""Rotations about the tee [turns], and shifts along the sheet [m], to ice with the same paint."""


@dataclass(frozen=True, kw_only=True, eq=False)
class RestingStone:
    """Stone at rest at the beginning of the film.

    Parameters
    ----------
    xy : (2,) about where [m]
    until : when it is seen there last [s]
    path : its path once it was hit; None where it stays
    """

    xy: Floats
    until: float
    path: CoarsePath | None = None


@dataclass(frozen=True, kw_only=True, eq=False)
class OtherStone:
    """Measured resting stone.

    Parameters
    ----------
    rests : where and how long
    look : its look
    fit : its measurement
    heading : of its handle [rad]; NaN where front and rear look alike
    """

    rests: RestingStone
    look: Appearance
    fit: StoneFit
    heading: float

    @property
    def pose(self) -> Floats:
        """Place [m] and heading [rad], (3,)."""
        return np.array([*self.fit.xy, 0.0 if np.isnan(self.fit.theta) else self.fit.theta])


def bare_ice(
    sample: Sequence[tuple[float, Image]],
    background: Background,
    camera: Camera,
    model: StoneModel,
    stones: Sequence[RestingStone],
    paths: Sequence[CoarsePath],
) -> Background:
    """Return the background without some stones that rest on it.

    If a stone leaves, its ice is the median of the frames after that; otherwise it is filled in
    from its surroundings.

    Parameters
    ----------
    sample : times [s] and frames
    stones : those that are removed
    paths : where stones are that move
    """
    image = np.asarray(background.image, dtype=np.float32).copy()
    origin = background.origin_px

    def footprint(xy: Floats) -> Flags:
        return _footprint(camera, model, xy, image.shape[:2], origin)

    covers = [footprint(stone.xy) for stone in stones]
    covered = np.any(covers, axis=0) if covers else np.zeros(image.shape[:2], dtype=bool)
    later = [(t, frame, [footprint(path.at(t)[0]) for path in paths]) for t, frame in sample]
    for stone, own in zip(stones, covers, strict=True):
        rows, columns = np.nonzero(own)
        if not len(rows):
            continue
        seen = np.full((len(later), len(rows), 3), np.nan, dtype=np.float32)
        for k, (t, frame, there) in enumerate(later):
            if stone.path is None or t <= stone.until:
                continue
            free = ~np.any([one[rows, columns] for one in there], axis=0)
            shown = frame[rows + origin[1], columns + origin[0]]
            seen[k, free] = shown[free]
        often = np.isfinite(seen[..., 0]).any(axis=0)
        values = np.zeros((len(rows), 3), dtype=np.float32)
        if often.any():
            values[often] = np.nanmedian(seen[:, often], axis=0)
        if not often.all():
            px = np.column_stack([columns, rows])[~often] + np.array(origin)
            values[~often] = _like_ice(px, camera, image, origin, covered)
        image[rows, columns] = values
    return replace(background, image=image)


def _like_ice(
    px: Floats, camera: Camera, image: Floats, origin: tuple[int, int], covered: Flags
) -> Floats:
    """Return the colour (n, 3) of ice with the same paint as at pixels (n, 2).

    A house is rotationally symmetric about its tee, and elsewhere the ice is uniform along the
    sheet.
    """
    xy = camera.on_plane(px, 0.0)
    tee = np.array([0.0, np.copysign(TEE_Y, xy[:, 1].mean())])
    from_tee = xy - tee
    turned = []
    for angle in np.linspace(0.0, 2 * np.pi, _TURNS, endpoint=False)[1:]:
        c, s = np.cos(angle), np.sin(angle)
        turned.append(tee + from_tee @ np.array([[c, s], [-s, c]]))
    moved = [xy + np.array([0.0, dy]) for dy in _MOVES]
    in_house = np.hypot(*from_tee.T) < _HOUSE
    seen = np.full((max(len(turned), len(moved)), len(px), 3), np.nan)
    for inside, tries in ((in_house, turned), (~in_house, moved)):
        for k, places in enumerate(tries):
            at = camera.project(np.column_stack([places, np.zeros(len(places))])) - origin
            u, v = np.rint(np.nan_to_num(at, nan=-1.0)).astype(int).T
            ok = inside & (u >= 0) & (v >= 0) & (u < image.shape[1]) & (v < image.shape[0])
            ok[ok] = ~covered[v[ok], u[ok]]
            seen[k, ok] = image[v[ok], u[ok]]
    seen[0, ~np.isfinite(seen[..., 0]).any(axis=0)] = np.median(image[::4, ::4], axis=(0, 1))
    return np.nanmedian(seen, axis=0)


def _footprint(
    camera: Camera, model: StoneModel, xy: Floats, shape: tuple[int, int], origin: tuple[int, int]
) -> Flags:
    """Return the pixels (rows, columns) of the background that a stone or its shadow may change."""
    mask = np.zeros(shape, dtype=np.uint8)
    wide = replace(model, radius=model.radius + _SHADOW)
    outline = wide.outline_px(camera, xy)
    if len(outline):
        cv2.fillConvexPoly(mask, np.rint(outline - np.array(origin)).astype(np.int32), 1)
    return mask > 0


def known_others(
    resting: Sequence[RestingStone],
    sample: Sequence[tuple[float, Image]],
    background: Background,
    camera: Camera,
    thrown: Appearance,
    path: CoarsePath,
) -> list[OtherStone]:
    """Return the resting stones that can be measured.

    Parameters
    ----------
    resting : all of them
    sample : times [s] and frames
    background : the ice with those that rest long enough
    thrown : the look of the thrown stone
    path : its path
    """
    if not resting:
        return []
    paths = [path, *(one.path for one in resting if one.path is not None)]
    ice = bare_ice(sample, background, camera, thrown.model, resting, paths)
    body = replace(thrown, has_handle=False)
    others: list[OtherStone] = []
    for stone in resting:
        beside = [
            PosedStone(look=body, pose=np.array([*other.xy, 0.0]))
            for other in resting
            if other is not stone and other.until >= stone.until
        ]
        found = measured_at_rest(stone, sample, ice, camera, thrown, beside)
        if found is not None:
            others.append(found)
    return others


def measured_at_rest(
    stone: RestingStone,
    sample: Sequence[tuple[float, Image]],
    ice: Background,
    camera: Camera,
    thrown: Appearance,
    beside: Sequence[PosedStone],
) -> OtherStone | None:
    """Return appearance and position of a resting stone; None if it cannot be measured.

    Parameters
    ----------
    sample : times [s] and frames
    ice : the ice without resting stones
    thrown : the look of the thrown stone, whose shape others share
    beside : stones around it, as far as they are known
    """
    while_there = [frame for t, frame in sample if t < stone.until]
    chosen = while_there[:: max(1, len(while_there) // _PICTURES)]
    if not chosen:
        return None
    rows, columns = ice.slices
    whole = np.zeros((camera.size[1], camera.size[0], 3), dtype=np.uint8)
    still = np.median([frame[rows, columns] for frame in chosen], axis=0)
    whole[rows, columns] = np.rint(still)
    channels, origin = ice.channels, ice.origin_px
    body = replace(thrown, has_handle=False)
    rough = measure_occluded(whole, channels, origin, camera, body, np.array([*stone.xy, 0.0]))
    if rough is None or np.hypot(*(rough.xy - stone.xy)) > 2 * thrown.model.radius:
        return None
    crops = crops_at([whole], [0.0], [rough.xy], channels, origin, camera, thrown.model)
    if not crops:  # its rim is not completely in the picture, and its colours cannot be estimated
        seen = rough.visible >= tuning.LEAST_VISIBLE
        return OtherStone(rests=stone, look=body, fit=rough, heading=np.nan) if seen else None
    found = own_look(crops[0], thrown)
    start = np.array([*rough.xy, found.heading])
    fit = measure_occluded(whole, channels, origin, camera, found.look, start, beside)
    if fit is None or fit.visible < tuning.LEAST_VISIBLE:
        return None
    heading = fit.theta if found.clear else np.nan
    return OtherStone(rests=stone, look=found.look, fit=fit, heading=float(heading))
