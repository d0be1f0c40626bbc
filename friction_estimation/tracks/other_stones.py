"""Other stones of a throw from several cameras: each of them once, on one clock."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from curling_env.trajectory import Trajectory
from curling_env.typing import Floats
from friction_estimation.tracks.camera_fusion import JoinedTrack
from friction_estimation.tracks.tuning import SAME_STONE_DISTANCE, UNKNOWN_ROW_SIGMA

_COLUMNS = ("t", "xy", "theta", "swept", "sigma_xy", "sigma_theta")


def other_stones(
    seen: Sequence[Sequence[Trajectory]], joined: JoinedTrack
) -> list[tuple[Trajectory, tuple[int, int]]]:
    """Return the stones that were not thrown, each from the cameras with the best view.

    Two tracks are of one stone if they are within `SAME_STONE_DISTANCE` of each other whenever both
    cameras see it; if they never do, one must begin where the other ends. A stone that leaves one
    picture while it slides and enters another one later has a separate track in each.

    Parameters
    ----------
    seen : for each camera the tracks of the other stones, on its own clock
    joined : the thrown stone's track, by the same cameras in the same order

    Returns
    -------
    each stone's track on the clock of `joined`, and the camera and number of the track that begins
    it
    """
    found: list[tuple[Trajectory, tuple[int, int]]] = []
    for camera in joined.order:
        for number, track in enumerate(seen[camera]):
            own = _shifted(
                track, float(joined.offset[camera]), float(joined.offset_sigma[camera]), joined
            )
            for k, (known, origin) in enumerate(found):
                if origin[0] != camera and _are_one(known, own):
                    found[k] = (_together(known, own), origin)
                    break
            else:
                found.append((own, (camera, number)))
    return found


def _shifted(track: Trajectory, offset: float, sigma: float, joined: JoinedTrack) -> Trajectory:
    """Return a track on the common clock; the clock's uncertainty is in its errors."""
    own = track.sigma_xy if track.sigma_xy.size else np.full(len(track), UNKNOWN_ROW_SIGMA)
    speed = np.zeros(len(track))
    if len(track) > 2:
        rate = np.gradient(track.xy, track.t, axis=0)
        speed = np.linalg.norm(rate, axis=1)
    turn = track.sigma_theta if track.sigma_theta.size else np.full(len(track), np.nan)
    whole = joined.trajectory
    return replace(
        track,
        t=track.t + offset,
        sigma_xy=np.hypot(own, speed * sigma / np.sqrt(2)),
        sigma_theta=turn,
        throw=whole.throw,
        clock=whole.clock,
    )


def _are_one(a: Trajectory, b: Trajectory) -> bool:
    start, stop = max(a.t[0], b.t[0]), min(a.t[-1], b.t[-1])
    if start < stop:
        inside = np.concatenate(
            [track.t[(track.t >= start) & (track.t <= stop)] for track in (a, b)]
        )
        moments = np.unique(np.r_[start, inside, stop])
        apart = np.linalg.norm(_at(a, moments) - _at(b, moments), axis=1)
        return bool(apart.max() < SAME_STONE_DISTANCE)
    first, second = (a, b) if a.t[0] <= b.t[0] else (b, a)
    return bool(np.linalg.norm(first.xy[-1] - second.xy[0]) < SAME_STONE_DISTANCE)


def _at(track: Trajectory, t: Floats) -> Floats:
    return np.column_stack([np.interp(t, track.t, axis) for axis in track.xy.T])


def _together(a: Trajectory, b: Trajectory) -> Trajectory:
    """Return the rows of the more accurate track, and those of the other before and after it."""
    best, rest = (a, b) if np.median(a.sigma_xy) <= np.median(b.sigma_xy) else (b, a)
    outside = (rest.t < best.t[0]) | (rest.t > best.t[-1])
    order = np.argsort(np.r_[best.t, rest.t[outside]], kind="stable")
    columns = {
        name: np.concatenate([getattr(best, name), getattr(rest, name)[outside]])[order]
        for name in _COLUMNS
    }
    return replace(best, **columns)
