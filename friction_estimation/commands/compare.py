"""`curling compare`: measured throws repeated on an ice."""

from __future__ import annotations

from collections.abc import Sequence
from os.path import realpath
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from typer import Argument

from curling_env.commands.options import IceOption, Measured, grouped, output_to
from curling_env.commands.outputs import Writes
from curling_env.commands.terminal import print_remark, warn_about
from curling_env.errors import InputError

if TYPE_CHECKING:
    from curling_env.ice import Ice
    from curling_env.trajectory import Trajectory


@grouped
def compare(
    tracks: Annotated[Path, Argument(metavar="TRACKS.csv", help="Measured throws.")],
    ice: IceOption,
    output: Annotated[
        Path | None, output_to("DIR", "Also write tables and a picture."), Writes(folder=True)
    ] = None,
    *,
    results: Measured,
) -> None:
    """Compare measured throws with their simulation on an ice.

    \b
    Example:
        curling compare tracks.csv --ice ice.json -o runs/compare

    The release of each throw is fitted to its first 2.5 s, and the rest of its path is predicted.
    The JSON has the distance between the two paths at equal times and between the places of rest,
    in metres and in standard errors: more than 2 standard errors mean that the ice is worse than
    its file states, or that the throw is unusual. With -o, DIR receives throws.csv, paths.csv and
    comparison.png. Throws timed by light gates are compared at equal times from hog line to hog
    line. See docs/science/estimation.md.
    """
    from curling_env.ice import load_ice
    from curling_env.infrastructure.files.writing import make_directory, together
    from friction_estimation.comparison.rethrow import compare_tracks, write_comparison
    from friction_estimation.tracks.throw_list import THROW_LIST, load_tracks, throws_beside

    known = load_ice(ice)
    noted = {throw: note.row for throw, note in throws_beside(tracks).items()}
    if noted and output is not None and realpath(output) == realpath(tracks.parent):
        problem = f"contains the {THROW_LIST} of these tracks; expected another folder"
        raise InputError(problem, source="-o")
    throws = load_tracks(tracks)
    if any(track.by_gates for track in throws):
        _compare_gate_times(throws, known, output, results)
        return
    comparison = compare_tracks(throws, known)
    if output is not None:
        from friction_estimation.reports.rethrow_figures import save_comparison

        folder = make_directory(output)
        with together():
            write_comparison(comparison, folder, noted)
            save_comparison(comparison, known, folder / "comparison.png", results.units)
        print_remark(f"{folder}: throws.csv, paths.csv, comparison.png")
    for reason in comparison.skipped:
        print_remark(f"dropped: {reason}")
    warn_about(known)
    summary = comparison.summary()
    summary["each"] = [{**each, **noted.get(each["throw"], {})} for each in summary["each"]]
    results.show(summary, comparison.in_words(results.units))


def _compare_gate_times(
    throws: Sequence[Trajectory], ice: Ice, output: Path | None, results: Measured
) -> None:
    """Compare throws timed by light gates."""
    from curling_env.infrastructure.files.writing import make_directory, together
    from friction_estimation.comparison.gate_times import (
        compare_gate_times,
        write_gate_comparison,
    )

    comparison = compare_gate_times(throws, ice)
    if output is not None:
        folder = make_directory(output)
        with together():
            write_gate_comparison(comparison, folder)
        print_remark(f"{folder}: throws.csv")
    for reason in comparison.skipped:
        print_remark(f"dropped: {reason}")
    warn_about(ice)
    results.show(comparison.summary(), comparison.in_words())
