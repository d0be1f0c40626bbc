"""`curling live`: tracks and the ice from a camera that is filming now."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from curling_env.commands.cli import (
    JsonOption,
    TracksFile,
    UnitsOption,
    Writes,
    conclude,
    say,
)
from curling_env.errors import InputError
from curling_env.units import Units
from friction_estimation.commands.track import CameraOption, HeightOption, TrackerOption

if TYPE_CHECKING:
    from curling_env.trajectory import Trajectory


tell = partial(say, now=True)
"""Whoever watches a game wants each throw as it comes."""


def live(
    source: Annotated[
        str,
        typer.Argument(
            metavar="CAMERA|URL",
            help="Number of a camera on this computer (0 is the first), or address of a stream.",
        ),
    ],
    scene: Annotated[
        Path, typer.Option(metavar="SCENE.json", help="Where the camera sees the sheet.")
    ],
    output: TracksFile = Path("tracks.csv"),
    report: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR", help="Write a page that shows the ice so far and reloads itself."
        ),
        Writes(folder=True),
    ] = None,
    throws: Annotated[int | None, typer.Option(min=1, help="End after this many throws.")] = None,
    keep: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Where the films of the throws go; else beside -o."),
        Writes(folder=True),
    ] = None,
    camera: CameraOption = None,
    height: HeightOption = None,
    tracker: TrackerOption = "built-in",
    units: UnitsOption = Units.METRES,
    as_json: JsonOption = False,
) -> None:
    """Track throws from a camera or a stream while they are played.

    Every throw is recorded as a film of its own, which begins when something moves on the ice and
    ends when all has been still for some seconds. As soon as it is over, it is tracked, added to
    the tracks file, and the command says how slippery the ice is according to all throws so far.
    With --report a page shows the map of the ice and follows as throws come.

    Ctrl-C ends the recording; throws that were recorded until then are still tracked. The films
    are kept, so that they can be tracked again with `curling track`.

    \b
    Example:
        curling live 0 --scene end.scene.json -o tracks.csv --report ice
        curling live rtsp://192.168.1.20/stream --scene end.scene.json --throws 16
    """
    from tqdm import tqdm

    from curling_env.infrastructure.files.storage import make_directory
    from curling_env.trajectory import write_tracks
    from friction_estimation.camera.pose import camera_from_scene
    from friction_estimation.camera.scene import load_scene
    from friction_estimation.film.video import is_stream
    from friction_estimation.live import TrackedClip, follow_stream, open_feed
    from friction_estimation.tracking import load_tracker

    if not is_stream(source):
        raise InputError("is a film, not a camera; `curling track` tracks it", source=source)
    where = load_scene(scene, camera, height)
    function = load_tracker(tracker)
    feed = open_feed(source)
    camera_from_scene(where, feed.size)  # the scene of another camera is refused before it watches
    folder = make_directory(output.with_suffix("") if keep is None else keep)
    page = None if report is None else make_directory(report)
    tracks: list[Trajectory] = []
    thrown: list[Trajectory] = []
    tell(f"watching {source}; films are kept in {folder}; Ctrl-C ends it")
    if page is not None:
        tell(f"from the first throw on, {page / 'report.html'} shows the ice so far")
    with tqdm(desc="recorded", unit="frame", leave=False, delay=0.5) as bar:

        def count(waiting: int) -> None:
            bar.set_postfix_str(f"{waiting} to track" if waiting else "", refresh=False)
            bar.update()

        for news in follow_stream(
            feed,
            where,
            folder,
            throws=throws,
            report=page,
            units=units,
            tracker=function,
            on_frame=count,
        ):
            if not isinstance(news, TrackedClip):
                tell(f"the ice so far: {news.words}")
                continue
            name = news.clip.path.name
            if news.clip.missing:
                tell(f"{name}: {news.clip.missing} of its frames never came")
            if not news.tracks:
                tell(f"{name}: {news.reason}")
                continue
            tracks += news.tracks
            thrown.append(news.tracks[0])
            write_tracks(output, tracks)
            tell(f"{name}: {_describe(news.tracks, units)}")
    conclude(
        [
            {"throw": k.throw, "clock": k.clock, "tracked": len(k), "to_s": float(k.t[-1])}
            for k in thrown
        ],
        f"{source} is no longer watched; {len(thrown)} throws",
        as_json=as_json,
    )


def _describe(tracks: tuple[Trajectory, ...], units: Units) -> str:
    """Which throw it was, what it was, and how many other stones were seen."""
    from friction_estimation.reports.throws_section import throw_in_words
    from friction_estimation.tracks.throw_table import throw_table

    stone, *others = tracks
    also = f", and {len(others)} other stones" if others else ""
    words = [throw_in_words(one, units) for one in throw_table(tracks)]
    if words and words[0]:
        return f"throw {stone.throw}, {words[0]}{also}"
    x, y = stone.xy[-1]
    return f"throw {stone.throw}, {len(stone)} rows, last seen at x {x:+.2f}, y {y:+.2f} m{also}"
