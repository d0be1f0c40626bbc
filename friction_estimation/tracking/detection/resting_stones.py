"""The other stones on the sheet while one is thrown: what they look like, where and when they lie.

What lies still is part of a film's background, where nothing that moves gives it away. Spots as
large as stones are fitted with the look learnt from the thrown stone, over ice filled in from
around them.
"""

# OpenCV's stubs widen the element type of every array that they return.
# pyright: reportArgumentType=false, reportCallIssue=false, reportReturnType=false
# pyright: reportAssignmentType=false

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from curling_env.sheet import Sheet
from curling_env.typing import Flags, Floats, Image
from friction_estimation.appearance import (
    Appearance,
    PosedStone,
    StoneModel,
    channels_of,
    crops_at,
    measure,
)
from friction_estimation.appearance.crops import (
    Crop,
    composite,
    coverage,
    misfit_of,
    painted_planes,
    robust_weights,
)
from friction_estimation.appearance.fit import PIXEL_CORRELATION
from friction_estimation.appearance.learning import colours_of
from friction_estimation.camera.camera import Camera
from friction_estimation.tracking.detection.acquisition import RoughPath
from friction_estimation.tracking.detection.background import Background, median_picture
from friction_estimation.tracking.detection.blobs import BY_PLACE, spots_like_stones

LEAST_VISIBLE = 0.6
"""Share of a spot that must look like a stone."""
EXPLAINED = 0.5
"""A stone must leave at most this share of the misfit that bare ice leaves."""
HEADINGS_TRIED = 24
STILL = 0.04
"""A stone is where it lay if it is found within this, and a pixel's play [m]."""
PICTURES = 3
"""Frames at each end of the film whose median shows what lay there."""
LEAST_PRESENCE = 0.6
"""Share of the frames in which a stone that lies must be made out; people stand before it."""
CLEAR_FRONT = 12.0
"""By how much the other end of a handle must fit worse, in squared standard errors."""
HALO = 0.10
"""How far beyond its edge a stone darkens the ice [m]."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Bystander:
    """A stone that lay on the sheet when the film began, or when it ended.

    Parameters
    ----------
    posed : its look and place
    sigma : standard error of each coordinate, by noise alone [m]
    heading : of its handle [rad]; NaN where its front cannot be told
    seen : (n,) in which of the sparse frames it lay there
    """

    posed: PosedStone
    sigma: float
    heading: float
    seen: Flags

    @property
    def xy(self) -> Floats:
        """Its place, (2,) [m]."""
        return self.posed.pose[:2]

    @property
    def last_seen(self) -> int:
        """The last sparse frame in which it lay there."""
        return int(np.flatnonzero(self.seen)[-1])

    @property
    def stays(self) -> bool:
        """Whether it lay there from the beginning to the end."""
        return bool(self.seen[:PICTURES].any() and self.seen[-PICTURES:].any())

    @property
    def leaves(self) -> bool:
        """Whether it lay there at first and not at the end."""
        return bool(self.seen[:PICTURES].any() and not self.seen[-PICTURES:].any())


def bystanders(
    sample: Sequence[tuple[float, Image]],
    background: Background,
    camera: Camera,
    look: Appearance,
    sheet: Sheet,
    rough: RoughPath,
) -> list[Bystander]:
    """The stones that lie on the sheet at the film's beginning or end.

    Parameters
    ----------
    sample : sparse frames and their times
    look : of the thrown stone; others have its shape, and a handle's colour of their own
    rough : the thrown stone's path; what lies only at its end is that stone

    Returns
    -------
    empty where nothing lies on the sheet but the thrown stone at its end
    """
    frames = [frame for _, frame in sample]
    cuts = [
        [f[background.slices] for f in part] for part in (frames[:PICTURES], frames[-PICTURES:])
    ]
    pictures = [median_picture(np.stack(part)) for part in cuts]
    pictures.insert(1, np.clip(np.rint(background.image), 0, 255).astype(np.uint8))
    spots = [
        spots_like_stones(picture, background, camera, look.model, sheet) for picture in pictures
    ]
    empty = background.image.copy()
    places: list[Floats] = []
    for picture, found in zip(pictures, spots, strict=True):
        new = [xy for xy in found if all(np.linalg.norm(xy - k) > BY_PLACE for k in places)]
        _fill_in(empty, picture, background.origin_px, camera, look.model, new)
        fitted = (_fitted_place(xy, picture, empty, background, camera, look) for xy in new)
        places += [xy for xy in fitted if xy is not None]
    end = rough.sightings[-1].xy
    if all(np.linalg.norm(xy - end) < 2 * BY_PLACE for xy in places):
        return []
    ice = channels_of(empty)
    known: list[Bystander] = []
    for xy in places:
        one = _bystander(xy, frames, ice, background, camera, look)
        if one is not None and all(np.linalg.norm(one.xy - k.xy) > BY_PLACE for k in known):
            known.append(one)
    return known


def footprint(
    shape: tuple[int, ...],
    origin: tuple[int, int],
    camera: Camera,
    model: StoneModel,
    xy: Floats,
) -> NDArray[np.uint8]:
    """Mask of the pixels that a stone, its handle, shadow or mirror image changes.

    Parameters
    ----------
    shape : rows and columns of the mask, which begins at pixel `origin`
    """
    around = np.linspace(0, 2 * np.pi, 36, endpoint=False)
    circle = np.column_stack([np.cos(around), np.sin(around)])
    rings = [
        np.column_stack([xy + radius * circle, np.full(36, z)])
        for z, radius in (
            (-0.7 * model.height, model.radius),
            (0.0, model.radius + HALO),
            (model.height + model.handle_rise + 0.02, model.radius),
        )
    ]
    px = camera.project(np.concatenate(rings)) - np.array(origin)
    mask = np.zeros(shape[:2], dtype=np.uint8)
    if np.isfinite(px).all():
        hull = cv2.convexHull(px.astype(np.float32))
        cv2.fillConvexPoly(mask, np.round(hull).astype(np.int32), 1)
        cv2.dilate(mask, np.ones((3, 3), np.uint8), dst=mask)
    return mask


def _fill_in(
    empty: NDArray[np.float32],
    picture: Image,
    origin: tuple[int, int],
    camera: Camera,
    model: StoneModel,
    places: Sequence[Floats],
) -> None:
    """Put a picture's ice, without the stones at places, into `empty` around them."""
    if not places:
        return
    masks = [footprint(empty.shape, origin, camera, model, xy) for xy in places]
    all_of_them = np.maximum.reduce(masks)
    for mask in masks:
        rows, columns = np.nonzero(mask)
        if len(rows) == 0:
            continue
        part = (
            slice(max(int(rows.min()) - 12, 0), int(rows.max()) + 13),
            slice(max(int(columns.min()) - 12, 0), int(columns.max()) + 13),
        )
        empty[part] = cv2.inpaint(
            np.ascontiguousarray(picture[part]),
            np.ascontiguousarray(all_of_them[part]),
            3.0,
            cv2.INPAINT_TELEA,
        )


def _fitted_place(
    xy: Floats,
    picture: Image,
    empty: NDArray[np.float32],
    background: Background,
    camera: Camera,
    look: Appearance,
) -> Floats | None:
    """Where a stone's body explains a spot in a picture; None where none does."""
    outline = look.model.outline_px(camera, xy) - np.array(background.origin_px)
    size = np.ptp(outline, axis=0).max() + 12
    low = np.maximum(np.floor(outline.min(axis=0) - size).astype(int), 0)
    high = np.ceil(outline.max(axis=0) + size).astype(int)
    part = (slice(low[1], high[1]), slice(low[0], high[0]))
    origin = (background.origin_px[0] + int(low[0]), background.origin_px[1] + int(low[1]))
    frame = np.zeros((camera.size[1], camera.size[0], 3), dtype=np.uint8)
    frame[background.slices] = picture
    body = replace(look, has_handle=False)
    fit = measure(frame, channels_of(empty[part]), origin, camera, body, np.array([*xy, 0.0]))
    if fit is None or fit.visible < LEAST_VISIBLE:
        return None
    return fit.xy if np.linalg.norm(fit.xy - xy) < 2 * BY_PLACE else None


def _bystander(
    xy: Floats,
    frames: Sequence[Image],
    ice: Floats,
    background: Background,
    camera: Camera,
    look: Appearance,
) -> Bystander | None:
    """The stone at a place, its own look, and when it lay there; None if there is none."""
    origin = background.origin_px
    body = replace(look, has_handle=False)
    start = np.array([*xy, 0.0])
    play = STILL + 1.0 / np.linalg.norm(camera.px_per_metre(xy), -2)
    found: list[tuple[int, Floats]] = []
    for i, frame in enumerate(frames):
        fit = measure(frame, ice, origin, camera, body, start)
        if (
            fit is not None
            and fit.visible >= LEAST_VISIBLE
            and fit.inside > 0.98
            and np.linalg.norm(fit.xy - xy) < play
        ):
            found.append((i, fit.xy))
    if not found:
        return None
    lying = [i for i, _ in found]
    start = np.array([*np.median([place for _, place in found], axis=0), 0.0])
    if len(lying) < PICTURES:
        return None
    span = lying[-1] - lying[0] + 1
    if len(lying) < LEAST_PRESENCE * span:
        return None
    chosen = lying[:: max(1, len(lying) // 9)]
    still = np.median([frames[i][background.slices] for i in chosen], axis=0)
    whole = np.zeros((camera.size[1], camera.size[0], 3), dtype=np.uint8)
    whole[background.slices] = np.clip(np.rint(still), 0, 255)
    crops = crops_at([whole], [0.0], [start[:2]], ice, origin, camera, look.model)
    if not crops:
        return None
    crop = crops[0]
    crop.pose = start
    own = _own_look(crop, look)
    fit = measure(whole, ice, origin, camera, own, crop.pose)
    if fit is None or fit.visible < LEAST_VISIBLE:
        return None
    pose = np.array([*fit.xy, fit.theta if own.has_handle else 0.0])
    if _cost_at(crop, own, pose) > EXPLAINED * _cost_of_bare_ice(crop, own):
        return None
    seen = np.zeros(len(frames), dtype=bool)
    seen[lying] = True
    return Bystander(
        posed=PosedStone(look=own, pose=pose),
        sigma=float(np.sqrt(np.trace(fit.covariance[:2, :2]) / 2)),
        heading=_heading_told(crop, own, pose),
        seen=seen,
    )


def _heading_told(crop: Crop, look: Appearance, pose: Floats) -> float:
    """The heading if the handle's other end is clearly not the front, else NaN."""
    turned = pose + np.array([0.0, 0.0, np.pi])
    against = _cost_at(crop, look, turned) - _cost_at(crop, look, pose)
    told = look.has_handle and against / PIXEL_CORRELATION > CLEAR_FRONT
    return float(pose[2]) if told else np.nan


def _cost_at(crop: Crop, look: Appearance, pose: Floats) -> float:
    """Robust misfit with the stone at a pose."""
    placed = replace(crop, pose=pose)
    return misfit_of(placed, look, painted_planes(placed, look))


def _cost_of_bare_ice(crop: Crop, look: Appearance) -> float:
    far = np.array([crop.pose[0] + 100.0, crop.pose[1], 0.0])
    return _cost_at(crop, look, far)


def _own_look(crop: Crop, look: Appearance) -> Appearance:
    """The look of a stone of the same shape, with its own colours; turns `crop` to it."""
    if not look.has_handle:
        own = replace(look, colours=colours_of([crop], look))
        return own
    best, least = look, np.inf
    pose = crop.pose
    for heading in np.linspace(-np.pi, np.pi, HEADINGS_TRIED, endpoint=False):
        trial = np.array([*crop.pose[:2], heading])
        cover = coverage(replace(crop, pose=trial), look)
        colours = look.colours.copy()
        for _ in range(2):
            residual = crop.pixels - composite(cover, crop.background, colours)
            weight = robust_weights(residual, look.noise)
            for channel, blur in enumerate((0, 1, 1)):
                share = cover[blur, :, 4]
                total = float(np.sum(weight * share**2))
                if total > 0.1:
                    colours[4, channel] += float(
                        np.sum(weight * share * residual[:, channel]) / total
                    )
        own = replace(look, colours=colours)
        cost = _cost_at(crop, own, trial)
        if cost < least:
            best, least, pose = own, cost, trial
    crop.pose = pose
    return replace(best, colours=colours_of([crop], best))
