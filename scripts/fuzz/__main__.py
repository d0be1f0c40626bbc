"""Fuzz every command: `python -m fuzz --minutes 10` (see `make fuzz`)."""

from __future__ import annotations

import argparse
import json
import os
import random
import shutil
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
from processes import end_orderly_when_told
from tqdm import tqdm

from fuzz.documents import strategies
from fuzz.mutations import damaged
from fuzz.options import odd_command_line
from fuzz.runs import Ended, run
from fuzz.special import KINDS, Special, put
from fuzz.surroundings import SURROUNDINGS
from fuzz.targets import HEAVY, OPTIONS, Target, lines_of, make_targets


def main() -> int:
    options = argparse.ArgumentParser(prog="fuzz", description=__doc__)
    options.add_argument("--minutes", type=float, default=10.0)
    options.add_argument("--inputs", type=int, default=10**9, help="end after so many")
    options.add_argument("--seed", type=int, default=None, help="fixed: the same inputs again")
    options.add_argument("--light", action="store_true", help="without what takes seconds a run")
    options.add_argument("--only", default="", help="part of a target's name")
    options.add_argument("--keep", type=Path, default=Path("runs/fuzz"), help="for unclean inputs")
    chosen = options.parse_args()
    end_orderly_when_told()
    seed = chosen.seed if chosen.seed is not None else random.SystemRandom().randrange(2**32)
    found = fuzz(
        chosen.minutes,
        seed,
        chosen.keep,
        inputs=chosen.inputs,
        only=chosen.only,
        light=chosen.light,
    )
    print(json.dumps(found, indent=2))
    return 1 if found["unclean"] else 0


def fuzz(
    minutes: float,
    seed: int,
    keep: Path,
    *,
    inputs: int = 10**9,
    only: str = "",
    light: bool = False,
) -> dict[str, Any]:
    """Run inputs until the time is over.

    Parameters
    ----------
    minutes : time after the good files are made [min]
    seed : seed of all inputs
    keep : folder for inputs that ended uncleanly
    inputs : end after so many
    only : part of the names of the targets to fuzz
    light : leave out training and estimation, of which making the good files takes a minute

    Returns
    -------
    counts, the worst time [s] and memory [MB], and the unclean ends
    """
    os.environ.pop("CURLING_TRACEBACK", None)
    # Threads do not outlive a fork, nor do the locks that they hold just then.
    tqdm.monitor_interval = 0
    cv2.setNumThreads(1)
    rng = random.Random(seed)
    place = Path(tempfile.mkdtemp(prefix="curling-fuzz-"))
    counts: Counter[str] = Counter()
    unclean: list[dict[str, Any]] = []
    worst = {"seconds": (0.0, ""), "memory": (0, "")}
    try:
        (place / "good").mkdir()
        targets = make_targets(place / "good", light=light)
        # A run that is not judged compiles and keeps the kernels that no good file needed.
        shutil.copytree(place / "good", place / "first")
        run(["track", "f.mp4", "--scene", "hall.json", "-o", "first.csv"], place / "first", "")
        end = time.monotonic() + 60 * minutes
        for tried in _inputs(targets, rng, only, light):
            if time.monotonic() > end or sum(counts.values()) >= inputs:
                break
            folder = place / "run"
            shutil.rmtree(folder, ignore_errors=True)
            folder.mkdir()
            for file, content in tried.files.items():
                put(folder / file, content)
            ended, name = run(tried.words, folder, tried.surroundings), tried.name
            counts[name] += 1
            for what, value in (("seconds", ended.seconds), ("memory", ended.memory)):
                if value > worst[what][0]:
                    worst[what] = (value, name)
            if ended.faults:
                unclean.append(_kept(keep, len(unclean), tried, ended))
                print(json.dumps(unclean[-1]), file=sys.stderr, flush=True)
            if sum(counts.values()) % 100 == 0:
                told = f"{sum(counts.values())} inputs, {len(unclean)} unclean"
                print(told, file=sys.stderr, flush=True)
    finally:
        shutil.rmtree(place, ignore_errors=True)
    return {
        "seed": seed,
        "inputs": sum(counts.values()),
        "unclean": len(unclean),
        "worst_seconds": [round(worst["seconds"][0], 1), worst["seconds"][1]],
        "worst_megabytes": [round(worst["memory"][0] / 2**20), worst["memory"][1]],
        "by_target": dict(counts.most_common()),
        "ends": unclean[:100],
    }


@dataclass(frozen=True, kw_only=True)
class Input:
    """One run.

    Parameters
    ----------
    name : the target and the kind of fault
    words : what follows `curling`
    files : contents by name
    surroundings : one of `SURROUNDINGS`; empty for the usual ones
    """

    name: str
    words: list[str]
    files: Mapping[str, bytes | Special]
    surroundings: str = ""


def _inputs(targets: list[Target], rng: random.Random, only: str, light: bool) -> Iterator[Input]:
    """Endless inputs of every kind."""
    good = {key: value for target in targets for key, value in target.files.items()}
    made = strategies(rng)
    chosen = [target for target in targets if only in target.name]
    known = [line.split() for line in lines_of(OPTIONS)]
    known = [words for words in known if not (light and words[0] in HEAVY)]
    while True:
        what = rng.random()
        if only == "options" or (what < 0.2 and not only):
            words = odd_command_line(rng.choice(known), rng)
            named = {Path(word).name for word in words}
            files = {key: value for key, value in good.items() if key in named}
            yield Input(name=f"{words[0]} options", words=words, files=files)
            continue
        target = rng.choices(chosen, [target.weight for target in chosen])[0]
        words, name = list(target.arguments), rng.choice(target.damaged)
        good_file = target.files[name]

        def one(
            kind: str,
            content: bytes | Special,
            surroundings: str = "",
            *,
            target: Target = target,
            words: list[str] = words,
            name: str = name,
        ) -> Input:
            return Input(
                name=f"{target.name} {kind}".strip(),
                words=words,
                files={**target.files, name: content},
                surroundings=surroundings,
            )

        if what < 0.25 and name != "q.json":  # which the fuzzer itself reads
            yield one("special", Special(rng.choice(KINDS)))
        elif what < 0.3 and words[0] != "read":
            content = good_file if rng.random() < 0.5 else damaged(good_file, rng)
            yield one("surroundings", content, rng.choice(list(SURROUNDINGS)))
        elif what < 0.45 and name in made:
            yield one("from the schema", next(made[name]))
        else:
            yield one("", damaged(good_file, rng))


def _kept(keep: Path, number: int, tried: Input, ended: Ended) -> dict[str, Any]:
    """Keep an input so that it can be run again, and say what became of it."""
    folder = keep / f"{number:03d}"
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    for file, content in tried.files.items():
        if isinstance(content, Special):
            (folder / f"{file}.special").write_text(content.kind)
        else:
            (folder / file).write_bytes(content)
    told = {"words": tried.words, "surroundings": tried.surroundings}
    (folder / "command.json").write_text(json.dumps(told))
    return {
        "target": tried.name,
        "faults": list(ended.faults),
        "status": ended.status,
        "said": ended.said[-400:],
        "command": [word[:80] for word in tried.words],
        "surroundings": tried.surroundings,
        "folder": str(folder),
    }


if __name__ == "__main__":
    raise SystemExit(main())
