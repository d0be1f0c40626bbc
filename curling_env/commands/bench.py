"""`curling bench`: how fast it is on this machine."""

from __future__ import annotations

from typing import Annotated

import typer

from curling_env.commands.cli import print_json, progress_bar, say


def bench(
    json: Annotated[
        bool, typer.Option("--json", help="A JSON list of {name, value, unit} instead of a table.")
    ] = False,
) -> None:
    """Measure how many throws and film frames per second this machine does.

    Each number is the best of three runs on one core in processor time, unless its name says
    otherwise. The two measures of two cores use the clock on the wall and need a quiet machine. For
    comparison, the measures that begin with pymunk_only make the same throws with pymunk and a
    Python callback at 60 Hz. The first run on a machine also compiles for a minute, which is not
    counted.

    \b
    Example:
        curling bench
        curling bench --json > speed.json
    """
    from importlib.metadata import entry_points

    from curling_env.commands.benchmarks import Measure, measures
    from curling_env.typing import with_progress

    sources = [measures]
    sources += [point.load() for point in entry_points(group="curling.benchmarks")]
    found: list[Measure] = []
    with progress_bar("package") as progress:
        for source in with_progress(sources, "bench", progress):
            for measure in source():
                found.append(measure)
                if not json:
                    value = _readable(measure.value)
                    print(f"{measure.name:40} {value:>12} {measure.unit}", flush=True)
    if json:
        print_json([vars(measure) for measure in found])
    if not found:
        say("nothing to measure")


def _readable(value: float) -> str:
    return f"{value:,.0f}" if value >= 100 else f"{value:.3g}"
