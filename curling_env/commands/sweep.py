"""`curling sweep`: many throws on many ices with many errors, on any number of workers."""

from __future__ import annotations

from typing import Annotated

from typer import Option

from curling_env.commands.options import OutputFile, SeedOption, SkillOption, WorkersOption
from curling_env.commands.simulate import ReleasesOption
from curling_env.commands.terminal import print_remark, progress_bar
from curling_env.errors import InputError

MAX_ENDS = 10**8
"""Maximum number of throws of one sweep: their results are held in memory until they are
written.
"""


def sweep(
    releases: ReleasesOption,
    output: OutputFile,
    ice: Annotated[list[str] | None, Option(metavar="ICE", help="Ice; may be repeated.")] = None,
    seeds: Annotated[int, Option(min=1, help="Number of repeats of each throw and ice.")] = 1,
    seed: SeedOption = 0,
    skill: SkillOption = "none",
    workers: WorkersOption = "1",
) -> None:
    """Simulate every throw many times on every ice, and write the resting places.

    \b
    Examples:
        curling sweep --ice standard --ice fcv1 --releases r.csv -o ends.csv
        curling sweep --releases r.csv --skill club --seeds 1000 --workers 8 -o ends.csv
        curling sweep --releases r.csv --skill club --seeds 100000 --workers ray -o ends.csv

    Each throw is made alone on an empty sheet with a random execution error; every ice gets the
    same errors. The result is the same on any number of workers. It has one row for each ice
    (numbered from 0), seed and throw. See docs/how-to/cluster.md.
    """
    from curling_env.analysis.sweep import Sweep, run
    from curling_env.ice import load_ice
    from curling_env.infrastructure.executor import executor
    from curling_env.infrastructure.files.storage import write_table
    from curling_env.infrastructure.files.writing import atomic_path
    from curling_env.throw import read_releases

    thrown, names = read_releases(releases), ice or ["standard"]
    if (count := seeds * len(thrown) * len(names)) > MAX_ENDS:
        problem = f"that is {count:g} throws; a sweep has at most {MAX_ENDS:g}"
        raise InputError(problem, source="--seeds")
    plan = Sweep(
        ices=[load_ice(name) for name in names],
        releases=thrown,
        seeds=range(seed, seed + seeds),
        skill=skill,
    )
    with atomic_path(output) as draft:
        with executor(workers) as work, progress_bar("piece") as progress:
            ends = run(plan, work, progress=progress)
        write_table(draft, plan.table(ends))
    print_remark(f"{ends.x.size} throws: {output}")
