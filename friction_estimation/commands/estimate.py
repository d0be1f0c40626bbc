"""`curling estimate`: from tracks or films to the friction of the ice."""

from __future__ import annotations

import sys
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any

import typer

from curling_env.cli import OutputFile, print_json, progress, say
from curling_env.errors import InputError


class ProgressBar:
    """A bar on stderr for work that knows what part of it is done."""

    def __init__(self) -> None:
        self._bar: Any = None

    def __enter__(self) -> ProgressBar:
        return self

    def __exit__(self, *_: object) -> None:
        if self._bar is not None:
            self._bar.close()

    def show(self, what: str, part: float) -> None:
        """Move the bar to a part, 0 to 1, of what is being done."""
        if self._bar is None:  # bad input is refused before any bar appears
            from tqdm import tqdm

            self._bar = tqdm(total=100, unit="%", leave=False, file=sys.stderr)
        self._bar.set_description(what, refresh=False)
        self._bar.n = round(100 * part)
        self._bar.refresh()


class MethodChoice(StrEnum):
    """How friction is found."""

    trajectory = "trajectory"
    paper = "paper"


def estimate(
    inputs: Annotated[
        list[Path],
        typer.Argument(metavar="TRACKS.csv|VIDEO...", help="One tracks file, or films."),
    ],
    output: OutputFile,
    scene: Annotated[
        Path | None, typer.Option(metavar="SCENE.json", help="The camera's scene; for films.")
    ] = None,
    uniform: Annotated[
        bool, typer.Option("--uniform", help="One number for the sheet instead of a map.")
    ] = False,
    method: Annotated[
        MethodChoice,
        typer.Option(help="trajectory: joint fit of all throws; paper: differentiate, average."),
    ] = MethodChoice.trajectory,
    start: Annotated[
        str | None,
        typer.Option(
            metavar="ICE",
            help="Ice whose sheet, stone and effects (curl, slope, ...) are kept in the law.",
        ),
    ] = None,
    report: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Also write pictures and tables here.")
    ] = None,
) -> None:
    """Estimate how slippery the ice is, cell by cell, from throws that were measured.

    Give the tracks that `curling track` wrote, or the films themselves with --scene. Only the
    free slide of each throw counts: the player's lead-in, the stone at rest and wild rows are
    found and left out. All throws are fitted at once; each cell receives mu and its standard
    error sigma, and cells that no stone crossed are marked as not observed.

    The numbers appear as JSON on stdout: mu is the level of the sheet, with the interval low to
    high that holds it with 95 % probability. The ice file serves wherever ICE is asked for.

    Throws at several speeds, in both directions and on several lines tell the most.

    \b
    Example:
        curling estimate tracks.csv -o ice.json --report runs/report
        curling estimate tracks.csv -o ice.json --uniform
        curling estimate end-0.mp4 end-1.mp4 --scene end.scene.json -o ice.json
    """
    from curling_env.ice import load_ice, save_ice
    from curling_env.storage import make_directory
    from curling_env.trajectory import read_tracks
    from friction_estimation.inversion import estimate_ice

    tables = [path for path in inputs if path.suffix.lower() == ".csv"]
    beginning = None if start is None else load_ice(start)
    if tables and len(inputs) > 1:
        raise InputError("give one tracks file, or films, not both or several", source=inputs[1])
    if tables:
        tracks = read_tracks(inputs[0])
    else:
        if scene is None:
            raise InputError("a film needs the scene of its camera: --scene SCENE.json "
                             "(a tracks file ends in .csv)", source=inputs[0])  # fmt: skip
        import cv2

        from friction_estimation.scene import load_scene
        from friction_estimation.tracking import track_films

        cv2.setNumThreads(1)
        tracks = track_films(
            inputs,
            load_scene(scene),
            progress=lambda frames, total: progress(frames, "track", total=total, unit="frame"),
        )
    with ProgressBar() as bar:
        found = estimate_ice(
            tracks, start=beginning, method=method.value, uniform=uniform, progress=bar.show
        )
    save_ice(found.ice, output)
    if report is not None:
        from friction_estimation.report import write_report

        folder = make_directory(report)
        names = write_report(found, folder)
        say(f"{folder}: {', '.join(names)}")
    for reason in found.skipped:
        say(f"left out: {reason}")
    print_json(found.summary())
