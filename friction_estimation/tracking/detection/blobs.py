"""Where on the ice a stone may lie: dark spots that are as large as a stone would be there."""

# OpenCV's stubs widen the element type of every array that they return.
# pyright: reportArgumentType=false, reportCallIssue=false, reportReturnType=false
# pyright: reportAssignmentType=false

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from curling_env.sheet import Sheet
from curling_env.typing import Floats, Image
from friction_estimation.appearance import StoneModel
from friction_estimation.camera.camera import Camera
from friction_estimation.tracking.detection.acquisition import stone_likeness
from friction_estimation.tracking.detection.background import MIN_CONTRAST, Background, Blob

SCALE_STEP = 1.5
"""Stones are looked for in sizes that differ by this factor."""
AROUND = 1.8
"""Spots up to this many stones wide stand out; larger ones are paint or people."""
LEAST_PX = 4.0
"""A stone whose picture is smaller is not looked for [px]."""
DEEPER = 2.5
"""The second, higher contrast at which spots are looked for."""
LEAST_OPENED = 8.0
"""Flatter pictures of stones may be lost when thin lines are taken away [px]."""
LEAST_LIKENESS = 0.05
BY_PLACE = 0.2
"""Spots nearer to each other are one stone [m]."""


def spots_like_stones(
    picture: Image, background: Background, camera: Camera, model: StoneModel, sheet: Sheet
) -> list[Floats]:
    """Places [m] of dark spots that are as large as a stone would be there.

    Parameters
    ----------
    picture : (rows, columns, 3) the background's region
    """
    # Along the sheet's middle line and edges, how large a stone looks and where.
    x = np.linspace(-sheet.width / 2, sheet.width / 2, 3)
    y = np.linspace(-sheet.length / 2, sheet.length / 2, 90)
    ground = np.array([(a, b, 0.0) for a in x for b in y])
    ground = ground[camera.sees(ground)]
    if len(ground) == 0:
        return []
    px = camera.project(ground) - np.array(background.origin_px)
    extent = np.array([_extent_px(camera, model, place[:2]) for place in ground])
    whole = np.isfinite(extent).all(axis=1)
    px, extent = px[whole], np.maximum(extent[whole], LEAST_PX)
    if len(px) == 0:
        return []
    size = extent.max(axis=1)
    steps = np.round(np.log(size / size.min()) / np.log(SCALE_STEP)).astype(int)
    found: list[tuple[float, Floats]] = []
    for step in np.unique(steps):
        part = px[steps == step]
        width = float(size.min() * SCALE_STEP**step)
        low = np.maximum(np.floor(part.min(axis=0) - 3 * width).astype(int), 0)
        high = np.ceil(part.max(axis=0) + 3 * width).astype(int)
        cut = np.ascontiguousarray(picture[low[1] : high[1], low[0] : high[0]])
        if min(cut.shape[:2]) < 4:
            continue
        flat = float(extent[steps == step].min())
        for blob in _dark_spots(cut, width, flat, background, low):
            spot = stone_likeness(blob, camera, model, sheet)
            if spot is not None and spot.likeness >= LEAST_LIKENESS:
                found.append((spot.likeness, spot.xy))
    places: list[Floats] = []
    for _, xy in sorted(found, key=lambda item: -item[0]):
        if all(np.linalg.norm(xy - other) > BY_PLACE for other in places):
            places.append(xy)
    return places


def _extent_px(camera: Camera, model: StoneModel, xy: Floats) -> Floats:
    """Width and height of a stone's picture, (2,) [px]; NaN where it has none."""
    corners = model.extent_px(camera, xy)
    return corners[1] - corners[0] if len(corners) else np.full(2, np.nan)


def _dark_spots(
    cut: Image, width: float, flat: float, background: Background, low: NDArray[np.int_]
) -> list[Blob]:
    """Blobs darker than all within a stone's width or two about them, in any colour."""
    reach = 2 * round(AROUND * width / 2) + 1
    kernel = cv2.getStructuringElement(cv2.MORPH_RECT, (reach, reach))
    depth = cv2.morphologyEx(cut, cv2.MORPH_BLACKHAT, kernel)
    limit = max(2 * MIN_CONTRAST, 6 * background.noise)
    # Lines are thinner than stones; but where a stone is flat itself, that may leave nothing of it.
    thin = max(3, 2 * round(flat / 8) + 1)
    found: list[Blob] = []
    for one in cv2.split(depth):
        # A ring is dark in two colours and hardly in the third, in which a stone on it stands out.
        for least in (limit, DEEPER * limit):
            mask = (one > least).astype(np.uint8)
            opened = np.asarray(
                cv2.morphologyEx(mask, cv2.MORPH_OPEN, np.ones((thin, thin), np.uint8)), np.uint8
            )
            found += _blobs_in(opened, width, background, low)
            if flat < LEAST_OPENED:
                found += _blobs_in(mask, width, background, low)
    return found


def _blobs_in(
    mask: NDArray[np.uint8], width: float, background: Background, low: NDArray[np.int_]
) -> list[Blob]:
    """Connected parts of a mask that are about as large as a stone."""
    _, _, stats, _ = cv2.connectedComponentsWithStats(mask, connectivity=4)
    origin = np.array(background.origin_px, dtype=np.float64) + low
    blobs: list[Blob] = []
    for left, top, w, h, area in stats[1:].tolist():
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
