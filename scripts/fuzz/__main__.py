"""Fuzz every command: `python -m fuzz --inputs 10000 --seed 0` (see `make fuzz`).

Hypothesis draws the inputs in batches, each from a separate seed. With a fixed seed they are the
same every time, and an interrupted run continues after its last batch, unless the code has
changed. An input that ends uncleanly is kept, minimised by hypothesis.
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
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import seed as seeded
from tqdm import tqdm

from fuzz import app, wire
from fuzz.good_files import make_good_files
from fuzz.inputs import KINDS, Input, inputs
from fuzz.readers import readers
from fuzz.runs import Ended, run
from fuzz.surroundings import put
from fuzz.targets import make_targets

BATCH = 100
"""Inputs that hypothesis draws from one seed."""
SHRINKING = 20.0
"""Time in which the first unclean input of a kind is made smaller [s]."""


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
        self.report = chosen.keep / f"seed-{chosen.seed}.json"

    def run(self) -> dict[str, Any]:
        """Run batches until the time or the number of inputs is over, and return the report."""
        chosen = self.chosen
        asked = {k: str(v) for k, v in vars(chosen).items() if k not in ("minutes", "inputs")}
        words = ["git", "describe", "--always", "--dirty", "--abbrev=12"]
        asked["state"] = subprocess.run(words, capture_output=True, text=True).stdout.strip()
        found: dict[str, Any] = {"asked": asked, "batches": 0, "seconds": 0.0, "inputs": 0,
                                 "unclean": 0, "by_target": {}, "ends": []}  # fmt: skip
        if self.report.exists() and (kept := json.loads(self.report.read_text()))["asked"] == asked:
            found = kept
        chosen.keep.mkdir(parents=True, exist_ok=True)
        try:
            strategy = self.prepared()
            end = time.monotonic() + 60 * chosen.minutes
            while time.monotonic() < end and found["inputs"] < chosen.inputs:
                begun, batch = time.monotonic(), min(BATCH, chosen.inputs - found["inputs"])
                counts: Counter[str] = Counter(found["by_target"])
                unclean: list[tuple[Input, Ended]] = []

                def tried(one: Input) -> None:
                    counts[one.name] += 1  # noqa: B023
                    ended = self.tried(one)
                    if ended.faults:
                        unclean.append((one, ended))  # noqa: B023

                number = chosen.seed * 10**6 + found["batches"]
                drawn(strategy, number, batch, tried)
                for one in unclean:
                    kind = one[0].name, list(one[1].faults)
                    if kind not in [(k["target"], k["faults"]) for k in found["ends"]]:
                        one = self.smaller(strategy, number, batch, one)
                    found["ends"].append(self.kept(len(found["ends"]), *one))
                found["by_target"] = dict(counts.most_common())
                found["inputs"], found["unclean"] = counts.total(), len(found["ends"])
                found["batches"] += 1
                found["seconds"] = round(found["seconds"] + time.monotonic() - begun, 1)
                self.report.write_text(json.dumps(found, indent=1), encoding="utf-8")
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
        sides = wire.sides()
        self.given = readers() | {
            f"{side} {k}": lambda path, sent=sent: sent.give(path.read_bytes())
            for side, messages in sides.items()
            for k, sent in enumerate(messages)
        }
        club = app.make_club(self.place / "club", good["t.csv"], good["throws.csv"])
        asked = app.requests()
        self.given |= dict.fromkeys(
            (f"app {k}" for k in range(len(asked))), lambda path: app.answered(club, path)
        )
        messages = {side: [sent.message for sent in of] for side, of in sides.items()}
        only = self.chosen.only
        messages = {side: of for side, of in (messages | {"app": asked}).items() if only in side}
        targets = [k for k in make_targets(good, light=light) if only in k.name]
        kinds = self.chosen.kinds or [k for k in KINDS if messages or k != "message"]
        # A run that is not judged compiles and keeps the kernels that no good file needed.
        run(["track", "f.mp4", "--scene", "hall.json", "-o", "first.csv"], folder)
        gc.collect()
        gc.freeze()
        return inputs(targets, messages, kinds if targets else ["message"])

    def tried(self, one: Input) -> Ended:
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

    def smaller(
        self, strategy: Any, number: int, batch: int, unclean: tuple[Input, Ended]
    ) -> tuple[Input, Ended]:
        """Return the smallest input that ends as an unclean one of a batch did."""
        best, end = unclean, time.monotonic() + SHRINKING

        def still(one: Input) -> None:
            nonlocal best
            if one.name == unclean[0].name and time.monotonic() < end:
                ended = self.tried(one)
                if ended.faults == unclean[1].faults:
                    best = one, ended
                    raise AssertionError

        with suppress(Exception):  # hypothesis may call it flaky when the time is over
            drawn(strategy, number, batch, still, [Phase.generate, Phase.shrink])
        return best

    def kept(self, number: int, one: Input, ended: Ended) -> dict[str, Any]:
        """Keep an input so that it can be run again, and return its result."""
        folder = self.chosen.keep / f"seed-{self.chosen.seed}" / f"{number:03d}"
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


def drawn(
    strategy: Any,
    number: int,
    size: int,
    tried: Callable[[Input], None],
    phases: Sequence[Phase] = (Phase.generate,),
) -> None:
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
        phases=phases,
        suppress_health_check=list(HealthCheck),  # pyright: ignore[reportArgumentType]
    )
    @given(strategy)
    def draw(one: Input) -> None:
        tried(one)

    with warnings.catch_warnings(action="ignore"):
        draw()


if __name__ == "__main__":
    raise SystemExit(main())
