"""Tracks of one throw from several cameras, joined."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import reduce
from typing import Any

from curling_env.trajectory import Trajectory
from friction_estimation.tracking.films.tracked_film import TrackedFilm
from friction_estimation.tracking.stone_numbers import clearer
from friction_estimation.tracks.camera_fusion import join_cameras
from friction_estimation.tracks.other_stones import other_stones


@dataclass(frozen=True, kw_only=True)
class JoinedThrow:
    """All stones of one throw.

    Parameters
    ----------
    tracks : the thrown stone's track, then those of the other stones
    handles : colour of the handle of each stone; None where it is not known
    views : the parts of the cameras, for JSON
    """

    tracks: list[Trajectory]
    handles: list[str | None]
    views: list[dict[str, Any]]


def join_views(
    views: Sequence[TrackedFilm],
    throw: int,
    *,
    bridge: bool = False,
    remark: Callable[[str], object] = lambda text: None,
) -> JoinedThrow:
    """Join the tracks of all stones of one throw from one or several cameras.

    Parameters
    ----------
    views : the throw in the film of each camera that has seen it
    throw : its number
    bridge : also write rows for times when no camera saw the thrown stone
    remark : called with the offset of each camera's clock

    Raises
    ------
    InputError : tracks that cannot be joined
    """
    about = [{"film": str(one.film), "throw": throw, **one.summary} for one in views]
    first = views[0].thrown
    if len(views) == 1:
        remark(f"throw {throw}: only {views[0].name} has seen it")
        tracks = [replace(k, throw=throw) for k in views[0].tracks]
        return JoinedThrow(tracks=tracks, handles=views[0].handles, views=about)
    joined = join_cameras([one.thrown for one in views])
    begin = views[joined.order[0]]
    for one, its, shift, sigma in zip(
        views, about, joined.offset, joined.offset_sigma, strict=True
    ):
        offset = float(shift) + begin.thrown.clock - one.thrown.clock
        clock = f"{offset:+.3f} s ± {1000 * sigma:.0f} ms on the clock of {begin.film.name}"
        remark(f"{one.name}: {clock}")
        its |= {"offset_s": offset, "offset_sigma_s": float(sigma)}
    others = other_stones([one.tracks[1:] for one in views], joined)
    # All throws use the clock of the first camera.
    shift = float(joined.offset[0]) + begin.thrown.clock - first.clock
    clock = round(begin.thrown.clock - shift, 3)
    stones = [joined.whole if bridge else joined.trajectory, *(track for track, _ in others)]
    # The clearest view of a handle determines its colour.
    handles = [reduce(clearer, [one.handles[0] for one in views])]
    handles += [views[camera].handles[1 + number] for _, (camera, number) in others]
    tracks = [replace(track, throw=throw, clock=clock) for track in stones]
    return JoinedThrow(tracks=tracks, handles=handles, views=about)
