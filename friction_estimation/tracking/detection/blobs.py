"""Candidates for stones at rest: dark blobs as large as a stone in that place would look."""

# OpenCV's stubs widen the element type of every array that they return.
# pyright: reportArgumentType=false, reportCallIssue=false, reportReturnType=false
# pyright: reportAssignmentType=false

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from curling_env.sheet import Sheet
from curling_env.typing import Floats, Image
from friction_estimation.appearance import StoneModel
from friction_estimation.camera.camera import Camera
from friction_estimation.tracking import tuning
from friction_estimation.tracking.detection.background import Background, Blob, colours
from friction_estimation.tracking.detection.connected import boxes_of_parts
from friction_estimation.tracking.detection.thrown_stone import sighting_of


def find_stone_candidates(
    picture: Image,
    background: Background,
    camera: Camera,
    model: StoneModel,
    sheet: Sheet,
    others: Sequence[Image] = (),
) -> list[Floats]:
    """Places at which a dark blob is about as large as a stone would look there, each (2,) [m].

    Parameters
    ----------
    picture : (rows, columns, 3) the background's part of a frame
    others : the same ice at other times, or ice that is painted alike: a stone is darker than it
    """
    # How large a stone looks, and where, along the centre line and the edges of the sheet.
    x = np.linspace(-sheet.width / 2, sheet.width / 2, 3)
    y = np.linspace(-sheet.length / 2, sheet.length / 2, 90)
    ice = np.array([(a, b, 0.0) for a in x for b in y])
    ice = ice[camera.sees(ice)]
    if len(ice) == 0:
        return []
    px = camera.project(ice) - np.array(background.origin_px)
    extent = np.array([_extent_px(camera, model, place[:2]) for place in ice])
    whole = np.isfinite(extent).all(axis=1)
    px, extent = px[whole], np.maximum(extent[whole], tuning.MIN_CANDIDATE_PX)
    if len(px) == 0:
        return []
    size = extent.max(axis=1)
    factor = tuning.CANDIDATE_SCALE_STEP
    steps = np.round(np.log(size / size.min()) / np.log(factor)).astype(int)
    found: list[tuple[float, Floats]] = []
    for step in np.unique(steps):
        part = px[steps == step]
        width = float(size.min() * factor**step)
        low = np.maximum(np.floor(part.min(axis=0) - 3 * width).astype(int), 0)
        high = np.ceil(part.max(axis=0) + 3 * width).astype(int)
        cut = np.ascontiguousarray(picture[low[1] : high[1], low[0] : high[0]])
        if min(cut.shape[:2]) < 4:
            continue
        flat = float(extent[steps == step].min())
        without = [
            np.ascontiguousarray(other[low[1] : high[1], low[0] : high[0]]) for other in others
        ]
        blobs = _dark_blobs(cut, width, flat, background, low, without)
        # The same blob is often dark in several colours.
        for blob in {(*b.low_px, *b.high_px, b.area_px): b for b in blobs}.values():
            sighting = sighting_of(blob, camera, model, sheet)
            if sighting is not None and sighting.likeness >= tuning.MIN_CANDIDATE_LIKENESS:
                found.append((sighting.likeness, sighting.xy))
    places: list[Floats] = []
    for _, xy in sorted(found, key=lambda item: -item[0]):
        if all(np.linalg.norm(xy - other) > tuning.SAME_PLACE for other in places):
            places.append(xy)
    return places


def _extent_px(camera: Camera, model: StoneModel, xy: Floats) -> Floats:
    """Width and height of a stone's picture, (2,) [px]; NaN where it is not in view."""
    corners = model.extent_px(camera, xy)
    return corners[1] - corners[0] if len(corners) else np.full(2, np.nan)


def _dark_blobs(
    cut: Image,
    width: float,
    flat: float,
    background: Background,
    low: NDArray[np.int_],
    without: Sequence[Image],
) -> list[Blob]:
    """Blobs that are darker, in any colour, than their surroundings of a stone's width or two.

    Parameters
    ----------
    cut : (rows, columns, 3) the part of the background that is searched
    width, flat : larger and smaller side of the box around a stone's picture there [px]
    low : (2,) column and row of `cut` in the background
    without : pictures of like ice; blobs that are darker than one of these count as well
    """
    reach = 2 * round(tuning.CANDIDATE_REACH * width / 2) + 1
    kernel = cv2.getStructuringElement(cv2.MORPH_RECT, (reach, reach))
    depth = cv2.morphologyEx(cut, cv2.MORPH_BLACKHAT, kernel)
    limit = max(2 * tuning.MIN_CONTRAST, 6 * background.noise)
    # Opening removes lines, which are thinner than stones; of a flat stone it may leave nothing.
    thin = max(3, 2 * round(flat / 8) + 1)
    found: list[Blob] = []
    # The edges of paint are not in quite the same place in pictures of like ice.
    edges = np.ones((3, 3), np.uint8)
    depths = [depth, *(cv2.subtract(cv2.erode(other, edges), cut) for other in without)]
    for one in (channel for each in depths for channel in colours(each)):
        # A ring is dark in two colours; in the third one a stone on it stands out.
        for least in (limit, tuning.STRONG_CONTRAST_FACTOR * limit):
            if one.max() <= least:
                break
            mask = (one > least).view(np.uint8)
            opened = np.asarray(
                cv2.morphologyEx(mask, cv2.MORPH_OPEN, np.ones((thin, thin), np.uint8)), np.uint8
            )
            found += _blobs_in(opened, width, background, low)
            if flat < tuning.MIN_OPENED_PX:
                found += _blobs_in(mask, width, background, low)
    return found


def _blobs_in(
    mask: NDArray[np.uint8], width: float, background: Background, low: NDArray[np.int_]
) -> list[Blob]:
    """Connected parts of a mask that are about as large as a stone."""
    origin = np.array(background.origin_px, dtype=np.float64) + low
    blobs: list[Blob] = []
    for left, top, w, h, area in boxes_of_parts(mask).tolist():
        if 0.4 * width < max(w, h) < 2.5 * width:
            corner, size = origin + np.array([left, top]), np.array([w, h], dtype=np.float64)
            blobs.append(
                Blob(
                    low_px=corner,
                    high_px=corner + size - 1,
                    area_px=float(area),
                    whole_px=size,
                )
            )
    return blobs
