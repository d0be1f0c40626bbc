"""Build the project, install it in clean environments, and test it: `make release-check`.

Each line of the result is one environment: ``ok``, ``FAILED`` with the reason, or ``not checked``
with the missing requirement. Only failures give the exit status 1. The output of each is in
runs/release.

Interpreters are found by name (python3.12) and among pyenv's. PyTorch is tested only in the version
of constraints.txt, because every other version is gigabytes to download.
"""

from __future__ import annotations

import argparse
import os
import re
import shutil
import subprocess
import sys
import tarfile
import tomllib
import zipfile
from collections.abc import Iterable
from pathlib import Path

ROOT = Path(__file__).parents[2]
PYTHONS = ("3.11", "3.12", "3.13")
SMOKE = Path(__file__).with_name("smoke.py")
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
NOT_TRIED = ("dev", "docs")
"""Extras for those who work on the project: `make setup` installs them, with everything else."""
PACKAGES = ("curling_env", "friction_estimation", "agents")
UV = [sys.executable, "-m", "uv"]
FINDING = [f"--find-links={folder}" for folder in os.environ.get("PIP_FIND_LINKS", "").split()]
ENVIRONMENT = {
    key: value
    for key, value in os.environ.items()
    if key not in ("PYTHONPATH", "VIRTUAL_ENV", "PIP_REQUIRE_VIRTUALENV")
}


def main() -> None:
    options = argparse.ArgumentParser(prog="release", description=__doc__)
    options.add_argument("--only", action="append", help="name of a check, as the end shows it")
    only = options.parse_args().only
    folder = ROOT / "runs" / "release"
    shutil.rmtree(folder, ignore_errors=True)
    (folder / "dist").mkdir(parents=True)
    words = [*UV, "build", "--quiet", *FINDING, "--out-dir", str(folder / "dist"), str(ROOT)]
    subprocess.run(words, check=True, env=ENVIRONMENT)
    (wheel,), (sdist,) = (list((folder / "dist").glob(name)) for name in ("*.whl", "*.tar.gz"))
    ends = {"content": "; ".join(faults_of(wheel, sdist))}
    for name, (python, packages, checks) in plan(folder, wheel, sdist).items():
        if only and name not in only:
            continue
        ends[name] = tried(folder, name, python, packages, checks) if python else MISSING
        print(f"{name:16} {ends[name] or 'ok'}", flush=True)
    print("\n" + "\n".join(f"{name:16} {end or 'ok'}" for name, end in ends.items()))
    sys.exit(any(end not in ("", MISSING) for end in ends.values()))


MISSING = "not checked  there is no such Python on this machine"
Check = tuple[str | None, list[str], list[list[str]]]
"""Interpreter, words for `uv pip install`, and words for smoke.py of each check."""


def plan(folder: Path, wheel: Path, sdist: Path) -> dict[str, Check]:
    """Return every check by its name."""
    core, film = ["core", PROJECT["version"]], ["film"]
    found = {version: interpreter(version) for version in PYTHONS}
    checks: dict[str, Check] = {
        f"python{version}": (python, [str(wheel)], [core, film])
        for version, python in found.items()
    }
    first = next((python for python in found.values() if python), None)
    checks["sdist"] = first, [str(sdist)], [core]
    oldest = folder / "oldest.txt"
    checks["oldest"] = first, [str(wheel), "--requirement", str(oldest)], [core, film]
    if first is not None:
        words = [*UV, "pip", "compile", "--quiet", "--resolution", "lowest-direct", *FINDING]
        words += ["--python", first, "pyproject.toml", "--output-file", str(oldest)]
        subprocess.run(words, cwd=ROOT, env=ENVIRONMENT, check=True)
    for extra, asked in PROJECT["optional-dependencies"].items():
        pinned = [locked("torch")] if any("torch" in package for package in asked) else []
        if extra not in NOT_TRIED:
            checks[extra] = first, [f"{wheel}[{extra}]", *pinned], [[extra]]
    return checks


def tried(
    folder: Path, name: str, python: str, packages: list[str], checks: list[list[str]]
) -> str:
    """Make an environment, install packages, and run the checks of smoke.py in it.

    Returns
    -------
    the reason of a failure; nothing after success
    """
    place, log = folder / name, folder / f"{name}.log"
    inside, empty = str(place / "bin" / "python"), folder / f"{name}.files"
    empty.mkdir()
    steps = [
        [*UV, "venv", "--quiet", "--python", python, str(place)],
        [*UV, "pip", "install", "--quiet", "--python", inside, *FINDING, *packages],
        [*UV, "pip", "check", "--python", inside],
        *([inside, "-I", str(SMOKE), *words] for words in checks),
    ]
    with log.open("w", encoding="utf-8") as file:
        for step in steps:
            print("$", *step, file=file, flush=True)
            done = subprocess.run(step, cwd=empty, env=ENVIRONMENT, stdout=file, stderr=file)
            if done.returncode:
                rows = log.read_text(encoding="utf-8").split("\n")
                return f"FAILED  {next(filter(None, map(str.strip, rows[::-1])))[:300]} (see {log})"
    shutil.rmtree(place)
    shutil.rmtree(empty)
    return ""


def interpreter(version: str) -> str | None:
    """Return an interpreter of a version on this machine that runs, or None."""
    name = f"python{version}"
    pyenv = Path(os.environ.get("PYENV_ROOT", Path.home() / ".pyenv"))
    there = [shutil.which(name), *map(str, pyenv.glob(f"versions/{version}.*/bin/{name}"))]
    for python in filter(None, there):
        if subprocess.run([python, "--version"], capture_output=True).returncode == 0:
            return python
    return None


def locked(name: str) -> str:
    """Return a package with its version in constraints.txt."""
    text = (ROOT / "constraints.txt").read_text(encoding="utf-8")
    found = re.search(rf"(?m)^{name}==[^ ;\\]+", text)
    assert found is not None, f"constraints.txt has no {name}"
    return found[0]


# --- content --------------------------------------------------------------------------------------


def tracked_files() -> list[str]:
    """Return the tracked files of the packages, all of which must be in the wheel."""
    words = ["git", "ls-files", "-z", *PACKAGES, "curling.py"]
    listed = subprocess.run(words, cwd=ROOT, check=True, capture_output=True, text=True).stdout
    return sorted(name for name in listed.split("\0") if name)


def faults_of(wheel: Path, sdist: Path) -> list[str]:
    """Return the faults of the content of both files, one line each."""
    with zipfile.ZipFile(wheel) as archive, tarfile.open(sdist) as packed:
        names = archive.namelist()
        in_sdist = [name.partition("/")[2] for name in packed.getnames()]
    needed = [*tracked_files(), "pyproject.toml", "README.md", "LICENSE", "PKG-INFO"]
    missing = sorted(set(needed) - set(in_sdist))
    return wheel_faults(names, tracked_files()) + [f"the sdist lacks {name}" for name in missing]


def wheel_faults(names: Iterable[str], wanted: Iterable[str]) -> list[str]:
    """Return what is wrong with the content of a wheel, one line each.

    Parameters
    ----------
    names : files in the wheel
    wanted : files of the repository that belong into it
    """
    installed = {name for name in names if ".dist-info/" not in name}
    expected = {*wanted, *(f"{package}/py.typed" for package in PACKAGES)}
    faults = [f"the wheel lacks {name}" for name in sorted(expected - installed)]
    faults += [f"the wheel has {name}, which git does not" for name in sorted(installed - expected)]
    if not any(name.endswith(".dist-info/licenses/LICENSE") for name in names):
        faults.append("the wheel lacks its licence")
    return faults


if __name__ == "__main__":
    main()
