"""`curling bench`: speed on this machine."""

from __future__ import annotations

from typing import Annotated

from typer import Option

from curling_env.commands.terminal import print_json, progress_bar


def bench(
    json: Annotated[bool, Option("--json", help="Print JSON: {name, value, unit}.")] = False,
) -> None:
    """Measure the speed of this machine: throws and film frames per second.

    \b
    Examples:
        curling bench
        curling bench --json > speed.json

    Each number is the best of three runs on one core, in processor time. The measures that begin
    with pymunk_only make the same throws with pymunk and a Python callback at 60 Hz, for
    comparison. The first run on a machine also compiles for a minute, which is not counted.
    """
    from importlib.metadata import entry_points

    from curling_env.benchmarks.measures import Measure, measures
    from curling_env.typing import with_progress

    sources = [measures]
    sources += [point.load() for point in entry_points(group="curling.benchmarks")]
    found: list[Measure] = []
    with progress_bar("package") as progress:
        for source in with_progress(sources, "bench", progress):
            for measure in source():
                found.append(measure)
                if not json:
                    digits = ",.0f" if measure.value >= 100 else ".3g"
                    print(
                        f"{measure.name:40} {measure.value:>12{digits}} {measure.unit}", flush=True
                    )
    if json:
        print_json([vars(measure) for measure in found])
