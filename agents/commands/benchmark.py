"""`curling benchmark`: how well somebody does ten fixed tasks."""

from __future__ import annotations

from typing import Annotated

import typer

from curling_env.commands.cli import print_json, progress_bar


def benchmark(
    policy: Annotated[
        str,
        typer.Argument(
            metavar="POLICY",
            help="random; planner, for throws; draw, rulebased, greedy, search, for ends; learned, "
            "the trained models of the package; a model's file (.npz); or module:object, a "
            "function of observations or something with predict.",
        ),
    ],
    task: Annotated[
        list[str] | None,
        typer.Option(
            "--task", help="A task; may be given several times. By default all it can do."
        ),
    ] = None,
    episodes: Annotated[
        int, typer.Option(min=2, max=1_000_000, help="Episodes of each task.")
    ] = 200,
    as_json: Annotated[bool, typer.Option("--json", help="Print the scores as JSON.")] = False,
) -> None:
    """Measure a policy on the ten tasks of the benchmark, with 95 % intervals.

    Seven tasks are single throws of a club player on held-out ices: draw, draw-mean and draw-blind
    (the map known, its mean, or nothing; the distance from the target counts), guard, takeout,
    hit-and-stay and freeze (the share of successes counts). Three are ends against draw, rulebased
    and greedy (points scored less conceded count). The seeds of the episodes are fixed, so that the
    same policy has the same score everywhere. docs/benchmark.md has a table.

    \b
    Examples:
        curling benchmark random
        curling benchmark planner --task draw --task takeout --episodes 40
        curling benchmark learned --episodes 100
        curling benchmark my_agent:policy --task end-rulebased --json
    """
    from dataclasses import asdict

    from agents.benchmark import TASKS, measure
    from agents.benchmark.contestants import can_do, contestant
    from agents.benchmark.tasks import task_of

    who = contestant(policy)
    chosen = [task_of(name) for name in task or TASKS]
    if task is None:
        chosen = [one for one in chosen if can_do(policy, one)]
    scores = []
    with progress_bar(unit="episode") as progress:
        for one in chosen:
            scores.append(measure(one, who, episodes=episodes, progress=progress))
            if not as_json:
                print(f"{one.name:14} {scores[-1].in_words():28} {one.asks}", flush=True)
    if as_json:
        print_json({"policy": policy, "scores": [asdict(score) for score in scores]})
