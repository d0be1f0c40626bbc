"""Write constraints.txt: every version, with the SHA-256 of every file it may be installed from.

constraints-core.txt holds the entries of it that the package needs without extras. `make lock` runs
this with uv, which resolves for all systems and Python versions at once. Versions stay as they are
unless they no longer fit; `make lock UPGRADE=--upgrade` takes the newest.
"""

from __future__ import annotations

import argparse
import re
import subprocess
import sys
import tomllib
from pathlib import Path

ROOT = Path(__file__).parents[1]
LOCK = ROOT / "constraints.txt"
CORE = ROOT / "constraints-core.txt"
EXTRAS = (
    *("dev", "docs", "train", "viewer", "game", "ray", "parquet", "science"),
    *("digital-curling", "app"),
)
"""What `make setup` installs."""
HEADER = """\
# The versions everything was tested with, and the SHA-256 of every file that each may be installed
# from; `make setup` installs these. Renew them with `make lock`, then run `make test lint`.
"""
CORE_HEADER = """\
# The part of constraints.txt that the package needs without extras: what `make demo` installs.
# Written by `make lock`.
"""
BUILT_WITH = "setuptools>=77"
LEFT_TO_PIP = re.compile(r"(nvidia|cuda)-|triton==")
"""Gigabytes that only PyTorch's build for NVIDIA's GPUs needs, and fixes itself."""


def main() -> None:
    options = argparse.ArgumentParser(prog="lock", description=__doc__)
    options.add_argument("--upgrade", action="store_true", help="take the newest versions")
    extras = [word for extra in EXTRAS for word in ("--extra", extra)]
    upgrade = ["--upgrade"] * options.parse_args().upgrade
    LOCK.write_text(HEADER + without_gpu(_resolve(LOCK, *extras, *upgrade)), encoding="utf-8")
    core = _resolve(CORE, "--constraint", str(LOCK))
    CORE.write_text(CORE_HEADER + core, encoding="utf-8")


def _resolve(output: Path, *options: str) -> str:
    """Return the versions and hashes that uv finds, keeping those in the file where they fit."""
    python = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["requires-python"]
    words = ["uv", "pip", "compile", "pyproject.toml", "-", "--quiet", "--universal"]
    words += ["--python-version", python.removeprefix(">="), "--generate-hashes"]
    words += ["--no-header", "--no-annotate", "--output-file", str(output), *options]
    # Editable installations build with setuptools, which no dependency names.
    subprocess.run(
        [sys.executable, "-m", *words], cwd=ROOT, check=True, input=BUILT_WITH, text=True
    )
    return output.read_text(encoding="utf-8")


def without_gpu(locked: str) -> str:
    """The entries of a lock without what is left to pip."""
    entries = [k for k in re.split(r"(?m)^(?=[A-Za-z])", locked) if re.match("[A-Za-z]", k)]
    return "".join(entry for entry in entries if not LEFT_TO_PIP.match(entry))


if __name__ == "__main__":
    main()
