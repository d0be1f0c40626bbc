"""Measures of the app, of coaching, and of the project: set-up, size, tests and documents."""

from __future__ import annotations

import contextlib
import os
import subprocess
import sys
import time
from collections.abc import Iterable
from itertools import takewhile
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from release import bill
from release.check import PROJECT, ROOT, tracked_files
from website.__main__ import build
from website.examples import examples

from agents.commands.page_benchmarks import page_measures
from curling_env.benchmarks.measures import import_time
from measures import coaching
from measures.mutants import noticed

MEASURES = (
    *("latency", "causes", "athletes", "stones"),
    *("size", "import_of_package", "first_map", "tests", "faults_noticed", "site"),
)
MUTANTS = 300
EXTRAS = ("train", "app")
"""Extras whose size is recorded."""
NUMPY = "import time; begun = time.process_time(); import numpy; print(time.process_time() - begun)"
causes, athletes, stones = coaching.causes, coaching.athletes, coaching.stones


def latency() -> dict[str, float]:
    """Measure the latency of the app's sheet endpoints, from JSON to JSON."""
    return {found.name.removeprefix("page_"): found.value for found in page_measures()}


def size() -> dict[str, float]:
    """Measure the size of an installation on disk, without compiled bytecode [MB]."""
    rows = bill.inventory()
    asked = PROJECT["optional-dependencies"]
    core = bill.closure(rows, PROJECT["dependencies"])
    own = 1e-6 * sum((ROOT / name).stat().st_size for name in tracked_files())
    extras = {name: bill.closure(rows, asked[name]) - core for name in EXTRAS}
    return {
        "own_mb": own,
        "core_mb": own + _megabytes(rows, core),
        **{f"{name}_mb": _megabytes(rows, added) for name, added in extras.items()},
        "all_mb": own + _megabytes(rows, {bill.key(row) for row in rows}),
    }


def _megabytes(rows: Iterable[dict[str, Any]], names: set[str]) -> float:
    return 1e-6 * sum(row["size"] for row in rows if bill.key(row) in names)


def import_of_package() -> dict[str, float]:
    """Compare the time to import the package with that to import NumPy alone."""
    program = [sys.executable, "-c", NUMPY]
    numpy_alone = 1e3 * min(float(subprocess.check_output(program)) for _ in range(3))
    package = import_time()
    return {"ms": package, "over_numpy": package / numpy_alone}


def first_map() -> dict[str, float]:
    """Measure the time from the clone to a first map, by the commands of docs/start.md.

    Its blocks are run in order in a new folder, up to the first that is not a shell's.

    Raises
    ------
    CalledProcessError : a block failed
    """
    spent: list[float] = []
    page = (ROOT / "docs" / "start.md").read_text(encoding="utf-8")
    with TemporaryDirectory() as folder:
        cloned = Path(folder) / "curling-sheet"
        for example in takewhile(lambda example: example.language == "sh", examples(page)):
            text = 'curling() { .venv/bin/curling "$@"; }\n' + example.text
            begun = time.monotonic()
            subprocess.run(
                ["bash", "-euo", "pipefail", "-c", text.replace("<this repository>", str(ROOT))],
                cwd=cloned if cloned.exists() else folder,
                env={k: v for k, v in os.environ.items() if k != "VIRTUAL_ENV"},
                stdin=subprocess.DEVNULL,
                stdout=sys.stderr,
                check=True,
            )
            spent.append(time.monotonic() - begun)
    return {"demo_min": spent[0] / 60, "map_s": sum(spent[1:])}


def tests() -> dict[str, float]:
    """Measure the time that all tests take on two cores [min]."""
    return {"minutes": tests_run("tests") / 60}


def tests_run(folder: str) -> float:
    """Run the tests of a folder on two cores, and return the time by the clock [s].

    Raises
    ------
    CalledProcessError : a test failed
    """
    words = [sys.executable, "-m", "pytest", "-n", "2", "--dist", "worksteal", "-q", folder]
    begun = time.monotonic()
    subprocess.run(words, cwd=ROOT, check=True, stdout=sys.stderr)
    return time.monotonic() - begun


def faults_noticed() -> dict[str, float]:
    """Measure the share of small faults in the code that the tests notice [%], by area."""
    return noticed(f"-n {MUTANTS}")


def site() -> dict[str, float]:
    """Build the site with every warning as an error, and measure its size.

    Raises
    ------
    RuntimeError : the site has warnings
    """
    with TemporaryDirectory() as kept, contextlib.redirect_stdout(sys.stderr):
        folder = Path(kept) / "site"
        if build(folder, Path(kept)):
            raise RuntimeError("the site has warnings")
        files = [path for path in folder.rglob("*") if path.is_file()]
        return {
            "pages": sum(path.suffix == ".html" for path in files),
            "mb": 1e-6 * sum(path.stat().st_size for path in files),
        }
