"""`curling train`: an agent that learns to draw, measured beside the planner."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from curling_env.commands.cli import IceOption, OutputDirectory, print_json, progress, say
from curling_env.errors import InputError


def train(
    config: Annotated[
        str,
        typer.Option(
            metavar="NAME|FILE",
            help="What is learnt and how: one of the project's configurations or a YAML file.",
        ),
    ] = "house-one-ice",
    ice: IceOption = "standard",
    output: OutputDirectory = Path("runs/train"),
    steps: Annotated[
        int | None, typer.Option(min=1, help="Throws to learn from, if not the configured.")
    ] = None,
    skill: Annotated[
        str | None,
        typer.Option(help="The hand: none, elite, champion, club, if not the configured."),
    ] = None,
    checkpoint_every: Annotated[
        int | None, typer.Option(min=0, help="Throws between checkpoints; 0 for none.")
    ] = None,
    resume: Annotated[
        Path | None,
        typer.Option(
            metavar="CHECKPOINT.npz|DIR",
            help="Go on from a checkpoint, or from the last one in a run's folder.",
        ),
    ] = None,
    workers: Annotated[
        str | None,
        typer.Option(
            metavar="rllib:N",
            help="Learn with RLlib: N workers share the sheets, on the Ray cluster or here.",
        ),
    ] = None,
    targets: Annotated[int, typer.Option(min=1, help="Draws in the evaluation.")] = 50,
    seed: Annotated[
        int | None, typer.Option(min=0, help="Of all randomness, if not the configured.")
    ] = None,
) -> None:
    """Train an agent to draw.

    The agent learns on CurlingSheet-v0 with stable-baselines3, its throws carried out with a
    player's execution error. A configuration says the rest, in the manner of RL Zoo: algorithm,
    throws, policy, environment, hyperparameters. With `ices` in it the agent learns on random ices
    of which it is told the estimated map, and --ice is not used.

    At the end it is judged beside the planner and beside the best possible throw, on draws it has
    not learnt from, with the same errors. Leaves model.npz, checkpoints, logs (CSV, and TensorBoard
    if installed) and evaluation.json in the folder; models hold numbers and text only, so loading
    one never runs code.

    A run that was killed ends as if it had not been, to the last bit, when it is resumed; a
    checkpoint knows its settings.

    With --workers rllib:N the same configuration (PPO's) is learnt with RLlib, on as many machines
    as the Ray cluster at hand has. The model is of the same kind; such a run keeps no checkpoints.

    The configuration ends-league trains a player of ends instead: generations meet themselves and
    their past selves. What is in the folder already is taken up. Its model.npz plays games
    (`curling tournament runs/ends/model.npz greedy`).

    \b
    Examples:
        curling train --config button-one-ice --ice ice.json -o runs/button
        curling train --config house-random-ices -o runs/any-ice
        curling train --resume runs/any-ice -o runs/any-ice
        curling train --workers rllib:8 -o runs/cluster
        curling train --config ends-league -o runs/ends
    """
    import sys

    from tqdm import tqdm

    from agents.learning import evaluation, training
    from agents.learning.configuration import configuration, read_configuration, with_settings
    from curling_env.ice import load_ice
    from curling_env.storage import write_json

    rllib_workers = None if workers is None else _rllib_workers(workers)
    if rllib_workers and resume is not None:
        raise InputError("a run with RLlib keeps no checkpoints; --resume is for one without")
    if resume is None:
        document = read_configuration(config)
        if isinstance(document, dict) and document.get("algorithm") == "league":
            if rllib_workers:
                raise InputError("a league is not trained with RLlib", source=config)
            _play_league(config, document, output, seed)
            return
    checkpoint = resume
    if resume is not None:
        checkpoint = training.latest_checkpoint(resume) if resume.is_dir() else resume
        settings = training.settings_of_run(checkpoint)
    else:
        settings = configuration(config)
    settings = with_settings(
        settings, n_timesteps=steps, skill=skill, checkpoint_every=checkpoint_every, seed=seed
    )
    thrown_on = load_ice(ice)
    if not (rllib_workers or training.has_tensorboard()):
        say("tensorboard is not installed: logs are CSV only (pip install 'curling-sheet[train]')")
    bar: Any = None  # begins with the first throw, so that bad input is refused without one

    def tell(done: int, reward: float) -> None:
        nonlocal bar
        if bar is None:
            bar = tqdm(
                total=settings.n_timesteps, initial=done, unit="throw", desc="learning",
                leave=False, mininterval=0.5, file=sys.stderr,
            )  # fmt: skip
            return
        bar.set_postfix_str(f"reward {reward:.2f}", refresh=False)
        bar.update(done - bar.n)

    try:
        if rllib_workers:
            from agents.learning import rllib

            thrower = rllib.train(output, settings, thrown_on, workers=rllib_workers, tell=tell)
        else:
            thrower = training.train(output, settings, thrown_on, resume=checkpoint, tell=tell)
    finally:
        if bar is not None:
            bar.close()
    say(f"the agent: {output / 'model.npz'}")
    cases = evaluation.cases_of(settings, thrown_on, targets)
    result = evaluation.judge(
        thrower, cases, seed=settings.seed,
        through=lambda items, label: progress(items, label, unit="draw"),
    )  # fmt: skip
    write_json(output / "evaluation.json", result)
    over = result["agent_over_best"]
    misses = ", ".join(
        f"{name} {100 * result[who]['mean_miss_with_error_m']:.0f} cm"
        for name, who in (("agent", "agent"), ("planner", "planner"), ("best possible", "best"))
    )
    say(
        f"mean miss with skill {settings.skill}, draws {result['draws']}: {misses}; agent over "
        f"best {over['ratio']:.2f} ({over['low']:.2f}-{over['high']:.2f})"
    )
    print_json(result)


def _rllib_workers(text: str) -> int:
    kind, _, count = text.partition(":")
    if kind != "rllib" or not (count.isascii() and count.isdigit() and int(count) > 0):
        raise InputError(f"--workers must be rllib: and a number of workers, got {text!r}")
    return int(count)


def _play_league(config: str, document: dict[str, Any], output: Path, seed: int | None) -> None:
    """Train a player of ends."""
    from agents.playing.league.run import league_from, run_league

    try:
        settings = league_from(document, **({} if seed is None else {"seed": seed}))
    except InputError as error:
        raise InputError(error.problem, source=config) from error
    run_league(
        output, settings,
        through=lambda items, label: progress(items, label, unit="batch"), tell=say,
    )  # fmt: skip
    say(f"the agent: {output / 'model.npz'}")
