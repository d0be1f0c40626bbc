"""`curling bench`: how fast it is on this machine."""

from __future__ import annotations

from typing import Annotated

import typer

from curling_env.commands.cli import print_json, progress, say


def bench(
    json: Annotated[
        bool, typer.Option("--json", help="A JSON list of {name, value, unit} instead of a table.")
    ] = False,
) -> None:
    """Measure how many throws and frames a second this machine does.

    One core unless the name says otherwise, processor time, best of three; the two measures of two
    cores go by the clock on the wall and want a quiet machine. The measures whose name
    begins with pymunk_only are the same throws done by pymunk and a Python callback at 60 Hz, as a
    scale. The first run on a machine compiles for a minute; that is not counted.

    \b
    Example:
        curling bench
        curling bench --json > speed.json
    """
    from importlib.metadata import entry_points

    from curling_env.commands.benchmarks import Measure, measures

    sources = [measures]
    sources += [point.load() for point in entry_points(group="curling.benchmarks")]
    found: list[Measure] = []
    for source in progress(sources, "bench", total=len(sources), unit="package"):
        for measure in source():
            found.append(measure)
            if not json:
                print(
                    f"{measure.name:40} {_readable(measure.value):>12} {measure.unit}", flush=True
                )
    if json:
        print_json([vars(measure) for measure in found])
    if not found:
        say("nothing to measure")


def _readable(value: float) -> str:
    return f"{value:,.0f}" if value >= 100 else f"{value:.3g}"
