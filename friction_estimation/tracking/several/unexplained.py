"""What nothing explains in a track, in words: it may have gone over to another stone."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from curling_env.trajectory import Trajectory
from friction_estimation.camera.camera import Camera
from friction_estimation.tracking import tuning
from friction_estimation.tracking.detection.resting_stones import FilmedRestingStone
from friction_estimation.tracking.joint.losses import left_behind, sudden_loss
from friction_estimation.tracking.joint.scatter import scattered
from friction_estimation.tracking.joint.warnings import place_in_words, scatter_in_words
from friction_estimation.tracking.path.assembly import Measurements
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
        f"the stone that lay at {place_in_words(stone.rested.xy)} left unseen and has no track"
        for stone, track in zip(stones[1:], tracks[1:], strict=True)
        if stone.rested is not None and track is None
    ]
    ends = [track.xy[-1] for track in tracks if track is not None]
    new = [
        f"a stone lies at {place_in_words(stone.xy)} at the end, and no track leads there"
        for stone in resting
        if stone.comes
        and all(np.linalg.norm(stone.xy - end) > 2 * tuning.SAME_PLACE for end in ends)
    ]
    wild = [
        f"the stone that lay at {place_in_words(stone.rested.xy)}: {scatter_in_words(one)}"
        for stone in stones[1:]
        if stone.rested is not None
        for one in scattered(np.array(stone.measured.t), stone.measured.fits, camera, 0.0)
        if one.is_wild
    ]
    return (*strange_ways(camera, stones[0].measured, contacts[0]), *lost, *wild, *new)


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
        scatter_in_words(one)
        for one in stretches
        if one.is_wild
        or (
            one.last - one.first > tuning.SCATTER_TOLD
            and not any(one.first - 1 < c < one.last + 1 for c in contacts)
        )
    ]
    when = sudden_loss(t, measured.fits, camera, 0.0, contacts)
    behind = left_behind(t, measured.fits, camera, 0.0, stretches)
    if behind is not None and not contacts:
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
