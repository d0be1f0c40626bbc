"""`curling convert`: files from other programs, and tables for other programs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from typer import Argument, Option

from curling_env.commands.options import Results, grouped, numbers, output_to
from curling_env.commands.outputs import Writes
from curling_env.commands.terminal import print_remark, progress_bar
from curling_env.errors import InputError
from friction_estimation.tracks.importers import Along
from friction_estimation.tracks.tuning import GATE_TIME_SIGMA

FAULTS_SHOWN = 5
"""Maximum number of faults of a table that are shown; the report has all."""
METRES = {"m": 1.0, "cm": 0.01, "mm": 0.001, "ft": 0.3048, "in": 0.0254}


@grouped
def convert(
    table: Annotated[Path, Argument(metavar="TABLE", help="Table to read, see above.")],
    output: Annotated[
        Path,
        output_to("FILE|DIR", "File for the result, or folder for games."),
        Writes(or_folder=True),
    ] = Path("tracks.csv"),
    unit: Annotated[
        Literal["m", "cm", "mm", "ft", "in"], Option(help="Unit of length of the table.")
    ] = "m",
    origin: Annotated[
        str,
        Option(metavar="PLACE|X,Y", help="Origin of the table: middle, home_tee, … or x,y [m]."),
    ] = "middle",
    along: Annotated[
        Along, Option(help="Axis of the table that points to the away end.")
    ] = Along.x,
    sigma_t: Annotated[
        float, Option("--sigma-t", metavar="SECONDS", help="Standard error of a gate's time.")
    ] = GATE_TIME_SIGMA,
    games: Annotated[
        list[str] | None,
        Option("--game", metavar="NAME", help="Only this game of a table; may be repeated."),
    ] = None,
    *,
    results: Results,
) -> None:
    """Convert tables from other programs to tracks, or our files to tables.

    \b
    Examples:
        curling convert kinovea.csv --origin home_tee --along x -o tracks.csv
        curling convert tracker.txt --unit cm --origin 0,-17.3735 -o tracks.csv
        curling convert tracks.csv -o tracks.parquet
        curling convert ice.json -o cells.parquet
        curling convert session.json -o tracks.csv
        curling convert gates.csv -o tracks.csv
        curling convert Stones.csv --game 0-1-1 -o games
        curling convert game.dcl2 -o game.jsonl

    Exports of Kinovea ("Trajectories to CSV", or its text for gnuplot) and of Tracker ("Export data
    file") are recognised by their first rows; every tracked point becomes a throw. --origin and
    --along place the other program's axes on the ice, --unit scales them; the second axis must lie
    to the left of the first. An ice file
    becomes a table of its cells. An output .parquet is written as Parquet, any other as CSV.

    A log of light gates has the columns Sensor, Start and End [s]: the times when the beam of
    T-Line 1, Hog-Line 1 (home end), Hog-Line 2 or T-Line 2 was broken and free again. Its throws
    become tracks of a few times (sigma_t) without x; faulty rows are reported by number.

    A table of championship shots (Stones.csv beside Ends.csv and Games.csv) becomes a folder of
    recorded games and a report of its faults by row; a log of Digital Curling (.dcl, .dcl2) becomes
    a recorded game. `curling replay` shows them. See docs/championships.md.
    """
    if _is_game(table, output, games, results):
        return
    from curling_env.ice import load_ice, write_cells
    from curling_env.infrastructure.files.kinds import kind_of
    from curling_env.sheet import PAPER_SHEET
    from curling_env.trajectory import read_tracks, write_tracks
    from friction_estimation.camera.markings import keypoints_of
    from friction_estimation.donation import read_session
    from friction_estimation.tracks.gates import is_gate_log, read_gates
    from friction_estimation.tracks.importers import on_sheet, read_export

    kind = kind_of(table)
    extra: dict[str, object] = {}
    if table.suffix.lower() == ".json" and kind != "session":
        ice = load_ice(table)
        write_cells(output, ice)
        cells = ice.friction.mu.size
        results.show({"written": str(output), "rows": cells}, f"{cells} cells: {output}")
        return
    if kind == "session":
        tracks = read_session(table).tracks
    elif kind == "tracks":
        tracks = read_tracks(table)
    elif is_gate_log(table):
        if not 0 < sigma_t <= 1:
            raise InputError(f"expected 0 to 1 s, got {sigma_t:g}", source="--sigma-t")
        log = read_gates(table, sigma_t)
        tracks = log.tracks
        for fault in log.faults:
            print_remark(f"dropped: {fault}")
        print_remark(
            f"{len(log.unused)} rows ignored: not from a throw, but from people or pushed stones"
        )
        extra = {"faulty_rows": log.faults, "unused_rows": log.unused}
    else:
        places = {"middle": (0.0, 0.0), **keypoints_of(PAPER_SHEET)}
        series = read_export(table)
        form = "middle, a named point of the sheet, or x,y in metres"
        x, y = places.get(origin) or numbers(origin, "--origin", form)
        tracks = on_sheet(series, metres=METRES[unit], origin=(x, y), along=along)
        for k, track in zip(series, tracks, strict=True):
            if not PAPER_SHEET.contains(track.xy).any():
                problem = f"{k.name!r} is not on the sheet"
                problem += " with this --unit, --origin and --along"
                raise InputError(problem, source=table)
        for i, k in enumerate(series):
            print_remark(f"throw {i}: {k.name}, {len(k.t)} rows")
    write_tracks(output, tracks)
    rows, throws = sum(map(len, tracks)), len({track.throw for track in tracks})
    results.show(
        {"written": str(output), "throws": throws, "rows": rows, **extra},
        f"{throws} throws, {rows} rows: {output}",
    )


def _is_game(table: Path, output: Path, games: list[str] | None, results: Results) -> bool:
    """Convert a table of shots or a log of a game; return False for any other file."""
    from agents.digital_curling.read_logs import is_log, read_log
    from agents.playing.record import write_lines
    from agents.shots.records import REPORT, chosen_games, write_records
    from agents.shots.table import is_shot_table, read_shots
    from curling_env.infrastructure.files.writing import make_directory

    if is_log(table):
        log = read_log(table)
        write_lines(output, log.lines)
        for fault in log.faults:
            print_remark(f"{table}: {fault}")
        shots = len(log.lines) - 2
        document = {"written": str(output), "shots": shots, "faults": log.faults}
        results.show(document, f"a game of {shots} shots: {output}")
        return True
    if not is_shot_table(table):
        if games:
            raise InputError("expected a table of shots (Stones.csv)", source="--game")
        return False
    if output.suffix:
        problem = f"{output}: a table of shots becomes a folder of games; expected -o DIR"
        raise InputError(problem, source=table)
    shots_table = read_shots(table)
    chosen = chosen_games(shots_table, games, table)
    with progress_bar("game") as progress:
        folder = make_directory(output)
        report = write_records(folder, shots_table, chosen, progress=progress)
    for fault in shots_table.faults[:FAULTS_SHOWN]:
        print_remark(str(fault))
    hidden = len(shots_table.faults) - FAULTS_SHOWN
    if hidden > 0:
        print_remark(f"and {hidden} more faults: {folder / REPORT}")
    results.show(
        {"written": str(folder), "games_written": len(chosen), **report},
        f"{len(chosen)} games: {folder}; {report['ends_as_written']} of {report['ends']} ends "
        "have the written score",
    )
    return True
