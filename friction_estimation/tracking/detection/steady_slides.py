"""What slides steadily for about a second, among sightings of stones and of what passes for one."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from curling_env.typing import Floats
from friction_estimation.camera.camera import Camera
from friction_estimation.tracking import tuning
from friction_estimation.tracking.detection.thrown_stone import Sighting


def steadiest_slide(sightings: Sequence[Sighting], camera: Camera) -> list[Sighting] | None:
    """The sightings of the slide that is steadiest and most like a stone's; None: there is none."""
    ordered = sorted(sightings, key=lambda s: s.t)
    if len(ordered) < tuning.SLIDE_SIGHTINGS:
        return None
    t = np.array([s.t for s in ordered])
    xy = np.array([s.xy for s in ordered])
    like = np.array([s.likeness for s in ordered]) ** 2
    frame = np.array([s.frame for s in ordered])
    reach = tuning.SLIDE_JITTER + resolution(camera, xy)
    short, long = tuning.SLIDE_SECONDS
    best, chosen = 0.0, None
    for i in range(len(ordered)):
        first, end = np.searchsorted(t, (t[i] + short, t[i] + long)).tolist()
        velocity = (xy[first:end] - xy[i]) / (t[first:end] - t[i])[:, None]
        pace = np.abs(velocity[:, 1])
        fine = (pace > tuning.SLIDE_PACE) & (pace < tuning.MAX_THROW_SPEED)
        fine &= np.abs(velocity[:, 0]) < tuning.SLIDE_ASIDE * pace + reach[i, 0]
        if not fine.any():
            continue
        # Every sighting at the other end says how the stone went; those between must agree.
        between = slice(i, end)
        last = np.arange(first, end)[fine]
        way = (t[between] - t[i])[None, :, None] * velocity[fine][:, None]
        near = (np.abs(xy[i] + way - xy[None, between]) < reach[None, between]).all(axis=2)
        near &= frame[None, between] <= frame[last][:, None]
        missed = frame[last] - frame[i] + 1 - near.sum(axis=1)
        value = near @ like[between] - 0.5 * np.maximum(missed, 0)
        k = int(np.argmax(value))
        if value[k] > best:
            best, chosen = float(value[k]), i + np.flatnonzero(near[k])
    if chosen is None:
        return None
    in_frame = {s.frame: s for s in sorted((ordered[k] for k in chosen), key=lambda s: s.likeness)}
    if len(in_frame) < tuning.SLIDE_SIGHTINGS:
        return None
    return sorted(in_frame.values(), key=lambda s: s.t)


def resolution(camera: Camera, xy: Floats) -> Floats:
    """How far each coordinate of places (n, 2) changes with a pixel, (n, 2) [m]."""
    return np.array([np.linalg.norm(np.linalg.inv(camera.px_per_metre(k)), axis=1) for k in xy])
