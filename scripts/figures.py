"""Check the project's figures against figures.json, and write docs/results.md from it.

    python scripts/figures.py check                    the quick figures of every group
    python scripts/figures.py check physics game       those of two groups
    python scripts/figures.py check films --long       the long ones too
    python scripts/figures.py check --only physics.rests --write
    python scripts/figures.py page                     docs/results.md, from figures.json

Each figure names the command that measures it. The command prints one JSON object with its values
(or a list of {"name", "value"}) as the last line on stdout. Figures that moved by more than their
tolerance are listed; the exit status is 1 if one of them got worse or could not be measured.
"""

from __future__ import annotations

import json
import os
import re
import shlex
import subprocess
import sys
import time
from collections.abc import Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from datetime import date
from itertools import groupby
from pathlib import Path
from typing import Annotated, Literal

import msgspec
import typer
from tqdm import tqdm

ROOT = Path(__file__).parents[1]
FIGURES = ROOT / "figures.json"
PAGE = ROOT / "docs" / "results.md"
GROUPS = {
    "physics": "Physics",
    "films": "Films",
    "inference": "Inference",
    "game": "Games",
    "learning": "Learning",
    "app": "App and coaching",
}
"""Heading on the results page, by group."""


class Figure(msgspec.Struct, kw_only=True, forbid_unknown_fields=True):
    """Measured number, with the command that measures it."""

    name: str
    """Name, as GROUP.MEASURE.KEY; the command prints the key."""
    question: str
    """Title of the figure's table; the same for all figures of a command."""
    label: str
    value: float
    tolerance: float
    """Maximum change that is not reported, in the figure's unit."""
    unit: str
    direction: Literal["higher", "lower", "either"]
    """Better direction; with `either` every change beyond the tolerance counts as worse."""
    command: str
    seconds: float
    """Time the command takes on one core [s]."""
    long: bool = False
    """True if the quick set excludes the command."""
    alone: bool = False
    """True if the command measures time, so that nothing else may run beside it."""
    needs: str = ""
    """Path, from the root, that the command needs and the repository does not hold."""
    date: str
    commit: str

    @property
    def group(self) -> str:
        """First part of the name."""
        return self.name.split(".", 1)[0]

    @property
    def key(self) -> str:
        """Last part of the name."""
        return self.name.rsplit(".", 1)[1]

    def verdict(self, value: float) -> Literal["same", "better", "worse"]:
        """Compare a new value with the recorded one."""
        change = value - self.value
        if abs(change) <= self.tolerance:  # False for NaN, which is worse
            return "same"
        wanted = {"higher": 1, "lower": -1, "either": 0}[self.direction]
        return "better" if change * wanted > 0 else "worse"


class FigureError(Exception):
    """Fault in figures.json, or command that did not print its figures."""


def load(path: Path | None = None) -> list[Figure]:
    """Read and check figures.json, or another file of its form.

    Raises
    ------
    FigureError : the file breaks its schema, or two entries contradict each other
    """
    path = path or FIGURES
    try:
        figures = msgspec.json.decode(path.read_bytes(), type=list[Figure])
    except msgspec.DecodeError as error:
        raise FigureError(f"{path.name}: {error}") from None
    seen: set[str] = set()
    for figure in figures:
        if not re.fullmatch(r"[a-z]+(\.[a-z0-9_]+){2}", figure.name) or figure.group not in GROUPS:
            raise FigureError(
                f"{path.name}: name {figure.name!r}, expected GROUP.MEASURE.KEY with GROUP one of "
                f"{', '.join(GROUPS)}"
            )
        if figure.name in seen:
            raise FigureError(f"{path.name}: {figure.name} is listed twice")
        seen.add(figure.name)
    for command, same in _by_command(figures).items():
        for field in ("question", "seconds", "long", "alone", "needs", "date", "commit"):
            if len({getattr(figure, field) for figure in same}) > 1:
                raise FigureError(f"{path.name}: figures of {command!r} differ in {field!r}")
    return figures


def save(figures: Iterable[Figure]) -> None:
    """Write figures.json, one figure a line, so that a change shows as one line."""
    lines = [json.dumps(msgspec.to_builtins(k), ensure_ascii=False) for k in figures]
    text = "[\n" + ",\n".join(lines) + "\n]\n"
    beside = FIGURES.with_name(f".{FIGURES.name}.new")
    beside.write_text(text, encoding="utf-8")
    os.replace(beside, FIGURES)


def _by_command(figures: Iterable[Figure]) -> dict[str, list[Figure]]:
    commands: dict[str, list[Figure]] = {}
    for figure in figures:
        commands.setdefault(figure.command, []).append(figure)
    return commands


class Measured(msgspec.Struct, kw_only=True):
    """Result of a command: values by key, or the reason for their absence."""

    values: dict[str, float] = {}
    seconds: float = 0.0
    failure: str = ""


def measure(command: str) -> Measured:
    """Run one command of figures.json on one core, and read its values."""
    single = {f"{name}_NUM_THREADS": "1" for name in ("OMP", "OPENBLAS", "MKL", "NUMBA")}
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ.get("PATH", "")])
    began = time.monotonic()
    done = subprocess.run(
        shlex.split(command),
        cwd=ROOT,
        env={**os.environ, **single, "PATH": path},
        capture_output=True,
        text=True,
        check=False,
    )
    seconds = time.monotonic() - began
    lines = done.stdout.strip().splitlines()
    if done.returncode or not lines:
        last = (done.stderr.strip().splitlines() or ["no output"])[-1]
        return Measured(failure=f"exit {done.returncode}: {last}", seconds=seconds)
    try:
        found = json.loads(lines[-1] if lines[-1].startswith("{") else done.stdout)
        values = found if isinstance(found, dict) else {k["name"]: k["value"] for k in found}
        return Measured(values={k: float(v) for k, v in values.items()}, seconds=seconds)
    except (ValueError, TypeError, KeyError) as error:
        return Measured(failure=f"no JSON of values on stdout ({error})", seconds=seconds)


def run(figures: Sequence[Figure], workers: int) -> dict[str, Measured]:
    """Run the commands of the figures: side by side, then alone those that time something."""
    commands = _by_command(figures)
    found: dict[str, Measured] = {}
    alone = [command for command, same in commands.items() if same[0].alone]
    beside = sorted(commands.keys() - set(alone), key=lambda k: -commands[k][0].seconds)
    with tqdm(total=len(commands), unit="command", disable=None) as bar:
        for width, batch in ((workers, beside), (1, alone)):
            with ThreadPoolExecutor(width) as pool:
                waiting = {pool.submit(measure, command): command for command in batch}
                for done in as_completed(waiting):
                    found[waiting[done]] = done.result()
                    bar.update()
    return found


def compare(
    figures: Sequence[Figure], found: Mapping[str, Measured]
) -> tuple[list[str], dict[str, int]]:
    """Return lines on figures that moved or failed, and the number of each kind."""
    lines: list[str] = []
    counts: dict[str, int] = dict.fromkeys(("same", "better", "worse", "failed"), 0)
    for figure in figures:
        result = found[figure.command]
        value = result.values.get(figure.key)
        if value is None:
            counts["failed"] += 1
            reason = result.failure or f"{figure.key!r} is not in its output"
            lines.append(f"failed  {figure.name}: {figure.command}: {reason}")
            continue
        verdict = figure.verdict(value)
        counts[verdict] += 1
        if verdict != "same":
            lines.append(
                f"{verdict:7} {figure.name}: {shown(figure.value)} -> {shown(value)} {figure.unit}"
                f" (tolerance {shown(figure.tolerance)})".replace("  ", " ")
            )
    return lines, counts


def shown(value: float) -> str:
    """Format a number with four digits, and whole from a thousand on."""
    whole = value == round(value) or abs(value) >= 1000
    return f"{value:.0f}" if whole else f"{value:.4g}"


INTRODUCTION = """\
# Measured results

Every figure that the README, a page, a default or a decision relies on, with the command that
measures it, its time on one core, and the date and commit of the value. `make figures-page` writes
this page from `figures.json`. `make figures` measures all but the long ones again and lists what
moved by more than the tolerance (±). ↑ higher is better, ↓ lower is better. Times and rates depend
on the machine; ratios are measured in one run. Processors round differently, and errors of films
may differ by the tolerance between them. `runs/independent` holds films, shots and games that other
programs made; they are not part of the repository."""


def page(figures: Sequence[Figure]) -> str:
    """Return the text of docs/results.md."""
    lines = [INTRODUCTION]
    for group, heading in GROUPS.items():
        own = [figure for figure in figures if figure.group == group]
        lines += ["", f"## {heading}"] if own else []
        for question, rows in groupby(own, key=lambda k: k.question):
            lines += ["", f"### {question}"]
            lines += ["| | Value | ± | Unit | Command |", "|---|---|---|---|---|"]
            command = ""
            for k in rows:
                better = {"higher": " ↑", "lower": " ↓", "either": ""}[k.direction]
                how = _how(k) if k.command != command else ""
                row = [k.label + better, shown(k.value), shown(k.tolerance), k.unit or "–", how]
                lines.append(f"| {' | '.join(row)} |")
                command = k.command
    return "\n".join([*lines, ""])


def _how(figure: Figure) -> str:
    """Return a figure's command, its duration, and the date and commit of its last run."""
    notes = [_duration(figure.seconds), figure.date, figure.commit]
    notes += ["long"] * figure.long + [f"needs {figure.needs}"] * bool(figure.needs)
    return f"`{figure.command}` ({', '.join(notes)})"


def _duration(seconds: float) -> str:
    return f"{seconds:.0f} s" if seconds < 100 else f"{seconds / 60:.0f} min"


def _commit() -> str:
    """Return the commit that is measured.

    Raises
    ------
    FigureError : tracked files other than the figures and their page were changed since
    """
    changed = subprocess.check_output(["git", "status", "--porcelain"], cwd=ROOT, text=True)
    own = {str(path.relative_to(ROOT)) for path in (FIGURES, PAGE)}
    other = [line[3:] for line in changed.splitlines() if line[3:] not in own and line[:2] != "??"]
    if other:
        raise FigureError(f"commit first: {other[0]} was changed, so that no commit has this value")
    return subprocess.check_output(
        ["git", "rev-parse", "--short=7", "HEAD"], cwd=ROOT, text=True
    ).strip()


app = typer.Typer(add_completion=False, pretty_exceptions_enable=False)


@app.command()
def check(
    groups: Annotated[
        list[str] | None, typer.Argument(help=f"Groups: {', '.join(GROUPS)}. Default: all.")
    ] = None,
    only: Annotated[
        list[str] | None, typer.Option(help="Figures whose name starts with this; repeatable.")
    ] = None,
    long: Annotated[bool, typer.Option("--long", help="Include the long ones.")] = False,
    write: Annotated[
        bool, typer.Option("--write", help="Record the new values, and write the page.")
    ] = False,
    workers: Annotated[int, typer.Option(min=1, help="Commands to run side by side.")] = 2,
) -> None:
    """Measure figures again and list what moved."""
    unknown = sorted(set(groups or ()) - set(GROUPS))
    if unknown:
        raise FigureError(f"unknown group {unknown[0]!r}; expected one of {', '.join(GROUPS)}")
    figures = load()
    chosen = [
        figure
        for figure in figures
        if (figure.group in groups if groups else True)
        and (figure.name.startswith(tuple(only)) if only else True)
        and (long or only or not figure.long)
    ]
    ready = [figure for figure in chosen if not _missing(figure.needs)]
    if not ready:
        raise FigureError("no figure matches; `figures.json` has their names")
    commit = _commit() if write else ""
    found = run(ready, workers)
    lines, counts = compare(ready, found)
    for line in lines:
        print(line)
    for needs in sorted({figure.needs for figure in chosen} - {figure.needs for figure in ready}):
        print(f"not measured: figures that need {needs}")
    print(f"{len(ready)} figures: " + ", ".join(f"{n} {kind}" for kind, n in counts.items()))
    if write:
        for figure in ready:
            result = found[figure.command]
            if figure.key in result.values:
                figure.value = float(f"{result.values[figure.key]:.6g}")
                figure.seconds = round(result.seconds)
                figure.date, figure.commit = str(date.today()), commit
        save(figures)
        PAGE.write_text(page(figures), encoding="utf-8")
    if counts["worse"] or counts["failed"]:
        raise typer.Exit(1)


def _missing(needs: str) -> bool:
    """Return whether a path that a command needs does not exist."""
    return bool(needs) and not (ROOT / needs).exists()


@app.command(name="page")
def write_page() -> None:
    """Write docs/results.md from figures.json."""
    PAGE.write_text(page(load()), encoding="utf-8")


def main() -> int:
    """Run the program; exit status 0, 1 (a figure got worse) or 2 (bad usage)."""
    try:
        app()
    except FigureError as error:
        print(f"figures: {error}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
