"""Share of small faults in the code that the tests detect, by cosmic-ray and pytest-testmon.

cosmic-ray changes one operator, number or condition of the code. The tests that depend on the
changed function, as recorded by pytest-testmon, are run up to the first failure; the
module's own tests come first. Coverage does not see into compiled kernels: for modules with
kernels, and for changes without a dependent test, the tests in the mirrored folder follow.

`make mutants` installs the two tools and runs this script with their Python. An interrupted run
continues; `runs/tools/bin/cr-report runs/mutants/session.sqlite` lists every mutant.
"""

# cosmic-ray is in a separate environment.
# pyright: reportMissingImports=false

from __future__ import annotations

import argparse
import json
import os
import queue
import random
import re
import shutil
import subprocess
import sys
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]
PYTHON = ROOT / ".venv" / "bin" / "python"
PLUGINS = ROOT / "runs" / "tools" / "plugins"
"""Folder with pytest-testmon and pytest-timeout."""
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
    "reports": [
        "friction_estimation/comparison/*.py",
        "friction_estimation/design/*.py",
        "friction_estimation/reports/*.py",
    ],
}
"""Patterns of the modules of each area."""
TESTS = ("tests/curling_env", "tests/friction_estimation")
OPERATORS = re.compile(
    r"core/(AddNot|NumberReplacer|ExceptionReplacer|ZeroIterationForLoop|Replace(AndWithOr|OrWithAnd"
    r"|TrueWithFalse|FalseWithTrue|BreakWithContinue|ContinueWithBreak|UnaryOperator_Delete_\w+"
    r"|BinaryOperator_(Add_Sub|Sub_Add|Mul_Div|Div_Mul|FloorDiv_Mul|Mod_Mul|Pow_Mul)"
    r"|ComparisonOperator_(Lt_LtE|LtE_Lt|Gt_GtE|GtE_Gt|Lt_GtE|Gt_LtE|Eq_NotEq|NotEq_Eq|Is_IsNot"
    r"|IsNot_Is)))"
)
"""Operators of cosmic-ray that are used; others change annotations or what any type check finds."""
COMPILERS = re.compile(r"(?m)^@(compiled|inlined|effect_kernel)\b")
FAILING = "failing.txt"
"""Tests that fail in a copy of the tree without any change; they judge no mutant."""
KERNELS = ".kernels"
"""Folder of a copy of the tree with its compiled kernels."""
NOTHING_RUN = 5
"""Exit status of pytest without a test."""
TEST_LIMIT, SESSION_LIMIT = 180, 300
"""Timeouts of one test, and of all tests of a mutant [s]."""


def modules(root: Path, area: str) -> list[Path]:
    """Return the modules of an area."""
    return sorted({path for pattern in AREAS[area] for path in root.glob(pattern)})


def draw(root: Path, n: int, seed: int, areas: list[str]) -> list[Any]:
    """Draw mutants: equally many of each area, if it has enough of them."""
    from cosmic_ray.commands import init
    from cosmic_ray.work_db import WorkDB

    drawn: list[Any] = []
    for k, area in enumerate(areas):
        every = WorkDB(":memory:", WorkDB.Mode.create)
        init(modules(root, area), every, {})
        items = [i for i in every.work_items if OPERATORS.fullmatch(i.mutations[0].operator_name)]
        items.sort(key=lambda item: str(item.mutations))
        random.Random(f"{seed} {area}").shuffle(items)
        drawn += items[: n // len(areas) + (k < n % len(areas))]
    # A run that is interrupted has then tried a smaller sample of every area.
    random.Random(seed).shuffle(drawn)
    return drawn


def tested(module: str, folders: Sequence[str]) -> int:
    """Run the tests that may notice a change of a module of the current folder.

    Returns
    -------
    0 if all of them pass, 1 if one fails
    """
    own = Path("tests") / Path(module).with_name(f"test_{Path(module).name}")
    runs = [[str(own)]] if own.exists() else []
    runs.append(["--testmon-nocollect", "--testmon-forceselect", *folders])
    nearby = [str(next(k for k in own.parents if k.exists()))]
    if COMPILERS.search(Path(module).read_text("utf-8")):
        runs.append(nearby)
    limits = [f"--timeout={TEST_LIMIT}", f"--session-timeout={SESSION_LIMIT}"]
    failing = Path(FAILING).read_text("utf-8").split() if Path(FAILING).exists() else []
    limits += [f"--deselect={test}" for test in failing]
    for words in runs:
        command = [str(PYTHON), "-m", "pytest", "-x", "-q", "-m", "not slow", *limits, *words]
        done = subprocess.run(command, env=environment(Path.cwd()), capture_output=True, text=True)
        if done.returncode not in (0, NOTHING_RUN) and "session-timeout" not in done.stdout:
            print(done.stdout[-2000:])
            return 1
        if done.returncode == NOTHING_RUN and nearby not in runs:
            runs.append(nearby)
    return 0


def tree(folder: Path, workers: int, folders: Sequence[str]) -> Path:
    """Copy the working tree into a folder, and record which tests depend on which functions.

    In a folder that has a copy already, only those tests run again that changes since affect.
    """
    for path in folder.iterdir() if folder.exists() else ():
        if path.is_dir() and path.name != KERNELS:
            shutil.rmtree(path)
        elif path.is_file() and not path.name.startswith(".testmondata"):
            path.unlink()
    words = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
    for name in filter(None, subprocess.check_output(words, cwd=ROOT).decode().split("\0")):
        if (ROOT / name).is_file():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(ROOT / name, folder / name)
    words = [str(PYTHON), "-m", "pytest", "-q", "-m", "not slow", "-n", str(workers), *folders]
    done = subprocess.run(
        [*words, "--testmon", "--testmon-forceselect"],
        cwd=folder,
        env=environment(folder),
        capture_output=True,
        text=True,
    )
    failing = re.findall(r"(?m)^(?:FAILED|ERROR) (\S+)", done.stdout)
    print(*done.stdout.splitlines()[-1:], *failing, sep="\n", file=sys.stderr, flush=True)
    (folder / FAILING).write_text("\n".join(failing), encoding="utf-8")
    return folder


def environment(folder: Path) -> dict[str, str]:
    """Return the environment of tests in a copy of the tree, with a separate kernel cache."""
    single = {f"{name}_NUM_THREADS": "1" for name in ("OMP", "OPENBLAS", "MKL", "NUMBA")}
    own = {"PYTHONPATH": f"{folder}:{PLUGINS}", "NUMBA_CACHE_DIR": str(folder / KERNELS)}
    return os.environ | single | own


def judge(out: Path, drawn: list[Any], workers: int, folders: Sequence[str]) -> Any:
    """Try the mutants that the session of a folder has no result of, and return the session."""
    import attrs
    from cosmic_ray.mutating import mutate_and_test
    from cosmic_ray.work_db import WorkDB
    from cosmic_ray.work_item import WorkItem

    fresh = not (out / "session.sqlite").exists()
    session = WorkDB(out / "session.sqlite", WorkDB.Mode.create)
    if fresh:
        session.add_work_items(drawn)
    free: queue.Queue[Path] = queue.Queue()
    free.put(tree(out / "tree-0", workers, folders))
    for k in range(1, workers):
        free.put(shutil.copytree(out / "tree-0", out / f"tree-{k}", dirs_exist_ok=True))

    def tried(item: WorkItem) -> tuple[str, Any]:
        folder = free.get()
        try:
            (mutation,) = item.mutations
            name = mutation.module_path.relative_to(ROOT)
            here = attrs.evolve(mutation, module_path=folder / name)
            words = f"env -C {folder} {sys.executable} {__file__} --test {name}"
            words += f" --tests {' '.join(folders)}"
            return item.job_id, mutate_and_test([here], words, 4 * SESSION_LIMIT)
        finally:
            free.put(folder)

    with ThreadPoolExecutor(workers) as pool:
        for k, (job, result) in enumerate(pool.map(tried, session.pending_work_items), 1):
            session.set_result(job, result)
            print(f"{k}: {result.test_outcome.value}", file=sys.stderr, flush=True)
    return session


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("-n", type=int, default=300, help="mutants drawn, evenly over the areas")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--areas", nargs="+", choices=AREAS, default=list(AREAS))
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--tests", nargs="+", default=TESTS, help="folders of the tests")
    parser.add_argument("-o", "--out", type=Path, default=ROOT / "runs" / "mutants")
    parser.add_argument("--test", help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.test:
        sys.exit(tested(given.test, given.tests))
    given.out.mkdir(parents=True, exist_ok=True)
    drawn = draw(ROOT, given.n, given.seed, given.areas)
    session = judge(given.out.resolve(), drawn, given.workers, given.tests)
    noticed: dict[str, list[bool]] = {}
    for item, result in session.completed_work_items:
        path = item.mutations[0].module_path
        area = next(a for a in AREAS if path in modules(ROOT, a))
        for name in (area, "all"):
            noticed.setdefault(name, []).append(result.is_killed)
    print(json.dumps({name: 100 * sum(k) / len(k) for name, k in noticed.items()}))


if __name__ == "__main__":
    main()
