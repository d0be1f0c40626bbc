"""Sightings: blobs with the size and shape of a stone, and larger ones."""

# OpenCV's stubs widen the element type of every array that they return.
# pyright: reportArgumentType=false, reportCallIssue=false

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np

from curling_env.sheet import Sheet
from curling_env.typing import Floats
from friction_estimation.appearance import StoneModel
from friction_estimation.camera.camera import Camera
from friction_estimation.tracking import tuning
from friction_estimation.tracking.detection.background import Blob

_AROUND = np.column_stack(
    [f(np.linspace(0, 2 * np.pi, 24, endpoint=False)) for f in (np.cos, np.sin)]
)


@dataclass(frozen=True, kw_only=True, eq=False)
class Sighting:
    """Blob that may be a stone.

    Parameters
    ----------
    xy : (2,) centre on the ice [m]
    likeness : 1 for exactly the size and shape of a stone in that place, towards 0 otherwise
    """

    xy: Floats
    likeness: float


def sighting_of(blob: Blob, camera: Camera, model: StoneModel, sheet: Sheet) -> Sighting | None:
    """Interpret a blob as a stone on the ice, with its similarity.

    The blob may be the body alone, the body with its handle, or both with part of the reflection in
    the ice, whichever fits best. None for a blob off the ice, or with another size or shape.
    """
    if (blob.whole_px > tuning.MAX_SHADOW_GROWTH * (blob.high_px - blob.low_px + 3.0)).any():
        return None  # the core of something much larger, such as a person's jacket
    extents = _extents(model)
    middle = (blob.low_px + blob.high_px) / 2
    places = camera.on_plane([middle] * len(extents), np.mean(extents, axis=1))
    tries = (
        _as_stone(blob, xy, camera, model, sheet, *extent)
        for xy, extent in zip(places, extents, strict=True)
    )
    return max((s for s in tries if s is not None), key=lambda s: s.likeness, default=None)


def _extents(model: StoneModel) -> tuple[tuple[float, float], ...]:
    """Ranges of height of a stone's blob [m]: body, with handle, with reflection."""
    top = model.height + tuning.HANDLE_RISE
    return (0.0, model.height), (0.0, top), (-model.height / 2, top)


def _as_stone(
    blob: Blob,
    xy: Floats,
    camera: Camera,
    model: StoneModel,
    sheet: Sheet,
    low: float,
    high: float,
) -> Sighting | None:
    """Interpret a blob as a stone at a position, from one height to another [m]."""
    x, y = xy.tolist()
    half = sheet.width / 2 + model.radius, sheet.length / 2 + model.radius
    if not (abs(x) <= half[0] and abs(y) <= half[1]):  # and if no ray meets the ice
        return None
    found = (blob.high_px - blob.low_px + 1).tolist()
    corners = model.extent_px(camera, xy)
    rim, ratio = tuning.BLOB_RIM_PX, tuning.MAX_SIZE_RATIO
    if len(corners) == 0:
        return None
    least = (corners[1] - corners[0]).tolist()
    if any(a + rim > ratio * b + 0.01 for a, b in zip(least, found, strict=True)):
        return None  # smaller than the body alone
    body = model.outline_px(camera, xy).astype(np.float32)
    if len(body) == 0:
        return None
    slim = np.empty((2, len(_AROUND), 3))
    slim[:, :, :2] = xy + 0.6 * model.radius * _AROUND
    slim[:, :, 2] = [[low], [high]]
    outline = np.concatenate([body, camera.project(slim.reshape(-1, 3)).astype(np.float32)])
    expected = (outline.max(axis=0) - outline.min(axis=0)).tolist()
    least_area = 0.9 * cv2.contourArea(body) + 1.0
    most_area = 1.3 * cv2.contourArea(cv2.convexHull(outline)) + 4.0
    misfit = max(
        *(abs(math.log(a / (b + rim))) for a, b in zip(found, expected, strict=True)),
        math.log(least_area / blob.area_px),
        math.log(blob.area_px / most_area),
        0.0,
    )
    if not misfit <= math.log(ratio):
        return None
    return Sighting(xy=xy, likeness=math.exp(-((misfit / 0.45) ** 2)))


def is_larger(blob: Blob, camera: Camera, model: StoneModel) -> bool:
    """Return whether a blob is much larger than a stone would be there, as people are."""
    middle = camera.on_plane(((blob.low_px + blob.high_px) / 2)[None], 0.0)[0]
    corners = model.extent_px(camera, middle) if np.isfinite(middle).all() else np.empty((0, 2))
    if len(corners) == 0:
        return False
    return bool((blob.whole_px > tuning.MAX_SHADOW_GROWTH * (corners[1] - corners[0] + 3)).any())
