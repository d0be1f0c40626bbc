"""How many small faults the tests notice: a drawn sample of mutants, and what becomes of each.

A mutant is the code with one operator, number, condition or statement changed. Each is put into a
copy of the tree and run against the tests that touch its line, the closest and quickest first, up
to the first that fails. Which tests touch which line is recorded once by coverage.py and kept until
a source or the test file changes. Coverage does not see into compiled kernels, so a line in one is
taken to be touched by every test that touches the rest of its module, and by those at its mirrored
place; so is a line that runs at import.

    python scripts/mutation.py -o runs/mutants                 300 mutants, drawn with seed 0
    python scripts/mutation.py -o runs/mutants --again         go on: those not killed so far

mutmut and cosmic-ray were not used: the one compiles all mutants of a function into one module,
which numba cannot, and the other runs the same test command for every mutant.
"""

from __future__ import annotations

import argparse
import csv
import hashlib
import json
import math
import os
import queue
import random
import re
import resource
import shutil
import signal
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import asdict, fields, replace
from itertools import islice
from pathlib import Path
from typing import Any

from mutants.operators import Mutant, mutants_of
from mutants.touched import RECORDING_LIMIT, Touched, body_lines, distance, record
from processes import end_with
from tqdm import tqdm

AREAS = {
    "law": ["curling_env/physics/law.py", "curling_env/physics/effects/*.py"],
    "rules": ["curling_env/game/rules/*.py"],
    "storage": ["curling_env/infrastructure/files/storage.py"],
    "frames": ["curling_env/sheet.py"],
    "estimation": [
        "friction_estimation/estimation/*.py",
        "friction_estimation/discovery/model/*.py",
        "friction_estimation/discovery/data/*.py",
    ],
    "discovery": [
        "friction_estimation/discovery/*.py",
        "friction_estimation/discovery/search/*.py",
        "friction_estimation/discovery/evidence/**/*.py",
    ],
}
"""Area -> patterns of its modules."""
TABLE = "mutants.csv"
STARTING_TIME = 60.0
"""Processor time that a mutant may take beside three times that of its tests [s]: to compile."""
BUSY = 10
"""Longest time on the wall over the processor time allowed; a mutant may also wait for ever."""


def modules(root: Path, area: str) -> list[str]:
    """The modules of an area, from the root of the tree."""
    paths = {path for pattern in AREAS[area] for path in root.glob(pattern)}
    return sorted(str(path.relative_to(root)) for path in paths)


def draw(root: Path, n: int, seed: int, areas: list[str]) -> list[Mutant]:
    """A sample with equally many mutants of each area, as far as there are as many."""
    drawn: list[Mutant] = []
    for k, area in enumerate(areas):
        every = [m for path in modules(root, area) for m in mutants_of(area, root, path)]
        random.Random(f"{seed} {area}").shuffle(every)
        size = n // len(areas) + (k < n % len(areas))
        chosen = islice((mutant for mutant in every if mutant.is_python(root)), size)
        drawn += chosen
    # So that a run that is interrupted has tried a smaller sample of every area.
    random.Random(seed).shuffle(drawn)
    return drawn


class Tree:
    """A copy of the working tree for one worker, with its own cache of compiled kernels."""

    def __init__(self, root: Path, folder: Path) -> None:
        self.folder, self.cache = folder / "tree", folder / "kernels"
        shutil.rmtree(self.folder, ignore_errors=True)
        listed = subprocess.check_output(
            ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"], cwd=root
        )
        for name in filter(None, listed.decode().split("\0")):
            if (root / name).is_file():
                (self.folder / name).parent.mkdir(parents=True, exist_ok=True)
                shutil.copy2(root / name, self.folder / name)

    def run(self, command: list[str], limit: float) -> tuple[int | None, str]:
        """Exit status and output of a Python program in the tree; None if it took too long.

        Parameters
        ----------
        command : what follows `python`
        limit : processor time it may take [s]
        """
        single = {f"{name}_NUM_THREADS": "1" for name in ("OMP", "OPENBLAS", "MKL", "NUMBA")}
        own = {"PYTHONPATH": str(self.folder), "NUMBA_CACHE_DIR": str(self.cache)}
        seconds, parent = math.ceil(limit), os.getpid()

        def confine() -> None:
            end_with(parent)
            resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds))

        process = subprocess.Popen(
            [sys.executable, *command],
            cwd=self.folder,
            text=True,
            start_new_session=True,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            # A changed file of the same size and second would be taken for its old bytecode.
            env=os.environ | single | own | {"PYTHONDONTWRITEBYTECODE": "1"},
            preexec_fn=confine,
        )
        try:
            output, _ = process.communicate(timeout=BUSY * limit)
            over = process.returncode in (-signal.SIGXCPU, -signal.SIGKILL)
            return None if over else process.returncode, output
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)  # with all that it has started
            process.communicate()
            return None, ""

    def judge(self, mutant: Mutant, touched: Touched) -> Mutant:
        """The mutant with what became of it."""
        tests = touched.tests_for(mutant, modules(self.folder, mutant.area))
        if not tests:
            return replace(mutant, verdict="survived", killed_by="no test runs it")
        path = self.folder / mutant.path
        source = path.read_bytes()
        if mutant.original.encode() not in source.splitlines()[mutant.line - 1]:
            raise SystemExit(f"{mutant.path} has changed since the table was drawn: draw a new one")
        begun = time.monotonic()
        path.write_bytes(mutant.applied_to(source))
        # The module's own tests first: to collect those of many files takes seconds.
        own = [test for test in tests if distance(mutant.path, test) == 0]
        status, output = 0, ""
        try:
            for some in filter(None, (own, [test for test in tests if test not in own])):
                if status == 0:
                    status, output = self.run(
                        ["-m", "pytest", "-x", "-q", "-n0", "-p", "no:cacheprovider", *some],
                        STARTING_TIME + 3 * sum(touched.seconds[test] for test in some),
                    )
        finally:
            path.write_bytes(source)
        failed = re.search(r"^(?:FAILED|ERROR) (\S+)", output, re.MULTILINE)
        verdict = {None: "timeout", 0: "survived"}.get(status, "killed")
        by = "" if status == 0 else failed[1] if failed else f"exit status {status}"
        seconds = round(time.monotonic() - begun, 1)
        return replace(mutant, verdict=verdict, killed_by=by, seconds=seconds)


def record_all(
    root: Path, trees: Trees, out: Path, workers: int, tests: Sequence[str] = ("tests",)
) -> Touched:
    """Which tests touch which lines, recorded anew where a source or a test file changed."""
    out.mkdir(parents=True, exist_ok=True)
    digest = hashlib.sha256()
    conftests = (root / "tests").rglob("conftest.py")
    sources = [path for area in AREAS for path in modules(root, area)]
    for path in (*(root / source for source in sources), *sorted(conftests)):
        digest.update(path.read_bytes())
    touched = Touched({path: body_lines((root / path).read_text("utf-8")) for path in sources})

    def one(test_file: Path) -> dict[str, Any] | None:
        name = str(test_file.relative_to(root))
        key = hashlib.sha256(digest.digest() + name.encode() + test_file.read_bytes()).hexdigest()
        kept = out / f"{key[:24]}.json"
        if not kept.exists():
            with trees.one() as tree:
                command = [str(Path(__file__).resolve()), "--record", name, "-o", str(kept)]
                tree.run([*command, "--sources", *sources], 4 * RECORDING_LIMIT)
        return json.loads(kept.read_text()) if kept.exists() else None

    files = sorted({file for folder in tests for file in (root / folder).rglob("test_*.py")})
    with ThreadPoolExecutor(workers) as pool:
        for recorded in tqdm(pool.map(one, files), "tests recorded", len(files), unit="file"):
            if recorded:
                touched.add(recorded)
    return touched


class Trees:
    """One tree for each worker, lent to whoever needs one."""

    def __init__(self, root: Path, folder: Path, workers: int) -> None:
        self.free: queue.Queue[Tree] = queue.Queue()
        for k in range(workers):
            self.free.put(Tree(root, folder / f"worker-{k}"))

    @contextmanager
    def one(self) -> Iterator[Tree]:
        tree = self.free.get()
        try:
            yield tree
        finally:
            self.free.put(tree)


def write_table(path: Path, mutants: list[Mutant]) -> None:
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, [column.name for column in fields(Mutant)])
        writer.writeheader()
        writer.writerows(map(asdict, mutants))


def read_table(path: Path) -> list[Mutant]:
    kinds = {"int": int, "float": float, "bool": lambda text: text == "True", "str": str}
    with path.open(newline="", encoding="utf-8") as file:
        return [
            Mutant(**{f.name: kinds[str(f.type)](row[f.name]) for f in fields(Mutant)})
            for row in csv.DictReader(file)
        ]


def judge_all(
    root: Path,
    out: Path,
    mutants: list[Mutant],
    *,
    workers: int = 1,
    tests: Sequence[str] = ("tests",),
) -> list[Mutant]:
    """Run mutants against the tests that touch their lines; those killed before are kept.

    Parameters
    ----------
    root : the tree
    out : folder of the table of mutants, and of what is kept between runs
    mutants : the mutants
    workers : number of copies of the tree
    tests : folders of the tests
    """
    out.mkdir(parents=True, exist_ok=True)
    trees = Trees(root, out, workers)
    touched = record_all(root, trees, out / "recorded", workers, tests)

    def judged(mutant: Mutant) -> Mutant:
        if mutant.verdict in ("killed", "timeout"):
            return mutant
        with trees.one() as tree:
            return tree.judge(mutant, touched)

    done: list[Mutant] = []
    with ThreadPoolExecutor(workers) as pool:
        for mutant in tqdm(pool.map(judged, mutants), "mutants", len(mutants), unit="mutant"):
            done.append(mutant)
            write_table(out / TABLE, [*done, *mutants[len(done) :]])
    done.sort(key=lambda mutant: (list(AREAS).index(mutant.area), mutant.path, mutant.start))
    write_table(out / TABLE, done)
    return done


def summary(mutants: list[Mutant]) -> str:
    """Killed, timed out and survived, by area; then every survivor."""
    rows = [f"{'area':12} {'mutants':>8} {'killed':>8} {'timeout':>8} {'survived':>8} {'share':>6}"]
    for area in [*dict.fromkeys(mutant.area for mutant in mutants), "all"]:
        own = [mutant for mutant in mutants if area in (mutant.area, "all")]
        count = Counter(mutant.verdict for mutant in own)
        share = 1 - count["survived"] / len(own)
        rows.append(
            f"{area:12} {len(own):8} {count['killed']:8} {count['timeout']:8} "
            f"{count['survived']:8} {share:6.0%}"
        )
    for mutant in mutants:
        if mutant.verdict == "survived":
            rows += ["", f"{mutant.path}:{mutant.line}  {mutant.killed_by}"]
            rows += [f"  - {mutant.original}", f"  + {mutant.mutant}"]
    return "\n".join(rows)


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("-n", type=int, default=300, help="mutants drawn, evenly over the areas")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--areas", nargs="+", choices=AREAS, default=list(AREAS))
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--tests", nargs="+", default=["tests"], help="folders of the tests run")
    parser.add_argument(
        "--again",
        action="store_true",
        help="go on: those not killed so far",
    )
    parser.add_argument("-o", "--out", type=Path, default=Path("runs/mutants"))
    parser.add_argument("--record", help=argparse.SUPPRESS)
    parser.add_argument("--sources", nargs="+", help=argparse.SUPPRESS)
    args = parser.parse_args()
    root, out = Path.cwd(), args.out.resolve()
    if args.record:
        return record(args.record, [str(root / source) for source in args.sources], out)
    again = read_table(out / TABLE) if args.again else None
    mutants = again or draw(root, args.n, args.seed, args.areas)
    done = judge_all(root, out, mutants, workers=args.workers, tests=args.tests)
    (out / "summary.txt").write_text(summary(done) + "\n", encoding="utf-8")
    print(summary(done))


if __name__ == "__main__":
    main()
