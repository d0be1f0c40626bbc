"""`curling discover`: from tracks to what the model of the ice lacks."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from curling_env.commands.cli import (
    JsonOption,
    OutputDirectory,
    SeedOption,
    UnitsOption,
    conclude,
    progress_bar,
    say,
)
from curling_env.units import Units


def discover(
    tracks: Annotated[Path, typer.Argument(metavar="TRACKS.csv", help="Measured throws.")],
    output: OutputDirectory,
    ice: Annotated[
        str | None,
        typer.Option(
            "--ice",
            metavar="BASE",
            help="The model to improve: an ice file or a preset. Uniform friction without it.",
        ),
    ] = None,
    scene: Annotated[
        Path | None,
        typer.Option(
            metavar="SCENE.json",
            help="The scene the tracks were filmed with: a wrong lens is then sought in its image.",
        ),
    ] = None,
    known_length: Annotated[
        list[str] | None,
        typer.Option(
            metavar="MEASURED,TRUE[,ERROR]",
            help="A length in m as these tracks have it, and as it is; may be given again.",
        ),
    ] = None,
    clock: Annotated[
        list[str] | None,
        typer.Option(
            metavar="MEASURED,TRUE[,ERROR]",
            help="An interval in s as these tracks have it, and by a clock; may be given again.",
        ),
    ] = None,
    units: UnitsOption = Units.METRES,
    seed: SeedOption = 0,
    as_json: JsonOption = False,
) -> None:
    """Find what a model of the ice lacks, name it, add it, and show the gap shrink.

    The model is first fitted to the measured throws. Where they still disagree, every known
    effect of the ice and of the camera is tried; one is named only if the throws prove it one by
    one, it closes the gap, and nothing but noise is left. What no effect explains is reported as
    unknown, with the variables it follows. Fewer than 8 throws name nothing; 16 throws in both
    directions, with both spins and speeds from draw to take-out, make a good session.

    That all lengths or all times are off by a factor cannot be seen in throws: friction absorbs
    it. A length on the ice (hog line to hog line is 21.945 m) or an interval by a stopwatch
    decides it; the tracks are corrected by what is given before anything else is asked.

    DIR receives report.html (look at this one), report.json, baseline.json (the fitted model)
    and ice.json (the improved one), which every other command takes as --ice. With the extra
    `science` it also receives posterior.nc: draws of all that is uncertain, for ArviZ or xarray.

    \b
    Example:
        curling discover tracks.csv -o runs/discover
        curling discover tracks.csv --ice runs/discover/ice.json -o runs/again
        curling discover tracks.csv --known-length 21.31,21.945 --clock 20.1,24.3 -o runs/checked
    """
    import numpy as np

    from curling_env.ice import load_ice
    from curling_env.infrastructure.files.storage import make_directory, together
    from curling_env.infrastructure.provenance import provenance
    from friction_estimation.camera.scene import load_scene
    from friction_estimation.discovery.assessment import assess
    from friction_estimation.discovery.data.references import (
        QuantityError,
        calibrate,
        read_reference,
    )
    from friction_estimation.discovery.discover import discover as find
    from friction_estimation.discovery.evidence.posterior import draw_posterior
    from friction_estimation.discovery.posterior_file import can_write_posterior, write_posterior
    from friction_estimation.discovery.report import write_files
    from friction_estimation.reports.discovery_page import write_report_page
    from friction_estimation.reports.throws_section import throws_section
    from friction_estimation.tracks.throw_list import load_tracks, throws_beside
    from friction_estimation.tracks.throw_table import throw_table

    given: dict[QuantityError, list[str]] = {
        "scale_error": known_length or [],
        "frame_rate_error": clock or [],
    }
    references = [
        calibrate(name, [read_reference(text, name) for text in texts])
        for name, texts in given.items()
        if texts
    ]
    measured = load_tracks(tracks)
    view = load_scene(scene) if scene is not None else None
    base = load_ice(ice) if ice is not None else None
    origin = provenance([tracks, ice, scene], seed=seed)
    folder = make_directory(output)
    with progress_bar() as progress:
        found = find(
            measured, base, scene=view, references=references, seed=seed, progress=progress
        )
    assessment = assess(found)
    names = ["report.html", "report.json", "baseline.json", "ice.json"]
    with together():
        report = write_files(found, folder, assessment=assessment, provenance=origin)
        throws = throw_table(measured)
        table = throws_section(throws, units, throws_beside(tracks)) if throws else ""
        write_report_page(found, report, folder / "report.html", throws=table, units=units)
        if can_write_posterior():
            drawn = draw_posterior(found.final, np.random.default_rng(seed))
            write_posterior(drawn, found.final, folder / "posterior.nc", provenance=origin)
            names.append("posterior.nc")
    if "posterior.nc" not in names:
        say("no posterior.nc: that needs pip install 'curling-sheet[science]'")
    for reason in found.session.left_out:
        say(f"left out: {reason}")
    say(f"{folder}: {', '.join(names)}")
    told = {key: report[key] for key in ("verdict", "effects", "gap", "next_throws")}
    conclude(told, str(report["verdict"]), as_json=as_json)
