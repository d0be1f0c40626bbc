"""`curling compare`: measured throws thrown again on an ice."""

from __future__ import annotations

from os.path import realpath
from pathlib import Path
from typing import Annotated, Any

import typer

from curling_env.commands.cli import (
    IceOption,
    JsonOption,
    UnitsOption,
    Writes,
    conclude,
    say,
    say_what_is_lacking,
)
from curling_env.errors import InputError
from curling_env.units import Units, length

NOT_YOUR_ICE = 5.0
"""Mean error of the places of rest beyond which an ice is another one [m]."""


def compare(
    tracks: Annotated[Path, typer.Argument(metavar="TRACKS.csv", help="Measured throws.")],
    ice: IceOption,
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", metavar="DIR", help="Also write tables and a picture here."),
        Writes(folder=True),
    ] = None,
    window: Annotated[
        float, typer.Option(help="Seconds of each throw to which its release is fitted.", min=0.3)
    ] = 2.5,
    units: UnitsOption = Units.METRES,
    as_json: JsonOption = False,
) -> None:
    """Throw every measured throw again on an ice, and compare prediction and measurement.

    The release of each throw is taken from its first seconds. Its further path is predicted with
    the ice and compared with the measured one: the distance of the two paths at equal times
    (path_rms_m), and the distance of the two places of rest (rest_error_m). too_long_m and
    too_far_left_m say in which direction the prediction is off, as the thrower sees it.

    rest_sigma_x_m and rest_sigma_y_m say how far off it may be: what the standard errors of the ice
    and the noise of the first seconds leave open, across and along the sheet. sigmas_too_long and
    sigmas_too_far_left are the errors in these units; beyond 2 the ice is worse than it says, or
    the throw was unlike the others. rest_error_sigmas is their root mean square, about 1 for an ice
    that knows what it does not know.

    What a table throws.csv beside the tracks notes of each throw (athlete, called, note) is told
    with it.

    With -o, DIR receives throws.csv (a row per throw), paths.csv (both paths, frame by frame)
    and comparison.png.

    \b
    Example:
        curling compare tracks.csv --ice ice.json -o runs/compare
    """
    from curling_env.ice import load_ice
    from curling_env.infrastructure.files.storage import make_directory, together
    from friction_estimation.comparison.rethrow import compare_tracks, write_comparison
    from friction_estimation.tracks.throw_list import THROW_LIST, load_tracks, throws_beside

    known = load_ice(ice)
    noted = {throw: note.row for throw, note in throws_beside(tracks).items()}
    if noted and output is not None and realpath(output) == realpath(tracks.parent):
        raise InputError(
            f"holds the {THROW_LIST} of these tracks; name another folder", source="-o"
        )
    comparison = compare_tracks(load_tracks(tracks), known, window=window)
    if output is not None:
        from friction_estimation.reports.rethrow_figures import save_comparison

        folder = make_directory(output)
        with together():
            write_comparison(comparison, folder, noted)
            save_comparison(comparison, known, folder / "comparison.png", units)
        say(f"{folder}: throws.csv, paths.csv, comparison.png")
    for reason in comparison.skipped:
        say(f"left out: {reason}")
    say_what_is_lacking(known)
    summary = comparison.summary()
    summary["each"] = [{**each, **noted.get(each["throw"], {})} for each in summary["each"]]
    conclude(summary, _in_words(summary, units), as_json=as_json)


def _in_words(found: dict[str, Any], units: Units) -> str:
    """How well the ice predicts, in a sentence."""
    error, path = found["rest_error_m"], found["path_rms_m"]
    count = "one throw" if found["throws"] == 1 else f"{found['throws']} throws"
    if error is None:
        if path is None:
            return f"{count}: too little is seen beyond the release to compare"
        return f"{count}: the predicted paths are {length(path, units)} off (root mean square)"
    words = f"{count}: stones came to rest {length(error, units)} from where this ice says"
    mean = found["too_long_mean_m"]
    if mean is not None and abs(mean) > 0.5 * error:
        words += f", {length(mean, units)} {'short of' if mean > 0 else 'past'} it on average"
    if error > NOT_YOUR_ICE:
        words += ": this is not the ice that these stones ran on"
    return words
