"""`curling join-cameras`: films of one throw by several cameras to one track."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import reduce
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from typer import Argument, Option

from curling_env.commands.options import OUTPUT, Results, TracksFile, grouped
from curling_env.commands.terminal import progress_bar, say
from curling_env.errors import InputError, NoThrowError
from friction_estimation.commands.film_options import SCENE, Tracking

if TYPE_CHECKING:
    from curling_env.trajectory import Trajectory
    from friction_estimation.tracking import TrackedFilm


@grouped
def join_cameras(
    films: Annotated[
        list[Path],
        Argument(metavar="VIDEO VIDEO...", help="Films of the same throws, one per camera."),
    ],
    scene: Annotated[list[Path], SCENE],
    output: TracksFile = Path("tracks.csv"),
    bridge: Annotated[
        bool,
        Option("--bridge", help="Also write rows where no camera saw it.", rich_help_panel=OUTPUT),
    ] = False,
    *,
    tracking: Tracking,
    results: Results,
) -> None:
    """Join films of one throw, by cameras that see a part of the sheet each, to one track.

    \b
    Example:
        curling join-cameras home.mp4 mid.mp4 away.mp4 \\
            --scene home.json --scene mid.json --scene away.json -o tracks.csv

    The stone is tracked in each film, as by `curling track`. The clocks of the cameras need not
    agree: they are synchronised by the stone's passage from one picture to the next or, across a
    gap, by its deceleration; sigma_xy includes the uncertainty. Long films are cut into their
    throws, which are matched by their times. Other stones are joined too. See docs/tracking.md.
    """
    import numpy as np

    from curling_env.trajectory import write_tracks
    from friction_estimation.tracking.films.resume import Checkpoints
    from friction_estimation.tracking.stone_numbers import StoneNumbers
    from friction_estimation.tracks.session_pairs import same_throws

    if len(set(films)) < max(2, len(films)):
        raise InputError("give the films of two cameras or more", source="VIDEO...")
    seen: dict[Path, list[TrackedFilm]] = {film: [] for film in films}
    with progress_bar("frame") as bar:
        for one in tracking.throws_in(films, tracking.scenes(scene), output, progress=bar):
            seen[one.film].append(one)
    for film, throws_seen in seen.items():
        if not throws_seen:
            raise NoThrowError("no thrown stone found", source=film)
    clocks = [np.array([one.thrown.clock for one in camera]) for camera in seen.values()]
    tracks: list[Trajectory] = []
    result: list[dict[str, Any]] = []
    numbers, throws = StoneNumbers(), same_throws(clocks)
    for throw, which in enumerate(throws):
        views = [c[k] for c, k in zip(seen.values(), which, strict=True) if k is not None]
        stones, handles, joined = _joined(views, throw, bridge=bridge)
        given = numbers.of(stones, handles)
        tracks += [replace(k, stone=n) for k, n in zip(stones, given, strict=True)]
        result += joined
    write_tracks(output, tracks)
    Checkpoints(output).delete()
    rows = sum(map(len, tracks))
    count = "one throw" if len(throws) == 1 else f"{len(throws)} throws"
    results.show(result, f"{count} by {len(films)} cameras, {rows} rows: {output}")


def _joined(
    views: Sequence[TrackedFilm], throw: int, *, bridge: bool
) -> tuple[list[Trajectory], list[str | None], list[dict[str, Any]]]:
    """Join all stones of one throw as one camera or several have seen it.

    Returns
    -------
    tracks, the thrown stone's first; colour of the handle of each; the parts for JSON
    """
    from friction_estimation.tracking.stone_numbers import clearer
    from friction_estimation.tracks.camera_fusion import join_cameras as join
    from friction_estimation.tracks.other_stones import other_stones

    result = [{"film": str(one.film), "throw": throw, **one.summary} for one in views]
    first = views[0].thrown
    if len(views) == 1:
        say(f"throw {throw}: only {views[0].name} has seen it")
        return [replace(k, throw=throw) for k in views[0].tracks], views[0].handles, result
    joined = join([one.thrown for one in views])
    begin = views[joined.order[0]]
    offsets = [
        float(shift) + begin.thrown.clock - one.thrown.clock
        for one, shift in zip(views, joined.offset, strict=True)
    ]
    for one, about, offset, sigma in zip(views, result, offsets, joined.offset_sigma, strict=True):
        milliseconds = 1000 * sigma
        say(
            f"{one.name}: {offset:+.3f} s ± {milliseconds:.0f} ms on the clock of {begin.film.name}"
        )
        about |= {"offset_s": offset, "offset_sigma_s": float(sigma)}
    others = other_stones([one.tracks[1:] for one in views], joined)
    # All throws are on the clock of the camera that is named first.
    shift = float(joined.offset[0]) + begin.thrown.clock - first.clock
    clock = round(begin.thrown.clock - shift, 3)
    stones = [joined.whole if bridge else joined.trajectory, *(track for track, _ in others)]
    # The clearest view of a handle decides its colour.
    handles = [reduce(clearer, [one.handles[0] for one in views])]
    handles += [views[camera].handles[1 + number] for _, (camera, number) in others]
    return [replace(track, throw=throw, clock=clock) for track in stones], handles, result
