"""What nothing explains in a track, in words: it may have gone over to another stone."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from curling_env.trajectory import Trajectory
from curling_env.typing import Floats
from friction_estimation.camera.camera import Camera
from friction_estimation.tracking import tuning
from friction_estimation.tracking.detection.resting_stones import FilmedRestingStone
from friction_estimation.tracking.path.assembly import Measurements
from friction_estimation.tracking.path.left_behind import left_behind, velocity_of
from friction_estimation.tracking.path.scatter import metres_per_px, scattered
from friction_estimation.tracking.several.moving_stones import MovingStone


def unexplained(
    camera: Camera,
    stones: Sequence[MovingStone],
    contacts: Sequence[Sequence[float]],
    tracks: Sequence[Trajectory | None],
    resting: Sequence[FilmedRestingStone],
) -> tuple[str, ...]:
    """What should be looked at in the film.

    Parameters
    ----------
    camera : that filmed
    stones : the thrown stone, then those that left their places
    contacts : when each of them touched another [s]
    tracks : of each of them; None where it was not followed
    resting : what lay on the sheet at the beginning or at the end: no stone comes from nowhere
    """
    lost = [
        f"the stone that lay at {_place(stone.rested.xy)} left unseen and has no track"
        for stone, track in zip(stones[1:], tracks[1:], strict=True)
        if stone.rested is not None and track is None
    ]
    ends = [track.xy[-1] for track in tracks if track is not None]
    new = [
        f"a stone lies at {_place(stone.xy)} at the end, and no track leads there"
        for stone in resting
        if stone.comes
        and all(np.linalg.norm(stone.xy - end) > 2 * tuning.SAME_PLACE for end in ends)
    ]
    return (*strange_ways(camera, stones[0].measured, contacts[0]), *lost, *new)


def _place(xy: Floats) -> str:
    return f"({xy[0]:.2f}, {xy[1]:.2f}) m"


def strange_ways(
    camera: Camera, measured: Measurements, contacts: Sequence[float] = ()
) -> tuple[str, ...]:
    """Where a thrown stone goes as no stone does, in words.

    It seems to have hit something that was not found, or something beside it was taken for it.

    Parameters
    ----------
    camera : that filmed
    contacts : when it is known to have touched others [s]
    """
    t = np.array(measured.t)
    stretches = scattered(t, measured.fits, camera, 0.0)
    said = [
        f"from {one.first:.1f} to {one.last:.1f} s its places scatter by {one.by:.2f} m: something "
        "beside it may have been taken for it"
        for one in stretches
        if one.last - one.first > tuning.SCATTER_TOLD
        and not any(one.first - 1 < c < one.last + 1 for c in contacts)
    ]
    when = sudden_loss(camera, measured, contacts)
    behind = left_behind(t, measured.fits, camera, 0.0, stretches)
    if when is None and behind is not None and not contacts:
        said.append(
            f"from {behind.since:.1f} s on it slows down more than ice slows a stone: the "
            "track may have stayed behind"
        )
    if when is not None:
        said.append(
            f"at {when:.1f} s it loses speed as if it hit a stone, and none is found there: from "
            "then on the track may be that of another stone"
        )
    return tuple(said)


def sudden_loss(camera: Camera, measured: Measurements, contacts: Sequence[float]) -> float | None:
    """When a thrown stone lost speed at once, as ice does not slow it; None where it did not [s].

    Parameters
    ----------
    camera : that filmed; what is less than a pixel may be seen wrongly
    contacts : when it is known to have touched others [s]
    """
    seen = [(t, f.xy) for t, f in zip(measured.t, measured.fits, strict=True) if f is not None]
    if len(seen) < 4 * tuning.LEAST_BESIDE:
        return None
    t, xy = np.array([a for a, _ in seen]), np.array([b for _, b in seen])
    worst, when = tuning.SUDDEN_LOSS, None
    for k in np.flatnonzero(np.abs(xy[:, 1] - xy[0, 1]) > tuning.OUT_OF_HAND):
        at = (t[k - 1] + t[k]) / 2
        if any(abs(at - c) < 2 * tuning.BESIDE_SECONDS for c in contacts):
            continue
        before = (t < at) & (t > at - tuning.BESIDE_SECONDS)
        after = (t > at) & (t < at + tuning.BESIDE_SECONDS)
        if min(before.sum(), after.sum()) < tuning.LEAST_BESIDE:
            continue
        (v0, s0), (v1, s1) = (velocity_of(t[part], xy[part]) for part in (before, after))
        change = v0 - v1
        sure = np.abs(change) > tuning.SURE_LOSS * np.hypot(s0, s1)
        loss = float(np.hypot(*np.where(sure, change, 0.0)))
        if loss < worst:
            continue
        pixel = metres_per_px(camera, xy[k : k + 1], 0.0)[0]
        lasts = _left_behind(t, xy, int(k)) > tuning.SUDDEN_LOSS_PX * pixel
        if lasts and np.hypot(*v1) < np.hypot(*v0):
            worst, when = loss, float(at)
    return when


def _left_behind(t: Floats, xy: Floats, k: int) -> float:
    """How far a stone then is from where it would be by its motion before place k [m].

    For a moment a place may be wrong by part of a pixel; what is lost in a hit stays lost.
    """
    before = (t < t[k]) & (t >= t[k] - tuning.LOST_FOR)
    later = np.flatnonzero((t >= t[k]) & (t <= t[k] + tuning.LOST_FOR))[-tuning.LEAST_BESIDE :]
    velocity, _ = velocity_of(t[before], xy[before])
    since = t[later].mean() - t[before].mean()
    pace = max(float(np.hypot(*velocity)), 1e-6)
    since = min(since, pace / tuning.SLOWING)
    way = (since - 0.5 * tuning.SLOWING * since**2 / pace) * velocity
    return float(np.hypot(*(xy[later].mean(axis=0) - xy[before].mean(axis=0) - way)))
