"""Blind sessions with a sealed truth: how often discovery finds what was hidden, and nothing else.

    python scripts/blind_benchmark.py --sessions 4 --workers 8 -o runs/blind

Draws sessions (`blind/`: its own formulas, integrator and noise), writes their tracks, seals the
truth and some more throws in another folder, runs discovery on the tracks alone, and only then
opens the truth and scores. Derivative regressions see the same tracks of the first families.

Each session's scores are a file under `rows/`. The same command goes on where it was stopped; any
number of workers and any choice of families gives a session the same scores, CPU seconds apart.
"""

from __future__ import annotations

import argparse
import json
import os
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from blind.bound import bound_of
from blind.families import FIRST_SUITE, KINDS, Task, plan
from blind.planned_draws import draws_on_truth
from blind.scoring import by_regression, gap_on_fresh_throws, map_scores, score
from blind.tables import tables
from tqdm import tqdm

from curling_env import load_ice
from curling_env.infrastructure.files.storage import (
    make_directory,
    read_json,
    write_json,
    write_table,
)
from curling_env.infrastructure.workers import ProcessExecutor
from curling_env.trajectory import Trajectory, read_tracks
from friction_estimation.discovery.discover import Discovery, discover
from friction_estimation.discovery.report import document

ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS")
"""Variables by which a worker keeps to one thread, so that CPU seconds are those of one core."""
RINK_ICE = ("model given", "model given, nothing hidden", "map", "one way", "badly measured")
"""Families on whose ice draws are planned."""


@dataclass(frozen=True, kw_only=True)
class Job:
    """A session, and where and how it is judged."""

    task: Task
    seed: int
    film: bool
    draws: bool
    folder: Path

    @property
    def row(self) -> Path:
        """File of its scores."""
        return self.folder / "rows" / f"{self.task.name}.json"


def make_folders(output: Path) -> None:
    """Make the folders that sessions are written to."""
    for folder in ("tracks", "sealed", "reports", "rows"):
        make_directory(output / folder)


def judge(job: Job) -> dict[str, Any]:
    """Make a session, search it, and only then open the truth; its scores, which are written."""
    task, name = job.task, job.task.name
    make_files(job)
    tracks = read_tracks(job.folder / "tracks" / f"{name}.csv")
    row: dict[str, Any] = {
        "session": name,
        "kind": task.kind,
        "throws": task.throws,
        "effects": len(task.hidden),
        "scale": task.scale,
        "hidden": list(task.hidden),
    }
    found: Discovery | None = None
    report: dict[str, Any] = {}
    begun = time.process_time()
    try:
        found = discover(tracks, load_ice("standard") if task.given else None)
        report = document(found)
    except Exception as error:
        # Whatever goes wrong is a session that was not understood; the others are still judged.
        row |= {"failed": f"{type(error).__name__}: {error}", "right": False, "exact": False}
    row["seconds"] = round(time.process_time() - begun, 2)
    if found is not None:
        write_json(job.folder / "reports" / f"{name}.json", report)
        row |= scores(job, found, report, tracks)
    write_json(job.row, row)
    return row


def make_files(job: Job) -> None:
    """Write a session's tracks, and seal the truth and the throws after the session."""
    name, sealed = job.task.name, job.folder / "sealed"
    columns, truth = job.task.make(job.seed, film=job.film)
    seen = np.array(columns["throw"]) < job.task.throws
    for file, kept in (
        (job.folder / "tracks" / f"{name}.csv", seen),
        (sealed / f"{name}.csv", ~seen),
    ):
        write_table(file, {key: np.array(values)[kept].tolist() for key, values in columns.items()})
    write_json(sealed / f"{name}.json", json.loads(json.dumps(truth, default=float)))


def scores(
    job: Job, found: Discovery, report: dict[str, Any], tracks: list[Trajectory]
) -> dict[str, Any]:
    """The scores of a session against the sealed truth."""
    task, sealed = job.task, job.folder / "sealed"
    truth = read_json(sealed / f"{task.name}.json")
    ice = found.improved_ice()
    row = score(report, truth, task)
    planned = job.draws and task.kind in RINK_ICE
    # Of tracks like those of films the true noise is not known as a formula.
    best = bound_of(truth, tracks) if (planned or task.kind == "map") and not job.film else None
    if "map" in truth:
        row |= map_scores(ice, truth, task.throws, best)
    if task.kind in FIRST_SUITE:
        row["gap_fresh"] = gap_on_fresh_throws(found, sealed / f"{task.name}.csv")
        row["regression"] = by_regression(tracks)
    if planned:
        # Where all throws went one way, the home half of the sheet was never seen.
        direction = -1.0 if task.ways == 2 else 1.0
        row["draws"] = draws_on_truth(ice, truth, direction=direction, best=best)
    return row


def said(row: dict[str, Any]) -> str:
    """A session that was not understood, in a line."""
    if "failed" in row:
        return f"{row['session']}: hidden {row['hidden']}, failed: {row['failed']}"
    return (
        f"{row['session']}: hidden {row['hidden']}, named {row['named']}, "
        f"unknown {row['unknown']}, {row['visibility'] or float('nan'):.2g} of what would show"
    )


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("--sessions", type=int, default=4, help="per effect")
    parser.add_argument(
        "--throws", type=int, default=20, help="of a session; those of the first families have 16"
    )
    parser.add_argument(
        "--other-throws",
        type=int,
        nargs="*",
        default=[],
        help="further numbers of throws, for sessions with one effect or none",
    )
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--workers", type=int, default=1, help="processes")
    parser.add_argument(
        "--film", action="store_true", help="tracks that err as those from films do"
    )
    parser.add_argument(
        "--kinds",
        nargs="+",
        metavar="KIND",
        default=list(KINDS),
        choices=KINDS,
        help=f"families of sessions: {'; '.join(KINDS)}; all by default",
    )
    parser.add_argument(
        "--no-draws", action="store_true", help="plan no draws on the ice that was found"
    )
    parser.add_argument("-o", "--output", type=Path, default=Path("runs/blind"))
    arguments = parser.parse_args()
    settings = {"seed": arguments.seed, "film": arguments.film, "draws": not arguments.no_draws}
    settings_file = make_directory(arguments.output) / "settings.json"
    if settings_file.exists() and read_json(settings_file) != settings:
        parser.error(f"{arguments.output} holds sessions of other settings: give another folder")
    write_json(settings_file, settings)
    make_folders(arguments.output)
    tasks = plan(
        arguments.kinds,
        arguments.sessions,
        throws=arguments.throws,
        others=tuple(arguments.other_throws),
    )
    jobs = [Job(task=task, folder=arguments.output, **settings) for task in tasks]
    os.environ |= dict.fromkeys(ONE_THREAD, "1")  # of the workers, which are started below
    left = [job for job in jobs if not job.row.exists()]
    for row in tqdm(ProcessExecutor(arguments.workers).map(judge, left), total=len(left)):
        if not row["right"]:
            tqdm.write(said(row))
    rows = [read_json(job.row) for job in jobs]
    write_json(arguments.output / "scores.json", rows)
    print(tables(rows))


if __name__ == "__main__":
    main()
