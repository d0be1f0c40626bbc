"""`curling benchmark`: the score of a policy on fixed tasks."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any

from typer import Argument, Option

from curling_env.commands.options import Results, grouped, output_to
from curling_env.commands.outputs import Writes
from curling_env.commands.terminal import print_json, progress_bar
from curling_env.errors import InputError


@grouped
def benchmark(
    policy: Annotated[
        list[str],
        Argument(
            metavar="POLICY...",
            help="random, constant, planner, learned, a player, models, module:object, or a row.",
        ),
    ],
    task: Annotated[list[str] | None, Option(help="Task; may be repeated. All by default.")] = None,
    episodes: Annotated[int, Option(min=2, max=10**6, help="Number of episodes per task.")] = 200,
    against: Annotated[
        str | None, Option(metavar="POLICY", help="Second policy, on the same episodes.")
    ] = None,
    output: Annotated[
        Path | None,
        output_to("ROW.json", "Also write a row with the metric of every episode."),
        Writes(suffixes=(".json",)),
    ] = None,
    *,
    results: Results,
) -> None:
    """Measure a policy on the ten tasks of the benchmark, with 95 % intervals.

    \b
    Examples:
        curling benchmark random
        curling benchmark planner --task draw --task takeout --episodes 40
        curling benchmark my_agent.npz --against rulebased --task end-greedy
        curling benchmark my_agent:policy --task end-rulebased --json
        curling benchmark runs/ppo/draw/*/model.zip --task draw -o row.json
        curling benchmark row.json

    Seven tasks are single throws of a club player on held-out ices: draw, draw-mean, draw-blind,
    guard, takeout, hit-and-stay and freeze. Three are ends against rulebased, greedy and learned;
    end-draw and end-doubles are for practice. The planner plays single throws, players play ends.
    Seeds and ices are fixed, so that the same policy has the same score everywhere. The score of
    several trainings is their interquartile mean. A row (.json) is checked and shown. See
    docs/benchmark.md.
    """
    from agents.benchmark import TASKS, difference_of, played
    from agents.benchmark.contestants import can_do, contestant
    from agents.benchmark.rows import write_row
    from agents.benchmark.scores import Played
    from agents.benchmark.tasks import task_of

    if any(name.endswith(".json") for name in policy):
        _show_rows(policy, results.as_json)
        return
    if against is not None and len(policy) > 1:
        raise InputError("--against compares two policies, not several trainings")
    names = policy if against is None else [*policy, against]
    players = [contestant(name) for name in names]
    headline = [name for name, one in TASKS.items() if one.headline]
    chosen = [task_of(name) for name in task or headline]
    if task is None:
        chosen = [one for one in chosen if all(can_do(name, one) for name in names)]
    found: list[Played] = []
    with progress_bar("episode") as progress:
        for one in chosen:
            runs = [played(one, who, episodes=episodes, progress=progress) for who in players]
            found.append(Played(one, [run[0] for run in runs], [run[1] for run in runs], against))
            if not results.as_json:
                print(found[-1].line(), flush=True)
    if output is not None:
        write_row(output, policy[0], {each.task.name: each.values for each in found})
    together = None
    if against is not None and len({one.metric for one in chosen}) == 1:
        together = difference_of(*zip(*(each.values for each in found), strict=True))
    if results.as_json:
        shown = policy[0] if len(policy) == 1 else policy
        document: dict[str, object] = {"policy": shown}
        document["scores"] = [asdict(each.score) for each in found]
        if against is not None:
            document |= {"against": against}
            document["differences"] = [asdict(each.difference) for each in found]
            document["together"] = None if together is None else asdict(together)
        print_json(document)
    elif together is not None and len(chosen) > 1:
        print(f"{'all tasks':43} {together.in_words()}")


def _show_rows(paths: list[str], as_json: bool) -> None:
    """Check rows and print them."""
    from agents.benchmark.rows import aggregate, read_row, scores_of, shortcomings

    documents: list[dict[str, Any]] = []
    for path in paths:
        row = read_row(path)
        mean, low, high = aggregate(row)
        about = {"policy": row.policy, "normalised": mean, "low": low, "high": high}
        documents.append({**about, "shortcomings": shortcomings(row)})
        documents[-1]["scores"] = [asdict(score) for score in scores_of(row)]
        if not as_json:
            print(f"{row.policy}: {mean:.2f} ({low:.2f} to {high:.2f}), random 0, reference 1")
            for score in scores_of(row):
                print(f"  {score.task:14} {score.in_words()}")
            for one in shortcomings(row):
                print(f"  cannot be published yet: {one}")
    if as_json:
        print_json(documents)
