"""`curling train`: an agent that learns to draw, measured beside the planner."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from curling_env.cli import IceOption, OutputDirectory, SeedOption, print_json, progress, say


def train(
    ice: IceOption = "standard",
    output: OutputDirectory = Path("runs/train"),
    algorithm: Annotated[str, typer.Option(help="sac, td3 or ppo.")] = "sac",
    steps: Annotated[int, typer.Option(min=1, help="Throws to learn from.")] = 20_000,
    target: Annotated[str, typer.Option(help="house (anywhere in it) or button.")] = "house",
    skill: Annotated[
        str,
        typer.Option(
            help="The hand that throws what the agent means: none, elite, champion, club."
        ),
    ] = "club",
    learning_rate: Annotated[float, typer.Option(help="Of the optimiser.")] = 1e-3,
    checkpoint_every: Annotated[
        int, typer.Option(min=0, help="Throws between checkpoints; 0 for none.")
    ] = 5_000,
    resume: Annotated[
        Path | None, typer.Option(metavar="CHECKPOINT.npz", help="Go on from a checkpoint.")
    ] = None,
    targets: Annotated[
        int, typer.Option(min=1, help="Draws in the evaluation, with `--target house`.")
    ] = 50,
    seed: SeedOption = 0,
) -> None:
    """Train an agent to draw on an ice.

    The agent learns on CurlingSheet-v0 with stable-baselines3, one throw an episode, its throws
    carried out with a player's execution error. At the end it is judged beside the planner, on the
    same targets with the same errors. Leaves model.npz, checkpoints and evaluation.json in the
    folder; models hold numbers and text only, so loading one never runs code.

    \b
    Examples:
        curling train --ice ice.json -o runs/club-draws
        curling train --ice ice.json --resume runs/club-draws/checkpoint-0010000.npz --steps 40000
    """
    import sys

    from tqdm import tqdm

    from agents import training
    from curling_env.ice import load_ice

    settings = training.TrainingSettings(
        algorithm=algorithm,
        steps=steps,
        target=target,
        skill=skill,
        learning_rate=learning_rate,
        seed=seed,
        checkpoint_every=checkpoint_every,
    )
    known = load_ice(ice)
    bar: Any = None  # begins with the first throw, so that bad input is refused without one

    def tell(done: int, reward: float) -> None:
        nonlocal bar
        if bar is None:
            bar = tqdm(
                total=steps, initial=done - 1, unit="throw", desc="learning", leave=False,
                mininterval=0.5, file=sys.stderr,
            )  # fmt: skip
        bar.update(done - bar.n)
        if done % 100 == 0:
            bar.set_postfix_str(f"reward {reward:.2f}", refresh=False)

    try:
        policy = training.train(known, output, settings, resume=resume, tell=tell)
    finally:
        if bar is not None:
            bar.close()
    result = training.evaluate(
        policy, known, settings, targets=targets,
        through=lambda items, label: progress(items, label, unit="draw"),
    )  # fmt: skip
    training.write_evaluation(output, result)
    agent, planner = result["agent"], result["planner"]
    say(
        f"mean miss of {result['targets']} draws with skill {skill}: agent "
        f"{100 * agent['mean_miss_with_error_m']:.0f} cm, planner "
        f"{100 * planner['mean_miss_with_error_m']:.0f} cm; with exact throws "
        f"{100 * agent['mean_miss_m']:.0f} cm and {100 * planner['mean_miss_m']:.1f} cm"
    )
    say(f"the agent: {output / 'model.npz'}")
    print_json(result)
