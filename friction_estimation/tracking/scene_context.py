"""Surroundings of a throw: stones on the sheet, and the ice without those that leave."""

# OpenCV's stubs widen the element type of every array that they return.
# pyright: reportArgumentType=false, reportCallIssue=false, reportReturnType=false
# pyright: reportAssignmentType=false

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np

from curling_env.sheet import Sheet
from curling_env.typing import Floats, Image
from friction_estimation.appearance import Appearance, StoneModel
from friction_estimation.camera.camera import Camera
from friction_estimation.film.frame import Frame
from friction_estimation.tracking import tuning
from friction_estimation.tracking.background import Background, moving_blobs
from friction_estimation.tracking.detection.ice_beneath import (
    fill_from_mirrors,
    footprint,
    mirrors,
)
from friction_estimation.tracking.detection.resting_stones import (
    FilmedRestingStone,
    find_resting_stones,
)
from friction_estimation.tracking.detection.thrown_stone import (
    RoughPath,
    Sighting,
    likeliest_path,
    sightings_in,
)


@dataclass(frozen=True, kw_only=True, eq=False)
class SceneContext:
    """Surroundings of a throw on the sheet.

    Parameters
    ----------
    resting : the other stones
    path : the thrown stone's path until the first of them leaves
    pictures : times [s] and frames in which that path was found
    background : the ice without the stones that leave
    """

    resting: tuple[FilmedRestingStone, ...]
    path: RoughPath
    pictures: Sequence[tuple[float, Frame]]
    background: Background


def find_scene_context(
    sample: Sequence[tuple[float, Image]],
    background: Background,
    camera: Camera,
    appearance: Appearance,
    sheet: Sheet,
    path: RoughPath,
    pictures: Sequence[tuple[float, Frame]],
    sample_until: Callable[[float], Sequence[tuple[float, Image]]],
) -> SceneContext | None:
    """Find the other stones on the sheet, and separate the thrown stone's path from theirs.

    Parameters
    ----------
    sample : sampled frames and their times [s]
    appearance, path, pictures : of the thrown stone; its path may have gone over to another
    sample_until : the same number of frames as `sample`, from the film's beginning to a time [s]

    Returns
    -------
    None where the thrown stone is alone
    """
    resting = find_resting_stones(sample, background, camera, appearance, sheet, path)
    if not any(stone.stays or stone.leaves for stone in resting):
        return None
    unchanged = SceneContext(
        resting=tuple(resting), path=path, pictures=sample, background=background
    )
    if not any(stone.leaves for stone in resting):
        return unchanged
    ice = _ice_without(resting, sample, background, camera, appearance.model, sheet)
    places = np.array([stone.xy for stone in resting if stone.leaves])
    leaving = sorted((s for s in resting if s.leaves), key=lambda stone: stone.last_seen)
    while leaving:
        until = sample[leaving[0].last_seen][0]
        if path.measured and _is_far(path.at(until), leaving[0]):
            # Nothing was there to hit it: it is a person who went away.
            resting = [stone for stone in resting if stone is not leaving[0]]
            leaving = leaving[1:]
            continue
        own = path.until(until)
        if own is not None:
            return SceneContext(resting=tuple(resting), path=own, pictures=pictures, background=ice)
        # A stone thrown hard is in few of the sampled frames, and behind sweepers in most of them.
        before = sample_until(until)
        seen = [
            sighting
            for i, (t, frame) in enumerate(before)
            for sighting in sightings_in(
                moving_blobs(frame, ice), i, t, camera, appearance.model, sheet
            )
            if np.linalg.norm(places - sighting.xy, axis=1).min() > 2 * appearance.model.radius
        ]
        new_path = likeliest_path(_that_move(seen, len(before)))
        if new_path is not None:
            return SceneContext(
                resting=tuple(resting), path=new_path, pictures=before, background=ice
            )
        # Nothing came before the stone left: it is the thrown one, held until its release.
        resting = [stone for stone in resting if stone is not leaving[0]]
        leaving = leaving[1:]
    if not any(stone.stays for stone in resting):
        return None
    return replace(unchanged, resting=tuple(resting))


def _is_far(xy: Floats, stone: FilmedRestingStone) -> bool:
    """Return whether a stone at a place (2,) [m] is too far to have set another in motion."""
    return bool(np.linalg.norm(xy - stone.xy) > tuning.MAY_HIT_WITHIN)


def _that_move(sightings: Sequence[Sighting], frames: int) -> list[Sighting]:
    """Those of the sightings in a number of frames that are not always in the same place.

    Where the ice is not quite known beneath what lay there, something seems to lie there still.
    """
    xy = np.array([s.xy for s in sightings]).reshape(-1, 2)
    return [
        s
        for s in sightings
        if (np.linalg.norm(xy - s.xy, axis=1) < tuning.SAME_PLACE).sum() < frames / 2
    ]


def _ice_without(
    resting: Sequence[FilmedRestingStone],
    sample: Sequence[tuple[float, Image]],
    background: Background,
    camera: Camera,
    model: StoneModel,
    sheet: Sheet,
) -> Background:
    """The background with the ice seen before a stone comes or after it leaves, in its place.

    What hits a stone may come to rest where it lay: of later frames only those pixels count that
    look like ice that is painted alike.
    """
    moved = [stone for stone in resting if not stone.stays]
    origin, shape = background.origin_px, background.image.shape
    masks = [footprint(shape, origin, camera, model, stone.xy) > 0 for stone in moved]
    beneath = np.logical_or.reduce(masks)
    lying = [footprint(shape, origin, camera, model, stone.xy) for stone in resting]
    image = background.image.copy()
    like, guessed = fill_from_mirrors(
        np.clip(np.rint(image), 0, 255).astype(np.uint8),
        beneath.view(np.uint8),
        np.maximum.reduce(lying),
        mirrors(shape, origin, camera, sheet),
    )
    image[beneath] = like[beneath]
    limit = 2 * max(tuning.MIN_CONTRAST, 5 * background.noise)
    around = np.ones((5, 5), np.uint8)
    for mask in masks:
        rows, columns = np.nonzero(mask)
        if len(rows) == 0:
            continue
        part = (
            slice(int(rows.min()), int(rows.max()) + 1),
            slice(int(columns.min()), int(columns.max()) + 1),
        )
        cuts = np.stack([frame[background.slices][part] for _, frame in sample]).astype(np.float32)
        covered = np.zeros(cuts.shape[:3], dtype=bool)
        for stone, other in zip(moved, masks, strict=True):
            here = np.flatnonzero(stone.seen)
            # In the frame after the last that shows a stone at rest, it is half gone.
            from_, to = (0, here[-1] + 2) if stone.leaves else (here[0] - 1, len(sample))
            covered[max(from_, 0) : to] |= other[part]
        unlike = (np.abs(cuts - like[part]).max(axis=3) > limit) & (guessed[part] == 0)
        for k, one in enumerate(unlike):
            covered[k] |= cv2.dilate(one.view(np.uint8), around) > 0
        cuts[covered] = np.nan
        free = (~covered).sum(axis=0)
        own = mask[part] & (free >= tuning.END_FRAMES)
        with np.errstate(all="ignore"):
            bare = np.nanmedian(np.where(own[None, :, :, None], cuts, 0.0), axis=0)
        image[part][own] = bare[own]
    return replace(background, image=image)
