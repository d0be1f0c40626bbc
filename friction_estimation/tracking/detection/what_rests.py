"""What has come to rest in frames, among sightings of stones and of what passes for one."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from friction_estimation.camera.camera import Camera
from friction_estimation.tracking import tuning
from friction_estimation.tracking.detection.steady_slides import resolution
from friction_estimation.tracking.detection.thrown_stone import Sighting


def at_rest(sightings: Sequence[Sighting], until: float, camera: Camera) -> list[list[Sighting]]:
    """The first sightings of each thing that lies still at last, and did not lie there before.

    Those that are most like a stone come first.

    Parameters
    ----------
    sightings : of frames a fraction of a second apart
    until : time of the last frame [s]
    """
    ordered = sorted(sightings, key=lambda s: s.t)
    if not ordered:
        return []
    t = np.array([s.t for s in ordered])
    xy = np.array([s.xy for s in ordered])
    like = np.array([s.likeness for s in ordered])
    reach = tuning.SLIDE_JITTER + 0.5 * resolution(camera, xy)
    found: list[tuple[float, list[Sighting]]] = []
    taken = np.zeros(len(ordered), dtype=bool)
    for k in range(len(ordered) - 1, -1, -1):
        if t[k] < until - tuning.SLIDE_SECONDS[0]:
            break
        near = (np.abs(xy - xy[k]) < reach[k]).all(axis=1) & ~taken
        lies = near & (t >= until - tuning.REST_SEEN)
        if taken[k] or lies.sum() < tuning.SLIDE_SIGHTINGS:
            continue
        taken |= near
        if near.sum() > 1.5 * lies.sum():
            continue  # it lay there before
        first = np.flatnonzero(lies)[: 2 * tuning.SLIDE_SIGHTINGS]
        found.append((float(like[first].mean()), [ordered[i] for i in first]))
    found.sort(key=lambda one: -one[0])
    return [seen for _, seen in found[: tuning.SLIDES_TRIED]]
