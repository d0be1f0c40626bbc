"""Build the project, install it where nothing else is, and try it: `make release-check`.

Each line of the end is one environment: ``ok``, ``FAILED`` with the reason, or ``not checked`` with
what is missing here. Only failures make the exit status 1. What each step said is in runs/release.

Interpreters are looked for by name (python3.12) and among pyenv's; `--python` names others. PyTorch
is taken in the version of constraints.txt alone, because each other one is gigabytes to load.
"""

from __future__ import annotations

import argparse
import os
import re
import shutil
import subprocess
import sys
import tomllib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from release.artefacts import ROOT, build, faults_of

PYTHONS = ("3.11", "3.12", "3.13")
SMOKE = Path(__file__).with_name("smoke.py")
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
NOT_TRIED = ("dev", "docs")
"""Extras for those who work on the project: `make setup` installs them, with everything else."""


class Line(NamedTuple):
    """What became of one environment."""

    name: str
    state: str
    said: str = ""


@dataclass(frozen=True, kw_only=True)
class Workplace:
    """Where environments are made, and what is installed into them.

    Parameters
    ----------
    folder : for environments and logs
    wheel, sdist : the project as it would be released
    keep : whether environments stay
    """

    folder: Path
    wheel: Path
    sdist: Path
    keep: bool = False

    def tried(self, name: str, python: str, packages: list[str], checks: list[list[str]]) -> Line:
        """Make an environment, install packages, and run the checks of smoke.py in it.

        Parameters
        ----------
        name : name of the environment
        python : its interpreter
        packages : what is installed, as words for `uv pip install`
        checks : arguments of smoke.py, for each check
        """
        place, log = self.folder / name, self.folder / f"{name}.log"
        inside, empty = place / "bin" / "python", self.folder / f"{name}.files"
        shutil.rmtree(empty, ignore_errors=True)
        empty.mkdir()
        steps: list[list[str]] = [
            [*UV, "venv", "--quiet", "--clear", "--python", python, str(place)],
            [*UV, "pip", "install", "--quiet", "--python", str(inside), *FINDING, *packages],
            [*UV, "pip", "check", "--python", str(inside)],
            *([str(inside), "-I", str(SMOKE), *words] for words in checks),
        ]
        with log.open("w", encoding="utf-8") as file:
            for step in steps:
                file.write(f"$ {' '.join(step)}\n")
                file.flush()
                done = subprocess.run(
                    step, cwd=empty, env=ENVIRONMENT, stdout=file, stderr=subprocess.STDOUT
                )
                if done.returncode:
                    return Line(name, "FAILED", f"{_last_line(log)} (see {log})")
        if not self.keep:
            shutil.rmtree(place)
            shutil.rmtree(empty)
        return Line(name, "ok", f"{len(checks)} check{'s' * (len(checks) > 1)}")


UV = [sys.executable, "-m", "uv"]
FINDING = [f"--find-links={folder}" for folder in os.environ.get("PIP_FIND_LINKS", "").split()]
ENVIRONMENT = {
    key: value
    for key, value in os.environ.items()
    if key not in ("PYTHONPATH", "VIRTUAL_ENV", "PIP_REQUIRE_VIRTUALENV")
}


def main() -> None:
    options = argparse.ArgumentParser(prog="release", description=__doc__)
    options.add_argument("--python", action="append", default=[], help="a further interpreter")
    options.add_argument("--only", action="append", help="name of a check, as the end shows it")
    options.add_argument("--keep", action="store_true", help="keep the environments")
    given = options.parse_args()
    folder = ROOT / "runs" / "release"
    shutil.rmtree(folder, ignore_errors=True)
    (folder / "dist").mkdir(parents=True)
    print("building the sdist, and the wheel from it", flush=True)
    wheel, sdist = build(folder / "dist")
    faults = faults_of(wheel, sdist)
    lines = [Line("content", "FAILED", fault) for fault in faults] or [Line("content", "ok")]
    place = Workplace(folder=folder, wheel=wheel, sdist=sdist, keep=given.keep)
    found = interpreters(given.python)
    for name, run in plan(place, found).items():
        if given.only and name not in given.only:
            continue
        lines.append(run())
        print(_row(lines[-1]), flush=True)
    print("\n" + "\n".join(map(_row, lines)))
    count = {state: sum(line.state == state for line in lines) for state in STATES}
    print(", ".join(f"{number} {state}" for state, number in count.items()))
    sys.exit(1 if count["FAILED"] else 0)


STATES = ("ok", "FAILED", "not checked")


def plan(place: Workplace, found: dict[str, str | None]) -> dict[str, Callable[[], Line]]:
    """Every check by its name.

    Parameters
    ----------
    place : where they are made
    found : interpreters by version; None where there is none here
    """
    core, film = ["core", PROJECT["version"]], ["film"]
    checks: dict[str, Callable[[], Line]] = {}
    for version, python in found.items():
        name = f"python{version}"
        checks[name] = (
            _missing(name)
            if python is None
            else _later(place, name, python, [str(place.wheel)], [core, film])
        )
    version, python = next(((v, p) for v, p in found.items() if p), ("", None))
    if python is None:
        return checks
    checks["sdist"] = _later(place, "sdist", python, [str(place.sdist)], [core])
    checks["oldest"] = lambda: _oldest(place, version, python, [core, film])
    pinned = f"torch=={_locked('torch')}"
    for extra in PROJECT["optional-dependencies"]:
        if extra in NOT_TRIED:
            continue
        wanted = [f"{place.wheel}[{extra}]"]
        if any("torch" in asked for asked in PROJECT["optional-dependencies"][extra]):
            wanted.append(pinned)
        checks[extra] = _later(place, extra, python, wanted, [[extra]])
    return checks


def interpreters(others: list[str]) -> dict[str, str | None]:
    """Interpreters by version: those that users may have, and further ones."""
    found = {version: _interpreter(version) for version in PYTHONS}
    for python in others:
        if (version := _version_of(python)) is None:
            raise SystemExit(f"{python} is no Python that runs")
        found[version] = python
    return found


def _interpreter(version: str) -> str | None:
    """An interpreter of a version on this machine, or None."""
    name = f"python{version}"
    pyenv = Path(os.environ.get("PYENV_ROOT", Path.home() / ".pyenv"))
    there = [shutil.which(name), *map(str, pyenv.glob(f"versions/{version}.*/bin/{name}"))]
    return next((python for python in there if python and _version_of(python) == version), None)


def _version_of(python: str) -> str | None:
    """The version of an interpreter; None where it does not run."""
    words = [python, "-c", "import sys; print('%d.%d' % sys.version_info[:2])"]
    try:
        done = subprocess.run(words, capture_output=True, text=True)
    except OSError:
        return None
    return done.stdout.strip() if done.returncode == 0 else None


def _oldest(place: Workplace, version: str, python: str, checks: list[list[str]]) -> Line:
    """The oldest versions that pyproject.toml allows of what it names itself."""
    listed = place.folder / "oldest.txt"
    words = [*UV, "pip", "compile", "--quiet", "--no-header", "--no-annotate", *FINDING]
    words += ["--resolution", "lowest-direct", "--python-version", version]
    words += ["pyproject.toml", "--output-file", str(listed)]
    done = subprocess.run(words, cwd=ROOT, env=ENVIRONMENT, capture_output=True, text=True)
    if done.returncode:
        return Line("oldest", "FAILED", done.stderr.strip()[:300])
    packages = [str(place.wheel), "--requirement", str(listed)]
    line = place.tried("oldest", python, packages, checks)
    return line._replace(said=f"{line.said} with {_versions(listed)}")


def _versions(listed: Path) -> str:
    """What stands in the file of versions, of the packages that the project names itself."""
    named = {re.split(r"[^\w.-]", asked, maxsplit=1)[0] for asked in PROJECT["dependencies"]}
    rows = (row.split("==") for row in listed.read_text(encoding="utf-8").splitlines())
    return ", ".join(f"{row[0]} {row[1]}" for row in rows if row[0] in named)


def _later(
    place: Workplace, name: str, python: str, packages: list[str], checks: list[list[str]]
) -> Callable[[], Line]:
    return lambda: place.tried(name, python, packages, checks)


def _missing(name: str) -> Callable[[], Line]:
    return lambda: Line(name, "not checked", f"there is no {name} on this machine")


def _locked(name: str) -> str:
    """The version of a package in constraints.txt."""
    text = (ROOT / "constraints.txt").read_text(encoding="utf-8")
    found = re.search(rf"(?m)^{name}==([^ ;\\]+)", text)
    assert found is not None, f"constraints.txt has no {name}"
    return found[1]


def _last_line(log: Path) -> str:
    rows = [row.strip() for row in log.read_text(encoding="utf-8").splitlines() if row.strip()]
    return rows[-1][:300]


def _row(line: Line) -> str:
    return f"{line.name:16} {line.state:12} {line.said}".rstrip()


if __name__ == "__main__":
    main()
