"""What slides steadily, for a second or all the way, among sightings of what may be a stone."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

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


def long_slides(sightings: Sequence[Sighting], camera: Camera) -> Iterator[list[Sighting]]:
    """The sightings of each thing that slides far, and slows down all the way as a stone does.

    A stone does, and in a picture whoever keeps beside it; who walks or stands does not.
    """
    left = list(sightings)
    for _ in range(tuning.LONG_SLIDES_SOUGHT):
        slide = steadiest_slide(left, camera)
        if slide is None:
            return
        slide = _all_the_way(slide, left, camera)
        own = set(map(id, slide))
        left = [s for s in left if id(s) not in own]
        t = np.array([s.t for s in slide])
        y = np.array([s.xy[1] for s in slide])
        along = np.abs(y - y[0])
        if np.ptp(t) < tuning.LONG_SECONDS or along[-1] < tuning.LONG_WAY:
            continue
        least, most = tuning.LONG_SLOWING
        if least < -2 * np.polyfit(t - t[0], along, 2)[0] < most:
            yield slide


def _all_the_way(
    slide: Sequence[Sighting], sightings: Sequence[Sighting], camera: Camera
) -> list[Sighting]:
    """A slide with the sightings that go on from it, and those that lead to it."""
    in_frame: dict[int, list[Sighting]] = {}
    for one in sightings:
        in_frame.setdefault(one.frame, []).append(one)
    frames = sorted(in_frame)

    def on(way: list[Sighting], ahead: Sequence[int]) -> list[Sighting]:
        for frame in ahead:
            last = way[-1].t
            since = in_frame[frame][0].t - last
            recent = [s for s in way if abs(s.t - last) <= tuning.SLIDE_SECONDS[1]]
            if abs(since) > tuning.LONG_UNSEEN or len(recent) < 3:
                break
            line = np.polyfit([s.t - last for s in recent], [s.xy for s in recent], 1)
            place = line[1] + line[0] * since
            near = min(in_frame[frame], key=lambda s: float(np.linalg.norm(s.xy - place)))
            reach = tuning.SLIDE_JITTER + resolution(camera, near.xy[None])[0]
            # The line is that of the middle of what was seen; meanwhile a stone slows down.
            slowed = 0.5 * tuning.SLOWING * (abs(since) + tuning.SLIDE_SECONDS[1] / 2) ** 2
            if (np.abs(near.xy - place) < reach + slowed).all():
                way.append(near)
        return way

    way = on(list(slide), [frame for frame in frames if frame > slide[-1].frame])
    return on(way[::-1], [frame for frame in frames[::-1] if frame < slide[0].frame])[::-1]


def resolution(camera: Camera, xy: Floats) -> Floats:
    """How far each coordinate of places (n, 2) changes with a pixel, (n, 2) [m]."""
    return np.linalg.norm(np.linalg.inv(camera.px_per_metre(xy)), axis=2)
