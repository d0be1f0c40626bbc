"""`curling join-cameras`: films of one throw by several cameras to one track."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from curling_env.commands.cli import JsonOption, OutputFile, conclude, progress_bar, say
from curling_env.errors import InputError
from friction_estimation.commands.track import (
    CameraOption,
    RefineOption,
    TrackerOption,
    choose_tracker,
    describe,
)

if TYPE_CHECKING:
    from friction_estimation.tracking import TrackedFilm


def join_cameras(
    films: Annotated[
        list[Path],
        typer.Argument(metavar="VIDEO VIDEO...", help="Films of the same throw, one per camera."),
    ],
    scene: Annotated[
        list[Path],
        typer.Option(metavar="SCENE.json", help="Where each camera sees the sheet, in that order."),
    ],
    output: OutputFile = Path("tracks.csv"),
    bridge: Annotated[
        bool,
        typer.Option("--bridge", help="Also write rows for times when no camera saw the stone."),
    ] = False,
    camera: CameraOption = None,
    refine: RefineOption = True,
    tracker: TrackerOption = "built-in",
    as_json: JsonOption = False,
) -> None:
    """Join films of one throw, by cameras that see a part of the sheet each, to one track.

    Cameras above the two houses, for example. The stone is tracked in each film, as by `curling
    track`. The clocks of the cameras need not agree: the time between them is found from where the
    stone passes from one picture into the next or, where no camera saw it in between, from how a
    stone slides on. Rows of later cameras include the uncertainty of their clocks in sigma_xy.

    With --bridge the gaps are filled with the motion that joins the parts; sigma_xy grows there.

    \b
    Example:
        curling join-cameras home.mp4 mid.mp4 away.mp4 \\
            --scene home.json --scene mid.json --scene away.json -o tracks.csv
    """
    import cv2

    from curling_env.trajectory import write_tracks
    from friction_estimation.camera.scene import load_scene
    from friction_estimation.tracking import track_each
    from friction_estimation.tracking.resume import Checkpoints
    from friction_estimation.tracks.camera_fusion import join_cameras as join

    if len(films) < 2:
        raise InputError("give the films of two cameras or more", source="VIDEO...")
    cv2.setNumThreads(1)
    scenes = [load_scene(path, camera) for path in scene]
    checkpoints = Checkpoints(output)
    tracked: list[TrackedFilm] = []
    with progress_bar("frame") as bar:
        for one in track_each(
            films,
            scenes,
            throws=[0] * len(films),
            tracker=choose_tracker(tracker, refine=refine),
            checkpoints=checkpoints,
            progress=bar,
        ):
            say(f"{one.film.name}: {describe(one)}")
            tracked.append(one)
    joined = join([one.thrown for one in tracked])
    result: list[dict[str, object]] = []
    reference = tracked[joined.order[0]].film.name
    for one, offset, sigma in zip(tracked, joined.offset, joined.offset_sigma, strict=True):
        say(f"{one.film.name}: {offset:+.3f} s ± {1000 * sigma:.0f} ms on the clock of {reference}")
        result.append(
            {
                "film": str(one.film),
                "throw": 0,
                **one.summary,
                "offset_s": float(offset),
                "offset_sigma_s": float(sigma),
            }
        )
    write_tracks(output, [joined.whole if bridge else joined.trajectory])
    checkpoints.delete()
    seen = joined.whole if bridge else joined.trajectory
    words = f"one throw by {len(tracked)} cameras, {len(seen)} rows: {output}"
    conclude(result, words, as_json=as_json)
