"""`curling benchmark`: the score of a policy on fixed tasks."""

from __future__ import annotations

from typing import Annotated

from typer import Argument, Option

from curling_env.commands.options import Results, grouped
from curling_env.commands.terminal import print_json, progress_bar
from curling_env.typing import Floats


@grouped
def benchmark(
    policy: Annotated[
        str,
        Argument(
            metavar="POLICY",
            help="random; planner (throws); draw, rulebased, greedy, search (ends); learned; a "
            "model's file; or module:object, a function or something with predict.",
        ),
    ],
    task: Annotated[list[str] | None, Option(help="Task; may be repeated. All by default.")] = None,
    episodes: Annotated[int, Option(min=2, max=10**6, help="Number of episodes per task.")] = 200,
    against: Annotated[
        str | None, Option(metavar="POLICY", help="Second policy, on the same episodes.")
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

    Seven tasks are single throws of a club player on held-out ices: draw, draw-mean, draw-blind,
    guard, takeout, hit-and-stay and freeze. Three are ends against rulebased, greedy and learned;
    end-draw is for practice. Seeds and ices are fixed, so that the same policy has the same score
    everywhere. See docs/benchmark.md.
    """
    from dataclasses import asdict

    from agents.benchmark import TASKS, difference_of, played, score_of
    from agents.benchmark.contestants import can_do, contestant
    from agents.benchmark.tasks import task_of

    names = [policy] if against is None else [policy, against]
    players = [contestant(name) for name in names]
    headline = [name for name, one in TASKS.items() if one.headline]
    chosen = [task_of(name) for name in task or headline]
    if task is None:
        chosen = [one for one in chosen if all(can_do(name, one) for name in names)]
    scores: list[dict[str, object]] = []
    values: list[list[Floats]] = []
    with progress_bar("episode") as progress:
        for one in chosen:
            found = [played(one, who, episodes=episodes, progress=progress) for who in players]
            values.append([counts for counts, _ in found])
            score = score_of(one, *found[0])
            scores.append(asdict(score))
            remark = one.asks
            if against is not None:
                more = difference_of(*([each] for each in values[-1])).in_words()
                remark = f"{more:28} more than {against}"
            if not results.as_json:
                print(f"{one.name:14} {score.in_words():28} {remark}", flush=True)
    together = None
    if against is not None and len({one.metric for one in chosen}) == 1:
        together = difference_of(*zip(*values, strict=True))
    if results.as_json:
        document: dict[str, object] = {"policy": policy, "scores": scores}
        if against is not None:
            each = [asdict(difference_of([own], [other])) for own, other in values]
            document |= {"against": against, "differences": each}
            document["together"] = None if together is None else asdict(together)
        print_json(document)
    elif together is not None and len(chosen) > 1:
        print(f"{'all together':43} {together.in_words()}")
