"""`curling join-cameras`: one track from films of one throw by several cameras."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from typer import Argument, Option

from curling_env.commands.options import OUTPUT, Results, TracksFile, grouped
from curling_env.commands.terminal import print_remark, progress_bar
from curling_env.errors import InputError, NoThrowError
from friction_estimation.commands.film_options import SCENE, Tracking

if TYPE_CHECKING:
    from curling_env.trajectory import Trajectory
    from friction_estimation.tracking import TrackedFilm


@grouped
def join_cameras(
    films: Annotated[list[Path], Argument(metavar="VIDEO VIDEO...", help="One film per camera.")],
    scene: Annotated[list[Path], SCENE],
    output: TracksFile = Path("tracks.csv"),
    bridge: Annotated[bool, Option("--bridge", help="Fill gaps.", rich_help_panel=OUTPUT)] = False,
    *,
    tracking: Tracking,
    results: Results,
) -> None:
    """Join films of one throw by cameras that each see a part of the sheet.

    \b
    Example:
        curling join-cameras home.mp4 mid.mp4 away.mp4 \\
            --scene home.json --scene mid.json --scene away.json -o tracks.csv

    The stone is tracked in each film, as by `curling track`. The clocks of the cameras need not
    agree: they are synchronised by the stone's passage from one picture to the next or, across a
    gap, by its deceleration; sigma_xy includes the uncertainty. Long films are cut into throws,
    which are matched by their times. Other stones are joined too. See docs/tracking.md.
    """
    import numpy as np

    from curling_env.infrastructure.files.writing import together
    from curling_env.trajectory import write_tracks
    from friction_estimation.tracking.films.joined import join_views
    from friction_estimation.tracking.films.resume import Checkpoints
    from friction_estimation.tracking.stone_numbers import StoneNumbers
    from friction_estimation.tracks.session_pairs import same_throws

    if len(set(films)) < max(2, len(films)):
        raise InputError("expected the films of two or more cameras", source="VIDEO...")
    seen: dict[Path, list[TrackedFilm]] = {film: [] for film in films}
    with together(), progress_bar("frame") as bar:
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
        joined = join_views(views, throw, bridge=bridge, remark=print_remark)
        given = numbers.of(joined.tracks, joined.handles)
        tracks += [replace(k, stone=n) for k, n in zip(joined.tracks, given, strict=True)]
        result += joined.views
    write_tracks(output, tracks)
    Checkpoints(output).delete()
    rows = sum(map(len, tracks))
    count = "one throw" if len(throws) == 1 else f"{len(throws)} throws"
    results.show(result, f"{count} by {len(films)} cameras, {rows} rows: {output}")
