"""`curling estimate`: from tracks or films to the friction of the ice."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from curling_env.commands.cli import (
    JsonOption,
    SeedOption,
    UnitsOption,
    Writes,
    conclude,
    progress_bar,
    say,
)
from curling_env.errors import InputError
from curling_env.units import Units
from friction_estimation.commands.track import (
    CameraOption,
    HeightOption,
    SlowOption,
    TrackerOption,
    choose_tracker,
    describe,
)

if TYPE_CHECKING:
    from curling_env.trajectory import Trajectory
    from friction_estimation.camera.scene import Scene
    from friction_estimation.estimation.evidence_file import Choices
    from friction_estimation.reports.estimate_page import Still
    from friction_estimation.tracking import Tracker
    from friction_estimation.tracking.films.resume import Checkpoints


FILMS_SHOWN = 4
"""Films of which the report shows frames; each adds about a megabyte."""


class MethodChoice(StrEnum):
    """How friction is found."""

    trajectory = "trajectory"
    paper = "paper"


class EffectsOption(StrEnum):
    """What is estimated beside the friction map."""

    all = "all"
    none = "none"


class CameraBiasOption(StrEnum):
    """When a bias of the camera is fitted with the map."""

    auto = "auto"
    off = "off"


def estimate(
    inputs: Annotated[
        list[Path],
        typer.Argument(metavar="TRACKS.csv|VIDEO...", help="One tracks file, or films."),
    ],
    output: Annotated[
        Path,
        typer.Option("-o", "--output", metavar="ICE.json", help="The ice file to write."),
        Writes(kinds=("ice",), rewrites=("update",), beside=(".evidence.npz",)),
    ],
    scene: Annotated[
        list[Path] | None,
        typer.Option(
            metavar="SCENE.json",
            help="Where the camera sees the sheet; for films: one for all, or one for each.",
        ),
    ] = None,
    camera: CameraOption = None,
    height: HeightOption = None,
    slow: SlowOption = None,
    tracker: TrackerOption = "built-in",
    uniform: Annotated[
        bool, typer.Option("--uniform", help="Estimate one number for the sheet, not a map.")
    ] = False,
    method: Annotated[
        MethodChoice,
        typer.Option(
            help="trajectory: fit all throws at once; paper: differentiate tracks and average."
        ),
    ] = MethodChoice.trajectory,
    start: Annotated[
        str | None,
        typer.Option(
            metavar="ICE",
            help="An ice whose sheet and stone are kept, and whose effects are expected.",
        ),
    ] = None,
    prior: Annotated[
        str | None,
        typer.Option(
            metavar="ICE",
            help="The ice of another day: its pattern and effects are expected within their sigma, "
            "its level is not.",
        ),
    ] = None,
    update: Annotated[
        Path | None,
        typer.Option(
            metavar="ICE", help="An ice estimated before, to which these throws are added."
        ),
    ] = None,
    effects: Annotated[
        EffectsOption,
        typer.Option(
            help="all: the map and the effects of the ice together; none: the friction alone, the "
            "effects of the --start ice being known."
        ),
    ] = EffectsOption.all,
    camera_bias: Annotated[
        CameraBiasOption,
        typer.Option(
            "--camera-bias",
            help="auto: fit a smooth error of the camera along the sheet too, if the throws "
            "clearly show one; off: never.",
        ),
    ] = CameraBiasOption.auto,
    report: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Also write a page, pictures and tables here."),
        Writes(folder=True),
    ] = None,
    units: UnitsOption = Units.METRES,
    as_json: JsonOption = False,
    seed: SeedOption = 0,
) -> None:
    """Estimate the ice from measured throws: friction cell by cell, curl, and the rest.

    Give the tracks file that `curling track` wrote, or the films themselves with --scene: one throw
    each, in order of play. If tracking many films is interrupted, repeat the command: films that
    were tracked before are not tracked again.

    Only the free slide of each throw is used. The player's lead-in, the stone at rest and wrong
    rows are found and left out; rows.csv of --report says for every row whether it was used, and
    why not. All throws are fitted at once. Each cell gets a friction mu and its standard error
    sigma; cells that no stone crossed are marked as not observed.

    The result is printed as JSON: mu is the level of the sheet, and the interval from low to high
    holds it with 95 % probability. The ice file serves wherever a command asks for ICE.

    Throws at several speeds, in both directions and on several lines tell the most. `curling
    design` says how many are needed.

    Effects: what the ice of every rink has (friction that falls with speed, curl, a drag of the
    spin, the air) is fitted together with the map, about what is usual. With 8 throws or more,
    whatever else they prove is added. Each parameter has a sigma; one that the throws did not
    measure is marked as believed. The effects of a --start ice take the place of the usual ones.
    mu is then the friction at 1 m/s.

    Friction alone: with --effects none the effects of the --start ice stay as they are, and only
    friction is estimated; --uniform makes it one number for the sheet.

    Later throws: the command writes ice.evidence.npz beside the ice, and --update uses it to add
    later throws of the same session without the earlier tracks; what was asked for then is asked
    for again. --prior starts from the ice of another day: where no stone ran today, its pattern
    stays, with a sigma that has grown by the change seen elsewhere.

    Camera: an error of some millimetres that varies smoothly along the sheet and is the same for
    all throws looks like uneven ice, and more throws do not average it away. Throws in both
    directions, or at clearly different speeds, tell it from the ice. The JSON says what was found,
    and how large an error would have been noticed.

    \b
    Example:
        curling estimate tracks.csv -o ice.json --report runs/report
        curling estimate tracks.csv -o ice.json --uniform
        curling estimate tracks.csv --start standard --effects none -o ice.json
        curling estimate later.csv --update ice.json -o ice.json
        curling estimate end-0.mp4 end-1.mp4 --scene end.scene.json -o ice.json
    """
    import numpy as np

    from curling_env.ice import load_ice, save_ice
    from curling_env.infrastructure.files.storage import make_directory, together
    from curling_env.infrastructure.provenance import provenance
    from friction_estimation.camera.scene import load_scene
    from friction_estimation.discovery.evidence.posterior import draw_posterior
    from friction_estimation.discovery.posterior_file import can_write_posterior, write_posterior
    from friction_estimation.estimation.evidence_file import (
        Choices,
        evidence_path,
        load_evidence,
        save_evidence,
        with_later_throws,
    )
    from friction_estimation.estimation.paper_method import estimate_by_paper
    from friction_estimation.estimation.whole_ice import estimate_ice
    from friction_estimation.reports.estimate_page import headline, write_report
    from friction_estimation.tracks.plausible_friction import question_about
    from friction_estimation.tracks.throw_list import NO_NOTES, load_tracks, throws_beside

    if len([name for name in (start, prior, update) if name is not None]) > 1:
        raise InputError("give one of --start, --prior and --update")
    choices = Choices(
        effects=effects.value,
        uniform=uniform,
        camera_bias=camera_bias.value,
        start=None if start is None else load_ice(start),
        prior=None if prior is None else load_ice(prior),
    )
    earlier: list[Trajectory] = []
    if update is not None:
        evidence = load_evidence(load_ice(update), update)
        _check_update(choices, evidence.choices, update)
        earlier, choices = evidence.tracks, evidence.choices
    by_paper = method is MethodChoice.paper
    if by_paper and (prior is not None or update is not None):
        raise InputError("the paper's method knows neither a prior nor an update")
    tables = [path for path in inputs if path.suffix.lower() == ".csv"]
    if tables and len(inputs) > 1:
        raise InputError("give one tracks file, or films, not both or several", source=inputs[1])
    stills: list[Still] = []
    notes = NO_NOTES
    checkpoints: Checkpoints | None = None
    if tables:
        for option, given in (
            ("--scene", scene),
            ("--camera", camera),
            ("--height", height),
            ("--slow", slow),
        ):
            if given:
                raise InputError("belongs to films, not to tracks", source=option)
        tracks, notes = load_tracks(inputs[0]), throws_beside(inputs[0])
    else:
        if not scene:
            raise InputError(
                "a film needs the scene of its camera: --scene SCENE.json "
                "(a tracks file ends in .csv)",
                source=inputs[0],
            )
        films_shown = 0 if report is None else FILMS_SHOWN
        function = choose_tracker(tracker, slow=slow)
        tracks, stills, checkpoints = _track(
            inputs,
            [load_scene(path, camera, height) for path in scene],
            function,
            output,
            films_shown,
        )
    before = None if update is None else evidence_path(update)
    origin = provenance([*inputs, *(scene or []), camera, start, prior, update, before], seed=seed)
    if earlier:
        tracks, remarks = with_later_throws(earlier, tracks)
        for remark in remarks:
            say(remark)
    with progress_bar() as bar:
        if by_paper:
            found = estimate_by_paper(tracks, start=choices.start, uniform=uniform)
        else:
            found = estimate_ice(
                tracks,
                effects=choices.effects,
                start=choices.start,
                uniform=choices.uniform,
                prior=choices.prior,
                camera_bias=choices.camera_bias,
                seed=seed,
                progress=bar,
            )
    names: list[str] = []
    with together():
        save_ice(found.ice, output, provenance=origin)
        if not by_paper:
            save_evidence(tracks, choices, found.ice, output)
        if report is not None:
            folder = make_directory(report)
            if found.discovery is not None and can_write_posterior():
                final = found.discovery.final
                drawn = draw_posterior(final, np.random.default_rng(seed))
                write_posterior(drawn, final, folder / "posterior.nc", provenance=origin)
            names = write_report(found, folder, stills, provenance=origin, units=units, notes=notes)
    if names:
        say(f"{report}: {', '.join(names)}")
    if found.camera_bias is not None and found.camera_bias.found:
        say(found.camera_bias.words)
    for remark in found.remarks:
        say(remark)
    for reason in found.skipped:
        say(f"left out: {reason}")
    if checkpoints is not None:
        checkpoints.delete()
    question = question_about(found.mu)
    if question is not None:
        say(question)
    numbers = {
        **found.summary(),
        **({"throws_before": len(earlier)} if earlier else {}),
        **({} if question is None else {"question": question}),
    }
    conclude(numbers, headline(found), as_json=as_json)


def _check_update(asked: Choices, before: Choices, update: Path) -> None:
    """Refuse choices that differ from those of the estimate that is added to."""
    from friction_estimation.estimation.evidence_file import Choices

    plain = Choices()
    for name, option in (
        ("uniform", "--uniform"),
        ("effects", "--effects"),
        ("camera_bias", "--camera-bias"),
    ):
        now, then = getattr(asked, name), getattr(before, name)
        if now not in (getattr(plain, name), then):
            raise InputError(
                f"this ice was estimated with another {option}, and stays so", source=update
            )


def _track(
    films: list[Path],
    scenes: list[Scene],
    tracker: Tracker,
    output: Path,
    films_shown: int,
) -> tuple[list[Trajectory], list[Still], Checkpoints]:
    """The tracks of films, frames of the first ones for the report, and the checkpoints."""
    import cv2

    from curling_env.infrastructure.files.storage import together
    from friction_estimation.reports.estimate_page import Still
    from friction_estimation.tracking import track_each
    from friction_estimation.tracking.films.resume import Checkpoints
    from friction_estimation.tracking.films.shared_cameras import SharedCameras
    from friction_estimation.tracking.overlay.film import draw_stills as stills_of

    cv2.setNumThreads(1)
    checkpoints = Checkpoints(output)
    tracks: list[Trajectory] = []
    stills: list[Still] = []
    with together(), progress_bar("frame") as bar:
        tracked = track_each(
            films,
            scenes,
            tracker=tracker,
            checkpoints=checkpoints,
            cameras=SharedCameras(keep=True),
            always_track=films_shown,
            left_out=lambda why: say(f"left out: {why}"),
            progress=bar,
        )
        for i, film in enumerate(tracked):
            tracks += film.tracks
            say(f"{film.film.name}: {describe(film)}")
            if i < films_shown and film.found is not None:
                scene = film.scene or scenes[0]
                shown = stills_of(film.shown or film.film, scene, film.found)
                stills += [Still.of(film.film.name, t, image) for t, image in shown]
    return tracks, stills, checkpoints
