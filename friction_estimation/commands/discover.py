"""`curling discover`: effects that a model of the ice lacks, from tracks."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from typer import Argument, Option

from curling_env.commands.options import Measured, OutputDirectory, SeedOption, grouped
from curling_env.commands.terminal import print_remark, progress_bar

if TYPE_CHECKING:
    from friction_estimation.discovery.data.references import QuantityError

References = list[str] | None
REFERENCE = "MEASURED,TRUE[,ERROR]"


@grouped
def discover(
    tracks: Annotated[Path, Argument(metavar="TRACKS.csv", help="Measured throws.")],
    output: OutputDirectory,
    ice: Annotated[str | None, Option("--ice", metavar="BASE", help="Model to improve.")] = None,
    scene: Annotated[Path | None, Option(metavar="SCENE.json", help="Scene of the tracks.")] = None,
    known_length: Annotated[References, Option(metavar=REFERENCE, help="Known length [m].")] = None,
    clock: Annotated[References, Option(metavar=REFERENCE, help="Known interval [s].")] = None,
    seed: SeedOption = 0,
    *,
    results: Measured,
) -> None:
    """Find and name the effects that a model of the ice lacks, and add them.

    \b
    Examples:
        curling discover tracks.csv -o runs/discover
        curling discover tracks.csv --ice runs/discover/ice.json -o runs/again
        curling discover tracks.csv --known-length 21.31,21.945 --clock 20.1,24.3 -o runs/checked

    An effect of the ice or the camera is named only if the throws prove it, it closes the gap, and
    only noise is left; other residuals are reported as unknown. At least 8 throws are needed; 16 in
    both directions, with both spins and all weights, make a good session. Known lengths (hog line
    to hog line is 21.945 m) or intervals correct the tracks first: MEASURED is the value in the
    tracks.

    DIR receives report.html (start here), report.json, baseline.json (the fitted model) and
    ice.json (the improved one, for --ice of every command). See docs/discovery.md.
    """
    from curling_env.ice import load_ice
    from curling_env.infrastructure.files.writing import make_directory, together
    from curling_env.infrastructure.provenance import provenance
    from friction_estimation.camera.scene import load_scene
    from friction_estimation.discovery.data.references import calibrate, read_reference
    from friction_estimation.discovery.discover import discover as find
    from friction_estimation.discovery.evidence.next_throws import next_throws
    from friction_estimation.discovery.posterior_file import write_posterior_of
    from friction_estimation.discovery.report import write_files
    from friction_estimation.discovery.verdict import terminal_text
    from friction_estimation.reports.discovery_page import write_report_page
    from friction_estimation.reports.throws_section import throws_section
    from friction_estimation.tracks.throw_list import load_tracks, throws_beside
    from friction_estimation.tracks.throw_table import throw_table

    given: dict[QuantityError, References] = {
        "scale_error": known_length,
        "frame_rate_error": clock,
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
    folder, units = make_directory(output), results.units
    with progress_bar() as progress:
        found = find(
            measured, base, scene=view, references=references, seed=seed, progress=progress
        )
    following = next_throws(found.final)
    names = ["report.html", "report.json", "baseline.json", "ice.json"]
    with together():
        report = write_files(found, folder, following=following, provenance=origin)
        throws = throw_table(measured)
        table = throws_section(throws, units, throws_beside(tracks)) if throws else ""
        write_report_page(found, report, folder / "report.html", throws=table, units=units)
        path = folder / "posterior.nc"
        if write_posterior_of(found.final, path, seed=seed, provenance=origin):
            names.append(path.name)
        else:
            print_remark("no posterior.nc: it needs pip install 'curling-sheet[science]'")
    for reason in found.session.left_out:
        print_remark(f"dropped: {reason}")
    print_remark(f"{folder}: {', '.join(names)}")
    keys = ("verdict", "doubts", "remarks", "effects", "gap", "next_throws")
    results.show({key: report[key] for key in keys if key in report}, terminal_text(report))
