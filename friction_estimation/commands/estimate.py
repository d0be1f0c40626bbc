"""`curling estimate`: from tracks or films to the friction of the ice."""

from __future__ import annotations

import sys
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from curling_env.commands.cli import print_json, progress_bar, say
from curling_env.errors import InputError
from friction_estimation.commands.track import TrackerOption

if TYPE_CHECKING:
    from curling_env.trajectory import Trajectory
    from friction_estimation.reports.estimate_page import Still
    from friction_estimation.tracking.resume import Checkpoints


FILMS_SHOWN = 4
"""Films of which the report shows frames; each adds about a megabyte."""


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


class BiasChoice(StrEnum):
    """Whether an error of the camera is fitted with the map."""

    auto = "auto"
    on = "on"
    off = "off"


def estimate(
    inputs: Annotated[
        list[Path] | None,
        typer.Argument(metavar="[TRACKS.csv|VIDEO...]", help="One tracks file, or films."),
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option(
            "-o",
            "--output",
            metavar="ICE.json",
            help="The ice file; with --plan, a file of the planned releases (optional).",
        ),
    ] = None,
    scene: Annotated[
        list[Path] | None,
        typer.Option(
            metavar="SCENE.json",
            help="Where the camera sees the sheet; for films: one for all, or one for each.",
        ),
    ] = None,
    camera: Annotated[
        Path | None,
        typer.Option(
            metavar="CAMERA.json",
            help="Lens from `curling calibrate`, instead of the scene's; for films.",
        ),
    ] = None,
    tracker: TrackerOption = "built-in",
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
    prior: Annotated[
        str | None,
        typer.Option(
            metavar="ICE",
            help="Yesterday's ice: its pattern is believed within its sigma, its level is not.",
        ),
    ] = None,
    update: Annotated[
        Path | None,
        typer.Option(
            metavar="ICE",
            help="An ice estimated before, to which only these new throws are added.",
        ),
    ] = None,
    refit: Annotated[
        bool,
        typer.Option(
            "--refit", help="Fit the strengths of the start's effects too, together with the map."
        ),
    ] = False,
    camera_bias: Annotated[
        BiasChoice,
        typer.Option(
            "--camera-bias",
            help="A ripple of the camera along the sheet: fitted with the map where it is clear "
            "(auto), wherever throws could show one (on), never (off).",
        ),
    ] = BiasChoice.auto,
    report: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Also write a page, pictures and tables here."),
    ] = None,
    plan: Annotated[
        bool,
        typer.Option(
            "--plan", help="Say how many throws of which kind are needed, before any is measured."
        ),
    ] = False,
    resolution: Annotated[float, typer.Option(help="With --plan: detail wanted [m].")] = 2.0,
    precision: Annotated[float, typer.Option(help="With --plan: error of mu wanted [%].")] = 2.0,
    noise: Annotated[
        float, typer.Option(help="With --plan: error of one measured position [m].")
    ] = 0.005,
    fps: Annotated[float, typer.Option(help="With --plan: frames a second.")] = 30.0,
    mu: Annotated[float, typer.Option(help="With --plan: friction that is expected.")] = 0.009,
    spread: Annotated[
        float,
        typer.Option(help="With --plan: how much mu varies over the sheet [%]."),
    ] = 5.0,
    speeds: Annotated[
        str | None,
        typer.Option(
            metavar="V,V...",
            help="With --plan: speeds at the hog line that can be thrown [m/s]; "
            "else around a draw to the tee.",
        ),
    ] = None,
) -> None:
    """Estimate how slippery the ice is, cell by cell, from throws that were measured.

    Give the tracks that `curling track` wrote, or the films themselves with --scene: one throw
    each, in order of play, of one camera or of several. Tracking that was interrupted goes on
    where it was when the command is given again. Only the free slide of each throw counts: the
    player's lead-in, the stone at rest and wild rows are found and left out; rows.csv of --report
    says of every row whether it was used, and why not. All throws are fitted at once; each cell
    receives mu and its standard error sigma, and cells that no stone crossed are marked as not
    observed.

    The numbers appear as JSON on stdout: mu is the level of the sheet, with the interval low to
    high that holds it with 95 % probability. The ice file serves wherever ICE is asked for.

    Beside the ice lies what its throws told, ice.evidence.npz; --update needs it to add later
    throws of the same session at the cost of these alone. --prior starts from an ice of another
    day: where no stone runs today its pattern stays, with a sigma that has grown by what the ice
    is seen to have changed. Both keep the earlier ice's sheet, stone and effects.

    Effects of the --start ice stay as they are. With --refit those that act along the travel
    (friction that follows the speed, air drag, a fall along the sheet) are fitted together with the
    map, so that neither is taken for the other; what acts across it (curl) stays, for a stone is
    followed along the line it was seen to take. A start with an exponent of 0 will do.

    A camera may err by some millimetres that wave along the sheet, the same for every throw; that
    looks like friction that varies, as v squared and with the direction, and no number of throws
    averages it away. Throws both ways, or at speeds well apart, tell it from the ice: where all of
    them show such a ripple clearly, and each half of them the same one, it is fitted with the map.
    The JSON says what came of it, and from what size on a ripple would have been seen.

    Throws at several speeds, in both directions and on several lines tell the most. With --plan,
    and no tracks, the command says how many are needed for the detail and precision wanted: the
    fewest, were every throw to run alike on the same ice, found from the limit that no method can
    beat. -o then receives these throws as releases, for `curling simulate`.

    \b
    Example:
        curling estimate --plan --resolution 2 --precision 1
        curling estimate tracks.csv -o ice.json --report runs/report
        curling estimate tracks.csv -o ice.json --uniform
        curling estimate tracks.csv --start found/ice.json --refit -o ice.json
        curling estimate later.csv --update ice.json -o ice.json
        curling estimate end-0.mp4 end-1.mp4 --scene end.scene.json -o ice.json
    """
    from curling_env.ice import load_ice, save_ice
    from curling_env.storage import make_directory
    from curling_env.trajectory import read_tracks
    from friction_estimation.inversion import estimate_ice
    from friction_estimation.inversion.friction.information import (
        information_path,
        load_information,
        save_information,
    )

    if plan:
        if inputs:
            raise InputError("--plan comes before any measurement: it takes no tracks",
                             source=inputs[0])  # fmt: skip
        _plan(resolution, precision, noise, fps, mu, spread, speeds, start, output)
        return
    if not inputs:
        raise InputError("give a tracks file or films (or --plan, which needs none)")
    if output is None:
        raise InputError("say where the ice is to be written: -o ICE.json")
    tables = [path for path in inputs if path.suffix.lower() == ".csv"]
    earlier = [name for name in (start, prior, update) if name is not None]
    if len(earlier) > 1:
        raise InputError("give one of --start, --prior and --update")
    beginning = load_ice(earlier[0]) if earlier else None
    before = None
    if update is not None and beginning is not None:
        before = load_information(beginning, update)
    if tables and len(inputs) > 1:
        raise InputError("give one tracks file, or films, not both or several", source=inputs[1])
    checkpoints: Checkpoints | None = None
    if tables:
        if scene or camera:
            raise InputError("a scene and a camera belong to films, not to tracks",
                             source="--scene" if scene else "--camera")  # fmt: skip
        tracks, stills = read_tracks(inputs[0]), []
    else:
        if not scene:
            raise InputError("a film needs the scene of its camera: --scene SCENE.json "
                             "(a tracks file ends in .csv)", source=inputs[0])  # fmt: skip
        tracks, stills, checkpoints = _filmed(
            inputs, scene, camera, output, tracker, with_stills=report is not None
        )
    with ProgressBar() as bar:
        found = estimate_ice(
            tracks,
            start=beginning,
            method=method.value,
            uniform=uniform or (before is not None and before.uniform),
            prior=beginning.friction if prior is not None and beginning is not None else None,
            update=before,
            refit=refit,
            camera_bias=camera_bias.value,
            progress=bar.show,
        )
    save_ice(found.ice, output)
    if found.information is not None:
        save_information(found.information, information_path(output))
    if report is not None:
        from friction_estimation.reports.estimate_page import write_report

        folder = make_directory(report)
        names = write_report(found, folder, stills)
        say(f"{folder}: {', '.join(names)}")
    search = found.bias_search
    if search is not None and (search.outcome == "found" or camera_bias == BiasChoice.on):
        say(search.words)
    for reason in found.skipped:
        say(f"left out: {reason}")
    if checkpoints is not None:
        checkpoints.delete()
    print_json(found.summary())


def _filmed(
    films: list[Path],
    scenes: list[Path],
    camera: Path | None,
    output: Path,
    tracker: str,
    *,
    with_stills: bool,
) -> tuple[list[Trajectory], list[Still], Checkpoints]:
    """The tracks of films, frames of them for the report, and what is kept until all is done."""
    import cv2

    from friction_estimation.camera.scene import load_scene
    from friction_estimation.reports.estimate_page import Still
    from friction_estimation.tracking import load_tracker, track_films
    from friction_estimation.tracking.overlay import stills as stills_of
    from friction_estimation.tracking.resume import Checkpoints

    cv2.setNumThreads(1)
    known = [load_scene(path, camera) for path in scenes]
    shown = FILMS_SHOWN if with_stills else 0
    checkpoints = Checkpoints(output)
    tracks: list[Trajectory] = []
    stills: list[Still] = []
    with progress_bar("frame") as bar:
        tracked = track_films(
            films,
            known,
            tracker=load_tracker(tracker),
            checkpoints=checkpoints,
            always_track=shown,
            progress=bar,
        )
        for i, one in enumerate(tracked):
            tracks += one.tracks
            if one.resumed:
                say(f"{one.film.name}: tracked before the interruption")
                continue
            of_frames = "" if one.found is None else f" of {one.found.frame_count}"
            say(f"{one.film.name}: stone seen in {len(one.thrown)}{of_frames} frames")
            if i < shown and one.found is not None:
                pictures = stills_of(one.film, known[i if len(known) > 1 else 0], one.found)
                stills += [Still.of(one.film.name, t, image) for t, image in pictures]
    return tracks, stills, checkpoints


def _plan(
    resolution: float,
    precision: float,
    noise: float,
    fps: float,
    mu: float,
    spread: float,
    speeds: str | None,
    start: str | None,
    output: Path | None,
) -> None:
    """`--plan`: which throws to make."""
    from curling_env.ice import load_ice
    from curling_env.sheet import PAPER_SHEET
    from curling_env.throw import write_releases
    from friction_estimation.inversion.design.design import design_throws

    with ProgressBar() as bar:
        found = design_throws(
            resolution=resolution,
            precision=precision / 100,
            noise=noise,
            fps=fps,
            mu=mu,
            spread=spread / 100,
            speeds=None if speeds is None else _numbers(speeds),
            sheet=PAPER_SHEET if start is None else load_ice(start).sheet,
            progress=bar.show,
        )
    if output is not None:
        write_releases(output, [kind.release for kind in found.kinds])
    say(found.words)
    print_json(found.summary())


def _numbers(text: str) -> list[float]:
    try:
        return [float(part) for part in text.split(",")]
    except ValueError:
        raise InputError(
            f"--speeds takes numbers with commas between, like 1.6,2.2, got {text!r}"
        ) from None
