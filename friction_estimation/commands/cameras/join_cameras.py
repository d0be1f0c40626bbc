"""`curling join-cameras`: films of one throw by several cameras to one track."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from curling_env.commands.cli import JsonOption, TracksFile, conclude, progress_bar, say
from curling_env.errors import InputError, NoThrowError
from friction_estimation.commands.track import (
    CameraOption,
    HeightOption,
    RefineOption,
    SlowOption,
    TrackerOption,
    choose_tracker,
    describe,
)

if TYPE_CHECKING:
    from curling_env.trajectory import Trajectory
    from friction_estimation.tracking import TrackedFilm


def join_cameras(
    films: Annotated[
        list[Path],
        typer.Argument(
            metavar="VIDEO VIDEO...", help="Films of the same throw or practice, one per camera."
        ),
    ],
    scene: Annotated[
        list[Path],
        typer.Option(metavar="SCENE.json", help="Where each camera sees the sheet, in that order."),
    ],
    output: TracksFile = Path("tracks.csv"),
    bridge: Annotated[
        bool,
        typer.Option("--bridge", help="Also write rows for times when no camera saw the stone."),
    ] = False,
    camera: CameraOption = None,
    height: HeightOption = None,
    refine: RefineOption = True,
    slow: SlowOption = None,
    tracker: TrackerOption = "built-in",
    as_json: JsonOption = False,
) -> None:
    """Join films of one throw, by cameras that see a part of the sheet each, to one track.

    Cameras above the two houses, for example. The stone is tracked in each film, as by `curling
    track`. The clocks of the cameras need not agree: the time between them is found from where the
    stone passes from one picture into the next or, where no camera saw it in between, from how a
    stone slides on. Rows of later cameras include the uncertainty of their clocks in sigma_xy.

    Long films are cut into their throws, and throws of different cameras are matched by when they
    were. A throw that a single camera has seen is kept as it is.

    The other stones of a throw are written too, each once, on the same clock. One that slides out
    of one picture and into another one that does not overlap has a track in each.

    With --bridge the gaps are filled with the motion that joins the parts; sigma_xy grows there.

    \b
    Example:
        curling join-cameras home.mp4 mid.mp4 away.mp4 \\
            --scene home.json --scene mid.json --scene away.json -o tracks.csv
    """
    import cv2
    import numpy as np

    from curling_env.infrastructure.files.storage import together
    from curling_env.trajectory import write_tracks
    from friction_estimation.camera.scene import load_scene
    from friction_estimation.tracking import track_each
    from friction_estimation.tracking.films.resume import Checkpoints
    from friction_estimation.tracking.films.shared_cameras import SharedCameras
    from friction_estimation.tracking.stone_numbers import StoneNumbers
    from friction_estimation.tracks.session_pairs import same_throws

    if len(films) < 2:
        raise InputError("give the films of two cameras or more", source="VIDEO...")
    cv2.setNumThreads(1)
    scenes = [load_scene(path, camera, height) for path in scene]
    checkpoints = Checkpoints(output)
    seen: list[list[TrackedFilm]] = [[] for _ in films]
    with together(), progress_bar("frame") as bar:
        for one in track_each(
            films,
            scenes,
            tracker=choose_tracker(tracker, refine=refine, slow=slow),
            checkpoints=checkpoints,
            cameras=SharedCameras(keep=True),
            left_out=lambda why: say(f"left out: {why}"),
            progress=bar,
        ):
            say(f"{one.name}: {describe(one)}")
            seen[films.index(one.film)].append(one)
    for film, throws_seen in zip(films, seen, strict=True):
        if not throws_seen:
            raise NoThrowError("no thrown stone found", source=film)
    clocks = [np.array([one.thrown.clock for one in camera]) for camera in seen]
    tracks: list[Trajectory] = []
    result: list[dict[str, object]] = []
    numbers, throws = StoneNumbers(), 0
    for throw, which in enumerate(same_throws(clocks)):
        views = [camera[k] for camera, k in zip(seen, which, strict=True) if k is not None]
        stones, handles, joined = _joined(views, throw, bridge=bridge)
        given = numbers.of(stones, handles)
        tracks += [replace(k, stone=n) for k, n in zip(stones, given, strict=True)]
        result += joined
        throws = throw + 1
    write_tracks(output, tracks)
    checkpoints.delete()
    rows = sum(map(len, tracks))
    count = "one throw" if throws == 1 else f"{throws} throws"
    conclude(result, f"{count} by {len(films)} cameras, {rows} rows: {output}", as_json=as_json)


def _joined(
    views: Sequence[TrackedFilm], throw: int, *, bridge: bool
) -> tuple[list[Trajectory], list[str | None], list[dict[str, object]]]:
    """All stones of one throw that several cameras have seen, or one, and how they were joined.

    Returns
    -------
    tracks, the thrown stone's first; colour of the handle of each; the parts for JSON
    """
    from friction_estimation.tracks.camera_fusion import join_cameras as join
    from friction_estimation.tracks.other_stones import other_stones

    first = views[0].thrown
    if len(views) == 1:
        say(f"throw {throw}: only {views[0].name} has seen it")
        alone = {"film": str(views[0].film), "throw": throw, **views[0].summary}
        return [replace(k, throw=throw) for k in views[0].tracks], views[0].handles, [alone]
    joined = join([one.thrown for one in views])
    result: list[dict[str, object]] = []
    begin = views[joined.order[0]]
    for one, shift, sigma in zip(views, joined.offset, joined.offset_sigma, strict=True):
        offset = float(shift) + begin.thrown.clock - one.thrown.clock
        say(
            f"{one.name}: {offset:+.3f} s ± {1000 * sigma:.0f} ms on the clock of {begin.film.name}"
        )
        result.append(
            {
                "film": str(one.film),
                "throw": throw,
                **one.summary,
                "offset_s": offset,
                "offset_sigma_s": float(sigma),
            }
        )
    others = other_stones([one.tracks[1:] for one in views], joined)
    # All throws are on the clock of the camera that is named first.
    shift = float(joined.offset[0]) + begin.thrown.clock - first.clock
    clock = round(begin.thrown.clock - shift, 3)
    stones = [joined.whole if bridge else joined.trajectory, *(track for track, _ in others)]
    handles = [_handle([one.handles[0] for one in views])]
    handles += [views[camera].handles[1 + number] for _, (camera, number) in others]
    return [replace(track, throw=throw, clock=clock) for track in stones], handles, result


def _handle(seen: Sequence[str | None]) -> str | None:
    """The handle of a stone as the camera sees it that shows its colour most clearly."""
    from functools import reduce

    from friction_estimation.tracking.stone_numbers import clearer

    return reduce(clearer, seen)
