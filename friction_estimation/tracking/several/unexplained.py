"""What nothing explains in a track, in words: it may have gone over to another stone."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from curling_env.trajectory import Trajectory
from curling_env.typing import Floats
from friction_estimation.tracking import tuning
from friction_estimation.tracking.detection.resting_stones import FilmedRestingStone
from friction_estimation.tracking.path.assembly import Measurements
from friction_estimation.tracking.several.moving_stones import MovingStone


def unexplained(
    stones: Sequence[MovingStone],
    contacts: Sequence[Sequence[float]],
    tracks: Sequence[Trajectory | None],
    resting: Sequence[FilmedRestingStone],
) -> tuple[str, ...]:
    """What should be looked at in the film.

    Parameters
    ----------
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
    return (*hit_unseen(stones[0].measured, contacts[0]), *lost, *new)


def _place(xy: Floats) -> str:
    return f"({xy[0]:.2f}, {xy[1]:.2f}) m"


def hit_unseen(measured: Measurements, contacts: Sequence[float] = ()) -> tuple[str, ...]:
    """Whether a thrown stone seems to have hit something that was not found, in words.

    Parameters
    ----------
    contacts : when it is known to have touched others [s]
    """
    when = sudden_loss(measured, contacts)
    if when is None:
        return ()
    return (
        f"at {when:.1f} s it loses speed as if it hit a stone, and none is found there: from "
        "then on the track may be that of another stone",
    )


def sudden_loss(measured: Measurements, contacts: Sequence[float]) -> float | None:
    """When a thrown stone lost speed at once, as ice does not slow it; None where it did not [s].

    Parameters
    ----------
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
        (v0, s0), (v1, s1) = (_speed(t[part], xy[part]) for part in (before, after))
        change = v0 - v1
        sure = np.abs(change) > tuning.SURE_LOSS * np.hypot(s0, s1)
        loss = float(np.hypot(*np.where(sure, change, 0.0)))
        if loss > worst and np.hypot(*v1) < np.hypot(*v0):
            worst, when = loss, float(at)
    return when


def _speed(t: Floats, xy: Floats) -> tuple[Floats, Floats]:
    """Velocity (2,) along a straight line through places (n, 2), and its standard error [m/s]."""
    since = t - t.mean()
    spread = float(since @ since)
    velocity = since @ xy / spread
    left = xy - xy.mean(axis=0) - since[:, None] * velocity
    return velocity, np.sqrt((left**2).sum(axis=0) / max(len(t) - 2, 1) / spread) + 1e-6
