"""Other stones of a throw from several cameras: each of them once, on one clock."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from curling_env.trajectory import Trajectory
from friction_estimation.tracks.camera_fusion import JoinedTrack, on_common_clock
from friction_estimation.tracks.tuning import SAME_STONE_DISTANCE


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
            own = replace(
                on_common_clock(
                    track, float(joined.offset[camera]), float(joined.offset_sigma[camera])
                ),
                throw=joined.trajectory.throw,
                clock=joined.trajectory.clock,
            )
            for k, (known, origin) in enumerate(found):
                if origin[0] != camera and _are_one(known, own):
                    found[k] = (_together(known, own), origin)
                    break
            else:
                found.append((own, (camera, number)))
    return found


def _are_one(a: Trajectory, b: Trajectory) -> bool:
    start, stop = max(a.t[0], b.t[0]), min(a.t[-1], b.t[-1])
    if start < stop:
        inside = np.concatenate(
            [track.t[(track.t >= start) & (track.t <= stop)] for track in (a, b)]
        )
        moments = np.unique(np.r_[start, inside, stop])
        apart = np.linalg.norm(a.at(moments) - b.at(moments), axis=1)
        return bool(apart.max() < SAME_STONE_DISTANCE)
    first, second = (a, b) if a.t[0] <= b.t[0] else (b, a)
    return bool(np.linalg.norm(first.xy[-1] - second.xy[0]) < SAME_STONE_DISTANCE)


def _together(a: Trajectory, b: Trajectory) -> Trajectory:
    """Return the rows of the more accurate track, and those of the other before and after it."""
    best, rest = (a, b) if np.median(a.sigma_xy) <= np.median(b.sigma_xy) else (b, a)
    outside = (rest.t < best.t[0]) | (rest.t > best.t[-1])
    return best.joined(rest.only(outside))
