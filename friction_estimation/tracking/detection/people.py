"""Whether people are near a stone: what is larger than one may hide it, or pass for it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from curling_env.typing import Floats
from friction_estimation.appearance import StoneModel
from friction_estimation.camera.camera import Camera
from friction_estimation.film.frame import Frame
from friction_estimation.tracking import tuning
from friction_estimation.tracking.background import Background, Blob, moving_blobs
from friction_estimation.tracking.detection.thrown_stone import RoughPath
from friction_estimation.tracking.joint.sightings import is_larger


def people_near(
    frames: Sequence[tuple[float, Frame]],
    path: RoughPath | None,
    background: Background,
    camera: Camera,
    model: StoneModel,
) -> bool:
    """Whether something larger than a stone is often near its path, or anywhere if it has none."""
    count = 0
    for t, frame in frames:
        place = None if path is None else path.at(t)
        count += any(
            is_larger(blob, camera, model)
            and (place is None or distance(blob, place, camera) < tuning.PEOPLE_NEAR)
            for blob in moving_blobs(frame, background)
        )
        if count >= tuning.FRAMES_WITH_PEOPLE:
            return True
    return False


def distance(blob: Blob, place: Floats, camera: Camera) -> float:
    """How far a blob's box is from a place on the ice, about [m]."""
    px = camera.project(np.array([[*place, 0.0]]))[0]
    half = np.maximum(blob.whole_px, blob.high_px - blob.low_px) / 2
    away = np.maximum(np.abs(px - (blob.low_px + blob.high_px) / 2) - half, 0.0)
    metre = np.linalg.inv(camera.px_per_metre(place))
    return float(np.linalg.norm(metre @ away))
