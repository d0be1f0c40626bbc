"""`curling live`: tracks and ice from a running camera."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from typer import Argument, Option

from curling_env.commands.options import OUTPUT, Measured, TracksFile, grouped
from curling_env.commands.outputs import Writes
from curling_env.commands.terminal import print_remark
from curling_env.errors import InputError
from friction_estimation.commands.film_options import SCENE, Viewing

if TYPE_CHECKING:
    from curling_env.trajectory import Trajectory

report_now = partial(print_remark, now=True)
"""Report each throw immediately, for people who watch the game."""


@grouped
def live(
    source: Annotated[str, Argument(metavar="CAMERA|URL", help="Camera index or stream URL.")],
    scene: Annotated[Path, SCENE],
    output: TracksFile = Path("tracks.csv"),
    report: Annotated[
        Path | None,
        Option(
            metavar="DIR",
            help="Folder for a self-reloading page of the ice.",
            rich_help_panel=OUTPUT,
        ),
        Writes(folder=True),
    ] = None,
    throws: Annotated[int | None, Option(min=1, help="Number of throws to record.")] = None,
    keep: Annotated[
        Path | None,
        Option(
            metavar="DIR",
            help="Folder for the films; by default next to -o.",
            rich_help_panel=OUTPUT,
        ),
        Writes(folder=True),
    ] = None,
    *,
    viewing: Viewing,
    results: Measured,
) -> None:
    """Track throws from a camera or a stream as they are played.

    \b
    Examples:
        curling live 0 --scene end.scene.json -o tracks.csv --report ice
        curling live rtsp://192.168.1.20/stream --scene end.scene.json --throws 16

    Every throw is recorded as a separate film, tracked immediately and added to the tracks file,
    and the friction from all throws up to then is reported. Ctrl-C ends the recording; throws that
    are already recorded are still tracked. See docs/tracking.md.
    """
    from tqdm import tqdm

    from curling_env.infrastructure.files.writing import make_directory
    from curling_env.trajectory import write_tracks
    from friction_estimation.camera.pose import camera_from_scene
    from friction_estimation.film.video import is_stream
    from friction_estimation.live import TrackedClip, follow_stream, open_feed
    from friction_estimation.tracking import load_tracker

    if not is_stream(source):
        raise InputError("is a film, not a camera; use `curling track`", source=source)
    (where,) = viewing.scenes([scene])
    function = load_tracker(viewing.tracker)
    feed = open_feed(source)
    # refuses the scene of another camera before the recording starts
    camera_from_scene(where, feed.size)
    folder = make_directory(output.with_suffix("") if keep is None else keep)
    page = None if report is None else make_directory(report)
    tracks: list[Trajectory] = []
    thrown: list[Trajectory] = []
    report_now(f"watching {source}; films are kept in {folder}; press Ctrl-C to end")
    if page is not None:
        report_now(f"{page / 'report.html'} shows the current ice from the first throw on")
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
            units=results.units,
            tracker=function,
            on_frame=count,
        ):
            if not isinstance(news, TrackedClip):
                report_now(f"current ice: {news.words}")
                continue
            name = news.clip.path.name
            if news.clip.missing:
                report_now(f"{name}: {news.clip.missing} frames lost")
            if news.tracks:
                tracks += news.tracks
                thrown.append(news.tracks[0])
                write_tracks(output, tracks)
            report_now(f"{name}: {news.in_words(results.units)}")
    results.show(
        [
            {"throw": k.throw, "clock": k.clock, "tracked": len(k), "to_s": float(k.t[-1])}
            for k in thrown
        ],
        f"stopped watching {source}; {len(thrown)} throws",
    )
