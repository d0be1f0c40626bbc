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
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from fuzz.documents import strategies
from fuzz.mutations import NASTY_NUMBERS, NASTY_TEXTS, damaged
from fuzz.runs import Ended, run
from fuzz.targets import HEAVY, OPTIONS, Target, make_targets


def main() -> int:
    options = argparse.ArgumentParser(prog="fuzz", description=__doc__)
    options.add_argument("--minutes", type=float, default=10.0)
    options.add_argument("--inputs", type=int, default=10**9, help="end after so many")
    options.add_argument("--seed", type=int, default=None, help="fixed: the same inputs again")
    options.add_argument("--light", action="store_true", help="without what takes seconds a run")
    options.add_argument("--only", default="", help="part of a target's name")
    options.add_argument("--keep", type=Path, default=Path("runs/fuzz"), help="for unclean inputs")
    chosen = options.parse_args()
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
    rng = random.Random(seed)
    place = Path(tempfile.mkdtemp(prefix="curling-fuzz-"))
    counts: Counter[str] = Counter()
    unclean: list[dict[str, Any]] = []
    worst = {"seconds": (0.0, ""), "memory": (0, "")}
    try:
        (place / "good").mkdir()
        targets = make_targets(place / "good", light=light)
        end = time.monotonic() + 60 * minutes
        for name, words, files in _inputs(targets, rng, only, light):
            if time.monotonic() > end or sum(counts.values()) >= inputs:
                break
            folder = place / "run"
            shutil.rmtree(folder, ignore_errors=True)
            folder.mkdir()
            for file, content in files.items():
                (folder / file).write_bytes(content)
            ended = run(words, folder)
            counts[name] += 1
            for what, value in (("seconds", ended.seconds), ("memory", ended.memory)):
                if value > worst[what][0]:
                    worst[what] = (value, name)
            if ended.faults:
                unclean.append(_kept(keep, len(unclean), name, words, files, ended))
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


def _inputs(
    targets: list[Target], rng: random.Random, only: str, light: bool
) -> Iterator[tuple[str, list[str], dict[str, bytes]]]:
    """Endless inputs: a name, what follows `curling`, and the files."""
    good = {key: value for target in targets for key, value in target.files.items()}
    made = strategies(rng)
    chosen = [target for target in targets if only in target.name]
    known = [words for words in OPTIONS if not (light and words[0] in HEAVY)]
    while True:
        what = rng.random()
        if (what < 0.15 and not only) or only == "options":
            words = list(rng.choice(known))
            yield "options", _replaced(words, rng), {k: v for k, v in good.items() if k in words}
            continue
        target = rng.choices(chosen, [target.weight for target in chosen])[0]
        files = dict(target.files)
        name = rng.choice(target.damaged)
        if what < 0.35 and name in made:
            files[name] = next(made[name])
            yield f"{target.name}, from the schema", list(target.arguments), files
        else:
            files[name] = damaged(files[name], rng)
            yield target.name, list(target.arguments), files


def _replaced(words: list[str], rng: random.Random) -> list[str]:
    """The words of a command with one or two replaced."""
    for _ in range(rng.choice((1, 1, 2))):
        k = rng.randrange(1, len(words)) if len(words) > 1 else 0
        nasty = (
            *NASTY_NUMBERS,
            *NASTY_TEXTS,
            ".",
            "/",
            "/dev/full",
            "f.mp4",
            "ice.json",
            "-o",
            "--",
        )
        what = rng.choice(nasty)
        words[k] = (
            what.replace("\0", "") if rng.random() < 0.9 else words[k] + what.replace("\0", "")
        )
    return words


def _kept(
    keep: Path, number: int, name: str, words: list[str], files: dict[str, bytes], ended: Ended
) -> dict[str, Any]:
    """Keep an input so that it can be run again, and say what became of it."""
    folder = keep / f"{number:03d}"
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    for file, content in files.items():
        (folder / file).write_bytes(content)
    (folder / "command.json").write_text(json.dumps(words))
    return {
        "target": name,
        "faults": list(ended.faults),
        "status": ended.status,
        "said": ended.said[-400:],
        "command": [word[:80] for word in words],
        "folder": str(folder),
    }


if __name__ == "__main__":
    raise SystemExit(main())
