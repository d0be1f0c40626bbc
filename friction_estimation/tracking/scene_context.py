"""What a throw meets: the stones that lie there, the ice without those that leave, and the thrown
stone's path told from theirs.
"""

# OpenCV's stubs widen the element type of every array that they return.
# pyright: reportArgumentType=false, reportCallIssue=false, reportReturnType=false
# pyright: reportAssignmentType=false

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np

from curling_env.sheet import Sheet
from curling_env.typing import Image
from friction_estimation.appearance import Appearance, StoneModel
from friction_estimation.camera.camera import Camera
from friction_estimation.tracking.detection.acquisition import RoughPath, sightings_in, thrown_stone
from friction_estimation.tracking.detection.background import Background, moving_blobs
from friction_estimation.tracking.detection.resting_stones import (
    PICTURES,
    Bystander,
    bystanders,
    footprint,
)


@dataclass(frozen=True, kw_only=True, eq=False)
class Company:
    """What a throw meets on the sheet.

    Parameters
    ----------
    lying : the other stones
    sample : the frames and their times in which `rough` was sighted
    rough : the thrown stone's path until the first of them leaves
    background : the ice without those that leave
    """

    lying: tuple[Bystander, ...]
    sample: Sequence[tuple[float, Image]]
    rough: RoughPath
    background: Background


def gather(
    sample: Sequence[tuple[float, Image]],
    background: Background,
    camera: Camera,
    look: Appearance,
    sheet: Sheet,
    rough: RoughPath,
    sample_until: Callable[[float], Sequence[tuple[float, Image]]],
) -> Company | None:
    """The other stones on the sheet, and the thrown stone's path told from theirs.

    None where the thrown stone is alone. See `bystanders`.

    Parameters
    ----------
    sample_until : as many frames as `sample` has, from the film's beginning to a time [s]
    """
    lying = bystanders(sample, background, camera, look, sheet, rough)
    if not any(stone.stays or stone.leaves for stone in lying):
        return None
    if not any(stone.leaves for stone in lying):
        return Company(lying=tuple(lying), sample=sample, rough=rough, background=background)
    ice = _ice_without(lying, sample, background, camera, look.model)
    places = np.array([stone.xy for stone in lying if stone.leaves])
    leaving = sorted((s for s in lying if s.leaves), key=lambda stone: stone.last_seen)
    while leaving:
        # A stone thrown hard passes in a few sparse frames, most of them behind sweepers.
        before = sample_until(sample[leaving[0].last_seen][0])
        path = thrown_stone(
            [
                sighting
                for i, (t, frame) in enumerate(before)
                for sighting in sightings_in(
                    moving_blobs(frame, ice), i, t, camera, look.model, sheet
                )
                if np.linalg.norm(places - sighting.xy, axis=1).min() > 2 * look.model.radius
            ]
        )
        if path is not None:
            return Company(lying=tuple(lying), sample=before, rough=path, background=ice)
        # Nothing came before it left: it is the thrown stone, held until its release.
        lying = [stone for stone in lying if stone is not leaving[0]]
        leaving = leaving[1:]
    if not any(stone.stays for stone in lying):
        return None
    return Company(lying=tuple(lying), sample=sample, rough=rough, background=background)


def _ice_without(
    lying: Sequence[Bystander],
    sample: Sequence[tuple[float, Image]],
    background: Background,
    camera: Camera,
    model: StoneModel,
) -> Background:
    """The background with the ice that is seen before a stone comes, and after it leaves."""
    moved = [stone for stone in lying if not stone.stays]
    origin = background.origin_px
    masks = [
        footprint(background.image.shape, origin, camera, model, stone.xy) > 0 for stone in moved
    ]
    image = background.image.copy()
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
            # A stone is half gone in the frame after the last that shows it at rest.
            from_, to = (0, here[-1] + 2) if stone.leaves else (here[0] - 1, len(sample))
            covered[max(from_, 0) : to] |= other[part]
        cuts[covered] = np.nan
        free = (~covered).sum(axis=0)
        own = mask[part] & (free >= PICTURES)
        with np.errstate(all="ignore"):
            bare = np.nanmedian(np.where(own[None, :, :, None], cuts, 0.0), axis=0)
        image[part][own] = bare[own]
        never = mask[part] & ~own
        if never.any():
            filled = cv2.inpaint(
                np.clip(np.rint(image[part]), 0, 255).astype(np.uint8),
                never.astype(np.uint8),
                3.0,
                cv2.INPAINT_TELEA,
            )
            image[part][never] = filled[never]
    return replace(background, image=image)
