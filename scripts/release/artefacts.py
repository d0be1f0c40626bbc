"""The wheel and the sdist of the project: built, and held to what the repository has."""

from __future__ import annotations

import re
import subprocess
import sys
import tarfile
import zipfile
from collections.abc import Iterable
from pathlib import Path

ROOT = Path(__file__).parents[2]
PACKAGES = ("curling_env", "friction_estimation", "agents")
MODULES = ("curling.py",)
NEVER = re.compile(r"(^|/)(tests?|docs|scripts|\.github|\.ci)/")
"""Folders that no wheel has: they would be installed beside everybody's packages."""


def build(folder: Path) -> tuple[Path, Path]:
    """Build the sdist, and the wheel from it.

    Parameters
    ----------
    folder : empty folder to write to; the Python that runs has the package `build`

    Returns
    -------
    the wheel and the sdist

    Raises
    ------
    subprocess.CalledProcessError : neither can be built
    """
    words = [sys.executable, "-m", "build", "--outdir", str(folder), str(ROOT)]
    subprocess.run(words, check=True, stdout=subprocess.DEVNULL)
    (wheel,), (sdist,) = folder.glob("*.whl"), folder.glob("*.tar.gz")
    return wheel, sdist


def tracked_files() -> list[str]:
    """What git knows of the packages: everything that must be in the wheel."""
    words = ["git", "ls-files", "-z", *PACKAGES, *MODULES]
    listed = subprocess.run(words, cwd=ROOT, check=True, capture_output=True, text=True).stdout
    return sorted(name for name in listed.split("\0") if name)


def wheel_faults(names: Iterable[str], wanted: Iterable[str]) -> list[str]:
    """What is wrong with the content of a wheel, one line each.

    Parameters
    ----------
    names : files in the wheel
    wanted : files of the repository that belong into it
    """
    there = set(names)
    installed = {name for name in there if ".dist-info/" not in name}
    expected = set(wanted)
    faults = [f"the wheel lacks {name}" for name in sorted(expected - installed)]
    faults += [f"the wheel has {name}, which git does not" for name in sorted(installed - expected)]
    faults += [f"the wheel has {name}" for name in sorted(installed) if NEVER.search(name)]
    faults += [
        f"the wheel lacks {package}/py.typed"
        for package in PACKAGES
        if f"{package}/py.typed" not in there
    ]
    if not any(name.endswith(".dist-info/licenses/LICENSE") for name in there):
        faults.append("the wheel lacks its licence")
    return faults


def sdist_faults(names: Iterable[str], wanted: Iterable[str]) -> list[str]:
    """What is wrong with the content of an sdist, one line each; names begin with its folder."""
    there = {name.partition("/")[2] for name in names}
    needed = {*wanted, "pyproject.toml", "README.md", "LICENSE", "PKG-INFO"}
    return [f"the sdist lacks {name}" for name in sorted(needed - there)]


def faults_of(wheel: Path, sdist: Path) -> list[str]:
    """What is wrong with both files."""
    wanted = tracked_files()
    with zipfile.ZipFile(wheel) as archive:
        faults = wheel_faults(archive.namelist(), wanted)
    with tarfile.open(sdist) as archive:
        return faults + sdist_faults(archive.getnames(), wanted)
