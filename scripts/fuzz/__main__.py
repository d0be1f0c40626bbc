"""Fuzz every command: `python -m fuzz --inputs 10000 --seed 0` (see `make fuzz`).

Hypothesis draws the inputs in batches, each from a separate seed, so that a seed repeats its
inputs. A batch ends with its first unclean end; hypothesis minimises that input, which is kept.
"""

from __future__ import annotations

import argparse
import gc
import json
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import warnings
from collections import Counter
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import seed as seeded
from hypothesis.errors import Flaky
from tqdm import tqdm

from fuzz import app
from fuzz.good_files import make_good_files
from fuzz.inputs import KINDS, Input, inputs
from fuzz.readers import readers
from fuzz.runs import Ended, run
from fuzz.surroundings import put
from fuzz.targets import make_targets

BATCH = 100
"""Inputs that hypothesis draws from one seed."""


def main() -> int:
    options = argparse.ArgumentParser(prog="fuzz", description=__doc__)
    options.add_argument("--minutes", type=float, default=1e9, help="maximum time [min]")
    options.add_argument("--inputs", type=int, default=10**9, help="maximum number of inputs")
    options.add_argument("--seed", type=int, default=None, help="repeat the inputs of this seed")
    options.add_argument("--light", action="store_true", help="exclude slow targets")
    options.add_argument("--only", default="", help="part of a target's name")
    options.add_argument("--kinds", nargs="*", default=[], choices=KINDS, help="kinds of faults")
    options.add_argument("--keep", type=Path, default=Path("../runs/fuzz"), help="folder")
    chosen = options.parse_args()
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # temporary files are removed
    if chosen.seed is None:
        chosen.seed = random.SystemRandom().randrange(2**32)
    found = Fuzzer(chosen).run()
    print(json.dumps(found, indent=2))
    return 1 if found["unclean"] else 0


class Fuzzer:
    """Runs inputs and keeps the report.

    Parameters
    ----------
    chosen : the options of `main`
    """

    def __init__(self, chosen: argparse.Namespace) -> None:
        os.environ.pop("CURLING_TRACEBACK", None)
        # Threads do not outlive a fork, nor do the locks that they hold just then.
        tqdm.monitor_interval = 0
        cv2.setNumThreads(1)
        self.chosen = chosen
        self.place = Path(tempfile.mkdtemp(prefix="curling-fuzz-"))
        self.kept = chosen.keep / f"seed-{chosen.seed}"
        self.counts: Counter[str] = Counter()
        self.unclean: dict[tuple[str, tuple[str, ...]], tuple[Input, Ended]] = {}

    def run(self) -> dict[str, Any]:
        """Run batches until the time or the number of inputs is over, and return the report."""
        chosen, begun, batch = self.chosen, time.monotonic(), 0
        words = ["git", "describe", "--always", "--dirty", "--abbrev=12"]
        state = subprocess.run(words, capture_output=True, text=True).stdout.strip()
        found: dict[str, Any] = {"options": {k: str(v) for k, v in vars(chosen).items()}}
        found |= {"state": state, "inputs": 0}
        shutil.rmtree(self.kept, ignore_errors=True)
        self.kept.mkdir(parents=True)
        try:
            strategy = self.prepared()
            begun = time.monotonic()
            while (
                time.monotonic() < begun + 60 * chosen.minutes and found["inputs"] < chosen.inputs
            ):
                size = min(BATCH, chosen.inputs - found["inputs"])
                with suppress(UncleanError, Flaky):
                    drawn(strategy, chosen.seed * 10**6 + batch, size, self.judged)
                batch += 1
                found |= {
                    "seconds": round(time.monotonic() - begun, 1),
                    "inputs": self.counts.total(),
                    "unclean": len(self.unclean),
                    "by_target": dict(self.counts.most_common()),
                    "ends": [self.keep(k, *end) for k, end in enumerate(self.unclean.values())],
                }
                report = json.dumps(found, indent=1)
                self.kept.with_suffix(".json").write_text(report, encoding="utf-8")
                line = "{inputs} inputs, {unclean} unclean, {seconds} s".format_map(found)
                print(line, file=sys.stderr, flush=True)
        finally:
            shutil.rmtree(self.place, ignore_errors=True)
        return found

    def prepared(self) -> Any:
        """Make the good files, which also compiles what commands need, and the strategy."""
        folder, light = self.place / "good", self.chosen.light
        folder.mkdir()
        good = make_good_files(folder, light=light)
        club = app.make_club(self.place / "club", good["t.csv"], good["throws.csv"])
        requests, only = app.requests(), self.chosen.only
        self.given = readers() | {
            f"app {k}": lambda path: app.answered(club, path) for k in range(len(requests))
        }
        messages = requests if only in "app" else []
        targets = [k for k in make_targets(good, light=light) if only in k.name]
        kinds = self.chosen.kinds or [k for k in KINDS if messages or k != "message"]
        # A run that is not judged compiles and keeps the kernels that no good file needed.
        run(["track", "f.mp4", "--scene", "hall.json", "-o", "first.csv"], folder)
        gc.collect()
        gc.freeze()
        return inputs(targets, messages, kinds if targets else ["message"])

    def judged(self, one: Input) -> None:
        """Run an input and count it.

        Raises
        ------
        UncleanError : the end is unclean; hypothesis then tries smaller inputs
        """
        self.counts[one.name] += 1
        ended = self.ended(one)
        if ended.faults:
            self.unclean[one.name, ended.faults] = one, ended
            raise UncleanError(ended.faults)

    def ended(self, one: Input) -> Ended:
        """Run an input; where it is run again, the second run with the good files must succeed."""
        folder = self.place / "run"
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir()
        for file, content in one.files.items():
            put(folder / file, content)
        words, given = one.words, self.given
        ended = run(
            words, folder, one.surroundings, one.variables, given, kill=one.kill, room=one.room
        )
        if one.again is None or ended.faults:
            return ended
        for file, content in one.again.items():
            put(folder / file, content)
        again = run(one.words, folder, given=self.given)
        faults = [f"again: {fault}" for fault in again.faults]
        faults += [f"again: status {again.status}"] * (again.status != 0)
        return replace(again, faults=tuple(faults))

    def keep(self, number: int, one: Input, ended: Ended) -> dict[str, Any]:
        """Keep an input so that it can be run again, and return its result."""
        folder = self.kept / f"{number:03d}"
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir(parents=True)
        for file, content in one.files.items():
            put(folder / file, content if isinstance(content, bytes) else content.encode())
        run = {"words": one.words, "surroundings": one.surroundings, "variables": one.variables}
        run |= {"again": one.again is not None}
        (folder / "command.json").write_text(json.dumps(run))
        return {
            "target": one.name,
            "faults": list(ended.faults),
            "stderr": ended.stderr[-400:],
            "command": [word[:80] for word in one.words],
            "folder": str(folder),
        }


class UncleanError(Exception):
    """Unclean end of a run."""


def drawn(strategy: Any, number: int, size: int, judged: Callable[[Input], None]) -> None:
    """Give the inputs of one batch to a function, in order.

    Parameters
    ----------
    number : seed of the batch
    size : number of inputs
    """

    @seeded(number)
    @settings(
        max_examples=size,
        database=None,
        deadline=None,
        phases=[Phase.generate, Phase.shrink],
        report_multiple_bugs=False,
        suppress_health_check=list(HealthCheck),  # pyright: ignore[reportArgumentType]
    )
    @given(strategy)
    def draw(one: Input) -> None:
        judged(one)

    with warnings.catch_warnings(action="ignore"):
        draw()


if __name__ == "__main__":
    raise SystemExit(main())
