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
    conclude,
    progress_bar,
    say,
)
from curling_env.errors import InputError
from curling_env.units import Units
from friction_estimation.commands.track import (
    CameraOption,
    TrackerOption,
    describe,
)

if TYPE_CHECKING:
    from curling_env.ice import Ice
    from curling_env.trajectory import Trajectory
    from friction_estimation.inversion import StoredInformation
    from friction_estimation.reports.estimate_page import Still
    from friction_estimation.tracking.resume import Checkpoints


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
    on = "on"
    off = "off"


def estimate(
    inputs: Annotated[
        list[Path],
        typer.Argument(metavar="TRACKS.csv|VIDEO...", help="One tracks file, or films."),
    ],
    output: Annotated[
        Path, typer.Option("-o", "--output", metavar="ICE.json", help="The ice file to write.")
    ],
    scene: Annotated[
        list[Path] | None,
        typer.Option(
            metavar="SCENE.json",
            help="Where the camera sees the sheet; for films: one for all, or one for each.",
        ),
    ] = None,
    camera: CameraOption = None,
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
            help="The ice of another day: its pattern is expected within its sigma, its level not.",
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
            help="all: the map and the effects of the ice together; none: the map alone, the "
            "effects of the --start ice being known."
        ),
    ] = EffectsOption.all,
    camera_bias: Annotated[
        CameraBiasOption,
        typer.Option(
            "--camera-bias",
            help="Also fit a smooth error of the camera along the sheet: where the throws clearly "
            "show one (auto), wherever they could (on), or never (off).",
        ),
    ] = CameraBiasOption.auto,
    report: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Also write a page, pictures and tables here."),
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

    The map alone: with --effects none the effects of the --start ice stay as they are, and only
    friction is estimated. So it is with --uniform, --prior, --camera-bias and --method paper.

    Later throws: the command writes ice.evidence.npz beside the ice, and --update uses it to add
    later throws of the same session without the earlier tracks. --prior starts from the ice of
    another day: where no stone ran today, its pattern stays, with a sigma that has grown by the
    change seen elsewhere.

    Camera: an error of some millimetres that varies smoothly along the sheet and is the same for
    all throws looks like uneven ice, and more throws do not average it away. Throws in both
    directions, or at clearly different speeds, tell it from the ice. Where the map alone is
    estimated, --camera-bias says whether it is sought; the JSON says what was found, and how large
    an error would have been noticed.

    \b
    Example:
        curling estimate tracks.csv -o ice.json --report runs/report
        curling estimate tracks.csv -o ice.json --uniform
        curling estimate tracks.csv --start standard --effects none -o ice.json
        curling estimate later.csv --update ice.json -o ice.json
        curling estimate end-0.mp4 end-1.mp4 --scene end.scene.json -o ice.json
    """
    import numpy as np

    from curling_env.ice import save_ice
    from curling_env.infrastructure.provenance import provenance
    from curling_env.infrastructure.storage import make_directory
    from friction_estimation.discovery.data.evidence_file import save_evidence, with_later_throws
    from friction_estimation.discovery.evidence.posterior import draw_posterior
    from friction_estimation.discovery.posterior_file import can_write_posterior, write_posterior
    from friction_estimation.discovery.whole_ice import WholeIce, estimate_ice
    from friction_estimation.inversion import estimate_friction
    from friction_estimation.inversion.friction.information import (
        information_path,
        save_information,
    )
    from friction_estimation.reports.estimate_page import headline, write_report
    from friction_estimation.tracks.throw_list import NO_NOTES, load_tracks, throws_beside

    first, stored, throws_before = _earlier_ice(start, prior, update)
    earlier = None if update is None else information_path(update)
    tables = [path for path in inputs if path.suffix.lower() == ".csv"]
    if tables and len(inputs) > 1:
        raise InputError("give one tracks file, or films, not both or several", source=inputs[1])
    stills: list[Still] = []
    notes = NO_NOTES
    checkpoints: Checkpoints | None = None
    if tables:
        if scene or camera:
            source = "--scene" if scene else "--camera"
            raise InputError("a scene and a camera belong to films, not to tracks", source=source)
        tracks, notes = load_tracks(inputs[0]), throws_beside(inputs[0])
    else:
        if not scene:
            raise InputError(
                "a film needs the scene of its camera: --scene SCENE.json "
                "(a tracks file ends in .csv)",
                source=inputs[0],
            )
        films_shown = 0 if report is None else FILMS_SHOWN
        tracks, stills, checkpoints = _track(inputs, scene, camera, tracker, output, films_shown)
    origin = provenance([*inputs, *(scene or []), camera, start, prior, update, earlier], seed=seed)
    map_alone = (
        effects is EffectsOption.none
        or uniform
        or stored is not None
        or prior is not None
        or method is not MethodChoice.trajectory
        or camera_bias is not CameraBiasOption.auto
    )
    if throws_before:
        if map_alone:
            raise InputError("these throws were fitted with effects: update them with effects too")
        tracks, remarks = with_later_throws(throws_before, tracks)
        for remark in remarks:
            say(remark)
    with progress_bar() as bar:
        if map_alone:
            found = estimate_friction(
                tracks,
                start=first,
                method=method.value,
                uniform=uniform or (stored is not None and stored.uniform),
                prior=first.friction if prior is not None and first is not None else None,
                update=stored,
                camera_bias=camera_bias.value,
                progress=bar,
            )
        else:
            found = estimate_ice(tracks, start=first, seed=seed, progress=bar)
    save_ice(found.ice, output, provenance=origin)
    if isinstance(found, WholeIce):
        save_evidence(tracks, found.ice, output)
        if report is not None and can_write_posterior():
            fitted = found.discovery.final
            drawn = draw_posterior(fitted, np.random.default_rng(seed))
            target = make_directory(report) / "posterior.nc"
            write_posterior(drawn, fitted, target, provenance=origin)
    elif found.information is not None:
        save_information(found.information, information_path(output))
    if report is not None:
        folder = make_directory(report)
        names = write_report(found, folder, stills, provenance=origin, units=units, notes=notes)
        say(f"{folder}: {', '.join(names)}")
    search = found.bias_search
    if search is not None and (search.outcome == "found" or camera_bias == CameraBiasOption.on):
        say(search.words)
    for reason in found.skipped:
        say(f"left out: {reason}")
    if checkpoints is not None:
        checkpoints.delete()
    conclude(found.summary(), headline(found), as_json=as_json)


def _earlier_ice(
    start: str | None, prior: str | None, update: Path | None
) -> tuple[Ice | None, StoredInformation | None, list[Trajectory]]:
    """The ice to start from, and its throws or their information if they are to be added to."""
    from curling_env.ice import Ice, load_ice
    from friction_estimation.discovery.data.evidence_file import load_evidence
    from friction_estimation.inversion.friction.information import load_information

    given = [name for name in (start, prior, update) if name is not None]
    if len(given) > 1:
        raise InputError("give one of --start, --prior and --update")
    ice = load_ice(given[0]) if given else None
    if update is None or ice is None:
        return ice, None, []
    throws = load_evidence(ice, update)
    if throws is None:
        return ice, load_information(ice, update), []
    # What the earlier throws say of effects comes from the throws themselves, once.
    return Ice.uniform(0.0082, ice.sheet), None, throws


def _track(
    films: list[Path],
    scenes: list[Path],
    camera: Path | None,
    tracker: str,
    output: Path,
    films_shown: int,
) -> tuple[list[Trajectory], list[Still], Checkpoints]:
    """The tracks of films, frames of the first ones for the report, and the checkpoints."""
    import cv2

    from friction_estimation.camera.scene import load_scene
    from friction_estimation.reports.estimate_page import Still
    from friction_estimation.tracking import load_tracker, track_each
    from friction_estimation.tracking.overlay import draw_stills as stills_of
    from friction_estimation.tracking.resume import Checkpoints

    cv2.setNumThreads(1)
    known = [load_scene(path, camera) for path in scenes]
    checkpoints = Checkpoints(output)
    tracks: list[Trajectory] = []
    stills: list[Still] = []
    with progress_bar("frame") as bar:
        tracked = track_each(
            films,
            known,
            tracker=load_tracker(tracker),
            checkpoints=checkpoints,
            always_track=films_shown,
            progress=bar,
        )
        for i, film in enumerate(tracked):
            tracks += film.tracks
            say(f"{film.film.name}: {describe(film)}")
            if i < films_shown and film.found is not None:
                scene = known[i % len(known)]
                shown = stills_of(film.film, scene, film.found)
                stills += [Still.of(film.film.name, t, image) for t, image in shown]
    return tracks, stills, checkpoints
