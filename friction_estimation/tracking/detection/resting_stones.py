"""The other stones on the sheet: what they look like, and where and when they lie.

A stone at rest is part of a film's background, where nothing that moves gives it away. So dark
blobs as large as stones are fitted with the appearance that was learnt from the thrown stone, over
ice that is filled in from around them.
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
    measure_occluded,
)
from friction_estimation.appearance.crops import (
    Crop,
    composite,
    coverage,
    misfit_of,
    painted_planes,
    robust_weights,
)
from friction_estimation.appearance.learning import colours_of
from friction_estimation.appearance.occlusion import set_among
from friction_estimation.appearance.tuning import PIXEL_CORRELATION
from friction_estimation.camera.camera import Camera
from friction_estimation.tracking import tuning
from friction_estimation.tracking.detection.background import Background, median_picture
from friction_estimation.tracking.detection.blobs import find_stone_candidates
from friction_estimation.tracking.detection.thrown_stone import RoughPath


@dataclass(frozen=True, kw_only=True, eq=False)
class FilmedRestingStone:
    """A stone that lay on the sheet when the film began, or when it ended.

    Parameters
    ----------
    posed : its appearance and pose
    sigma : standard error of each coordinate due to noise alone [m]
    heading : heading of its handle [rad]; NaN where front and rear of the handle look alike
    seen : (n,) whether it lay there in each of the sampled frames
    """

    posed: PosedStone
    sigma: float
    heading: float
    seen: Flags

    @property
    def xy(self) -> Floats:
        """Where it lies, (2,) [m]."""
        return self.posed.pose[:2]

    @property
    def last_seen(self) -> int:
        """Index of the last sampled frame in which it lay there."""
        return int(np.flatnonzero(self.seen)[-1])

    @property
    def stays(self) -> bool:
        """Whether it lay there from the beginning to the end."""
        return self._at_first and self._at_last

    @property
    def leaves(self) -> bool:
        """Whether it lay there at the beginning and not at the end."""
        return self._at_first and not self._at_last

    @property
    def _at_first(self) -> bool:
        return bool(self.seen[: tuning.END_FRAMES].any())

    @property
    def _at_last(self) -> bool:
        return bool(self.seen[-tuning.END_FRAMES :].any())


def find_resting_stones(
    sample: Sequence[tuple[float, Image]],
    background: Background,
    camera: Camera,
    appearance: Appearance,
    sheet: Sheet,
    rough: RoughPath,
) -> list[FilmedRestingStone]:
    """Find the stones that lie on the sheet at the beginning or the end of the film.

    Parameters
    ----------
    sample : sampled frames and their times
    appearance : what the thrown stone looks like; others have the same shape, and may have another
        colour of the handle
    rough : the thrown stone's path; a stone that lies only at its end is the thrown one

    Returns
    -------
    The stones; none where nothing lies on the sheet but the thrown stone at its end.
    """
    frames = [frame for _, frame in sample]
    cuts = [
        [f[background.slices] for f in part]
        for part in (frames[: tuning.END_FRAMES], frames[-tuning.END_FRAMES :])
    ]
    pictures = [median_picture(part) for part in cuts]
    pictures.insert(1, np.clip(np.rint(background.image), 0, 255).astype(np.uint8))
    candidates = [
        find_stone_candidates(picture, background, camera, appearance.model, sheet)
        for picture in pictures
    ]
    empty = background.image.copy()
    places: list[Floats] = []
    for picture, found in zip(pictures, candidates, strict=True):
        new = [
            xy for xy in found if all(np.linalg.norm(xy - k) > tuning.SAME_PLACE for k in places)
        ]
        _fill_in(empty, picture, background.origin_px, camera, appearance.model, new)
        fitted = (_fitted_place(xy, picture, empty, background, camera, appearance) for xy in new)
        places += [xy for xy in fitted if xy is not None]
    end = rough.sightings[-1].xy
    if all(np.linalg.norm(xy - end) < 2 * tuning.SAME_PLACE for xy in places):
        return []
    ice = channels_of(empty)
    lying: list[_Lying] = []
    for xy in places:
        if all(np.linalg.norm(xy - other.xy) > tuning.SAME_PLACE for other in lying):
            one = _lying_at(xy, frames, ice, background, camera, appearance)
            lying += [] if one is None else [one]
    body = replace(appearance, has_handle=False)
    known: list[FilmedRestingStone] = []
    for one in lying:
        beside = [
            PosedStone(look=body, pose=np.array([*other.xy, 0.0]))
            for other in lying
            if other is not one and other.is_beside(one)
        ]
        stone = _resting_stone(one, frames, ice, background, camera, appearance, beside)
        if (
            stone is not None
            and lies_within(sheet, stone.xy, appearance.model.radius)
            and all(np.linalg.norm(stone.xy - k.xy) > tuning.SAME_PLACE for k in known)
        ):
            known.append(stone)
    return known


def lies_within(sheet: Sheet, xy: Floats, radius: float) -> bool:
    """Whether a stone lies between the boards, as near to them as a rough scene may put it.

    A dark corner of the boards may look like one that reaches into them.

    Parameters
    ----------
    xy : (2,) where it is seen to lie [m]
    radius : of the stone [m]
    """
    room = np.array([sheet.width, sheet.length]) / 2 - np.abs(xy)
    return bool((room > radius / 2).all())


@dataclass(frozen=True, kw_only=True, eq=False)
class _Lying:
    """A place where a body like a stone's lies in some frames.

    Parameters
    ----------
    xy : (2,) the place [m]
    frames : indices of the sampled frames
    """

    xy: Floats
    frames: Sequence[int]

    @property
    def chosen(self) -> Sequence[int]:
        """About nine of the frames."""
        return self.frames[:: max(1, len(self.frames) // 9)]

    def is_beside(self, other: _Lying) -> bool:
        """Whether it lies near enough to another to overlap with it in most of its pictures."""
        near = np.linalg.norm(self.xy - other.xy) < tuning.NEIGHBOURS
        return bool(near and np.mean([i in self.frames for i in other.chosen]) > 0.5)


def footprint(
    shape: tuple[int, ...],
    origin: tuple[int, int],
    camera: Camera,
    model: StoneModel,
    xy: Floats,
) -> NDArray[np.uint8]:
    """Mask of the pixels that a stone, its handle, its shadow or its reflection may change.

    Parameters
    ----------
    shape : rows and columns of the mask
    origin : column and row of its upper left pixel in a frame
    """
    around = np.linspace(0, 2 * np.pi, 36, endpoint=False)
    circle = np.column_stack([np.cos(around), np.sin(around)])
    rings = [
        np.column_stack([xy + radius * circle, np.full(36, z)])
        for z, radius in (
            (-0.7 * model.height, model.radius),
            (0.0, model.radius + tuning.SHADOW_WIDTH),
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
    """Copy the ice of a picture into `empty` around places, without the stones there."""
    if not places:
        return
    masks = [footprint(empty.shape, origin, camera, model, xy) for xy in places]
    all_masks = np.maximum.reduce(masks)
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
            np.ascontiguousarray(all_masks[part]),
            3.0,
            cv2.INPAINT_TELEA,
        )


def _fitted_place(
    xy: Floats,
    picture: Image,
    empty: NDArray[np.float32],
    background: Background,
    camera: Camera,
    appearance: Appearance,
) -> Floats | None:
    """Where the body of a stone explains a dark blob in a picture; None where it does not."""
    outline = appearance.model.outline_px(camera, xy) - np.array(background.origin_px)
    size = np.ptp(outline, axis=0).max() + 12
    low = np.maximum(np.floor(outline.min(axis=0) - size).astype(int), 0)
    high = np.ceil(outline.max(axis=0) + size).astype(int)
    part = (slice(low[1], high[1]), slice(low[0], high[0]))
    origin = (background.origin_px[0] + int(low[0]), background.origin_px[1] + int(low[1]))
    frame = np.zeros((camera.size[1], camera.size[0], 3), dtype=np.uint8)
    frame[background.slices] = picture
    body = replace(appearance, has_handle=False)
    fit = measure(frame, channels_of(empty[part]), origin, camera, body, np.array([*xy, 0.0]))
    if fit is None or fit.visible < tuning.MIN_RESTING_VISIBLE:
        return None
    return fit.xy if np.linalg.norm(fit.xy - xy) < 2 * tuning.SAME_PLACE else None


def _lying_at(
    xy: Floats,
    frames: Sequence[Image],
    ice: Floats,
    background: Background,
    camera: Camera,
    appearance: Appearance,
) -> _Lying | None:
    """In which frames the body of a stone lies at a place; None if it is hardly seen there."""
    body = replace(appearance, has_handle=False)
    start = np.array([*xy, 0.0])
    tolerance = tuning.REST_TOLERANCE + 1.0 / np.linalg.norm(camera.px_per_metre(xy), -2)
    found: list[tuple[int, Floats]] = []
    for i, frame in enumerate(frames):
        fit = measure(frame, ice, background.origin_px, camera, body, start)
        if (
            fit is not None
            and fit.visible >= tuning.MIN_RESTING_VISIBLE
            and fit.inside > 0.98
            and np.linalg.norm(fit.xy - xy) < tolerance
        ):
            found.append((i, fit.xy))
    if not found:
        return None
    lying = [i for i, _ in found]
    span = lying[-1] - lying[0] + 1
    if len(lying) < max(tuning.END_FRAMES, tuning.MIN_PRESENCE * span):
        return None
    return _Lying(xy=np.median([place for _, place in found], axis=0), frames=lying)


def _resting_stone(
    lying: _Lying,
    frames: Sequence[Image],
    ice: Floats,
    background: Background,
    camera: Camera,
    appearance: Appearance,
    beside: Sequence[PosedStone],
) -> FilmedRestingStone | None:
    """The stone at a place, with its own appearance; None if there is none.

    Parameters
    ----------
    beside : stones around it, as far as they are known
    """
    origin = background.origin_px
    start = np.array([*lying.xy, 0.0])
    still = np.median([frames[i][background.slices] for i in lying.chosen], axis=0)
    whole = np.zeros((camera.size[1], camera.size[0], 3), dtype=np.uint8)
    whole[background.slices] = np.clip(np.rint(still), 0, 255)
    crops = crops_at([whole], [0.0], [start[:2]], ice, origin, camera, appearance.model)
    if not crops:
        return None
    crop = crops[0]
    crop.pose = start
    hidden = set_among(crop, beside, camera)
    own = _own_appearance(crop, appearance)
    fit = measure_occluded(whole, ice, origin, camera, own, crop.pose, beside)
    if fit is None or fit.visible < tuning.MIN_RESTING_VISIBLE:
        return None
    pose = np.array([*fit.xy, fit.theta if own.has_handle else 0.0])
    bare = _cost_of_bare_ice(crop, own, hidden)
    if _cost_at(crop, own, pose, hidden) > tuning.MAX_RESTING_MISFIT * bare:
        return None
    seen = np.zeros(len(frames), dtype=bool)
    seen[list(lying.frames)] = True
    return FilmedRestingStone(
        posed=PosedStone(look=own, pose=pose),
        sigma=float(np.sqrt(np.trace(fit.covariance[:2, :2]) / 2)),
        heading=_heading_if_clear(crop, own, pose, hidden),
        seen=seen,
    )


def _heading_if_clear(crop: Crop, appearance: Appearance, pose: Floats, hidden: Flags) -> float:
    """The heading if the rear of the handle is clearly not its front, else NaN."""
    turned = pose + np.array([0.0, 0.0, np.pi])
    against = _cost_at(crop, appearance, turned, hidden)
    against -= _cost_at(crop, appearance, pose, hidden)
    clear = appearance.has_handle and against / PIXEL_CORRELATION > tuning.CLEAR_FRONT
    return float(pose[2]) if clear else np.nan


def _cost_at(
    crop: Crop, appearance: Appearance, pose: Floats, hidden: Flags | None = None
) -> float:
    """Robust misfit with a stone at a pose; hidden pixels (n,) count for nothing."""
    placed = replace(crop, pose=pose)
    if hidden is not None and hidden.any():
        shown = composite(coverage(placed, appearance), crop.background, appearance.colours)
        placed.pixels = np.where(hidden[:, None], shown, crop.pixels)
    return misfit_of(placed, appearance, painted_planes(placed, appearance))


def _cost_of_bare_ice(crop: Crop, appearance: Appearance, hidden: Flags) -> float:
    far = np.array([crop.pose[0] + 100.0, crop.pose[1], 0.0])
    return _cost_at(crop, appearance, far, hidden)


def _own_appearance(crop: Crop, appearance: Appearance) -> Appearance:
    """The appearance of a stone of the same shape with its own colours; sets the crop's heading."""
    if not appearance.has_handle:
        return replace(appearance, colours=colours_of([crop], appearance))
    best, least = appearance, np.inf
    pose = crop.pose
    for heading in np.linspace(-np.pi, np.pi, tuning.HEADINGS_TRIED, endpoint=False):
        trial = np.array([*crop.pose[:2], heading])
        cover = coverage(replace(crop, pose=trial), appearance)
        colours = appearance.colours.copy()
        for _ in range(2):
            residual = crop.pixels - composite(cover, crop.background, colours)
            weight = robust_weights(residual, appearance.noise)
            for channel, blur in enumerate((0, 1, 1)):
                share = cover[blur, :, 4]
                total = float(np.sum(weight * share**2))
                if total > 0.1:
                    colours[4, channel] += float(
                        np.sum(weight * share * residual[:, channel]) / total
                    )
        own = replace(appearance, colours=colours)
        cost = _cost_at(crop, own, trial)
        if cost < least:
            best, least, pose = own, cost, trial
    crop.pose = pose
    return replace(best, colours=colours_of([crop], best))
