"""`curling benchmark`: how well somebody does ten fixed tasks."""

from __future__ import annotations

from typing import Annotated, Any

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
    against: Annotated[
        str | None,
        typer.Option(
            metavar="POLICY", help="Somebody else, who plays the same episodes to be compared with."
        ),
    ] = None,
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
        curling benchmark my_agent.npz --against rulebased --task end-draw --task end-greedy
        curling benchmark my_agent:policy --task end-rulebased --json
    """
    from dataclasses import asdict

    from agents.benchmark import TASKS, difference_of, played, score_of
    from agents.benchmark.contestants import can_do, contestant
    from agents.benchmark.tasks import task_of

    who, other = contestant(policy), None if against is None else contestant(against)
    chosen = [task_of(name) for name in task or TASKS]
    if task is None:
        names = [policy] if against is None else [policy, against]
        chosen = [one for one in chosen if all(can_do(name, one) for name in names)]
    scores, own, others = list[Any](), list[Any](), list[Any]()
    with progress_bar(unit="episode") as progress:
        for one in chosen:
            values, rewards = played(one, who, episodes=episodes, progress=progress)
            scores.append(score_of(one, values, rewards))
            line = f"{one.name:14} {scores[-1].in_words():28} {one.asks}"
            if other is not None:
                own.append(values)
                others.append(played(one, other, episodes=episodes, progress=progress)[0])
                more = difference_of(own[-1:], others[-1:]).in_words()
                line = f"{one.name:14} {scores[-1].in_words():28} {more:28} more than {against}"
            if not as_json:
                print(line, flush=True)
    alike = len({one.metric for one in chosen}) == 1
    together = difference_of(own, others) if own and alike else None
    if as_json:
        document = {"policy": policy, "scores": [asdict(score) for score in scores]}
        if against is not None:
            each = [asdict(difference_of([a], [b])) for a, b in zip(own, others, strict=True)]
            document |= {"against": against, "differences": each}
            document["together"] = None if together is None else asdict(together)
        print_json(document)
    elif together is not None and len(chosen) > 1:
        print(f"{'all together':43} {together.in_words()}")
