"""Small faults in the code that the tests notice."""

from __future__ import annotations

import json
import subprocess
from tempfile import TemporaryDirectory

from figures import ROOT


def noticed(options: str) -> dict[str, float]:
    """Return the share of small faults that the tests notice [%], by area and for all.

    Parameters
    ----------
    options : options of `scripts/mutation.py`, such as `-n 300`
    """
    with TemporaryDirectory() as out:
        words = ["make", "-s", "mutants", "JOBS=2", f"MUTANTS={options} --out {out}"]
        done = subprocess.run(words, cwd=ROOT, check=True, stdout=subprocess.PIPE, text=True)
    return json.loads(done.stdout.splitlines()[-1])
