"""`curling train`: train an agent to draw, or a player of ends."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from curling_env.commands.cli import (
    IceOption,
    JsonOption,
    OutputDirectory,
    UnitsOption,
    conclude,
    progress_bar,
    say,
)
from curling_env.errors import InputError
from curling_env.units import Units, short_length


def train(
    config: Annotated[
        str,
        typer.Option(
            metavar="NAME|FILE",
            help="What to learn and how: one of the project's configurations, or a YAML file.",
        ),
    ] = "house-one-ice",
    ice: IceOption = "standard",
    output: OutputDirectory = Path("runs/train"),
    steps: Annotated[
        int | None,
        typer.Option(min=1, help="Throws to learn from; by default as configured."),
    ] = None,
    skill: Annotated[
        str | None,
        typer.Option(
            help="Skill: none, elite, champion, championship or club; by default as configured."
        ),
    ] = None,
    checkpoint_every: Annotated[
        int | None, typer.Option(min=0, help="Throws between checkpoints; 0 for none.")
    ] = None,
    resume: Annotated[
        Path | None,
        typer.Option(
            metavar="CHECKPOINT.npz|DIR",
            help="Go on from a checkpoint, or from the last one in the folder of a run.",
        ),
    ] = None,
    workers: Annotated[
        str | None,
        typer.Option(
            metavar="rllib:N",
            help="Learn with RLlib on N workers, on the Ray cluster or on this machine.",
        ),
    ] = None,
    targets: Annotated[
        int, typer.Option(min=1, max=100_000, help="Number of draws in the evaluation.")
    ] = 50,
    seed: Annotated[
        int | None,
        typer.Option(min=0, help="Seed of all randomness; by default as configured."),
    ] = None,
    units: UnitsOption = Units.METRES,
    as_json: JsonOption = False,
) -> None:
    """Train an agent to draw.

    The agent learns on CurlingSheet-v0 with stable-baselines3, and a player's execution error is
    added to its throws. A configuration in the style of RL Zoo says the rest: algorithm, number of
    throws, policy, environment and hyperparameters. If it has `ices`, the agent learns on random
    ices whose estimated maps it sees, and --ice is not used.

    At the end the agent is compared with the planner and with the best possible throw, on new draws
    with the same errors. The folder then holds model.npz, checkpoints, logs (CSV, and TensorBoard
    if installed) and evaluation.json. Models hold numbers and text only: loading one never runs
    code.

    A run that was stopped and is resumed ends like one that was not, to the last bit. A checkpoint
    holds its settings.

    With --workers rllib:N a PPO configuration is trained with RLlib, on all machines of the current
    Ray cluster. The model is of the same kind; such a run writes no checkpoints.

    The configuration ends-league trains a player of ends instead, in generations that play
    themselves and earlier generations. A league that was stopped goes on in the same folder. Its
    model.npz plays games (`curling tournament runs/ends/model.npz greedy`).

    \b
    Examples:
        curling train --config button-one-ice --ice ice.json -o runs/button
        curling train --config house-random-ices -o runs/any-ice
        curling train --resume runs/any-ice -o runs/any-ice
        curling train --workers rllib:8 -o runs/cluster
        curling train --config ends-league -o runs/ends
    """
    from agents.learning import evaluation, training
    from agents.learning.configuration import load_settings, read_configuration, with_settings
    from curling_env.ice import load_ice
    from curling_env.infrastructure.files.storage import write_json

    rllib_workers = None if workers is None else _rllib_workers(workers)
    if rllib_workers and resume is not None:
        raise InputError(
            "a run with RLlib writes no checkpoints, so --resume cannot be used with it"
        )
    if resume is None:
        document = read_configuration(config)
        if isinstance(document, dict) and document.get("algorithm") == "league":
            if rllib_workers:
                raise InputError("a league cannot be trained with RLlib", source=config)
            _train_league(config, document, output, seed)
            return
    checkpoint = resume
    if resume is not None:
        checkpoint = training.latest_checkpoint(resume) if resume.is_dir() else resume
        settings = training.settings_of_run(checkpoint)
    else:
        settings = load_settings(config)
    settings = with_settings(
        settings, n_timesteps=steps, skill=skill, checkpoint_every=checkpoint_every, seed=seed
    )
    thrown_on = load_ice(ice)
    if not (rllib_workers or training.has_tensorboard()):
        say("tensorboard is not installed: logs are CSV only (pip install 'curling-sheet[train]')")
    with progress_bar(unit="throw") as progress:
        if rllib_workers:
            from agents.learning import rllib

            policy = rllib.train(
                settings, output, thrown_on, workers=rllib_workers, progress=progress
            )
        else:
            policy = training.train(
                settings, output, thrown_on, resume=checkpoint, progress=progress
            )
    say(f"the agent: {output / 'model.npz'}")
    if not evaluation.is_draw(settings):
        document = {"model": str(output / "model.npz"), "settings": settings.as_dict()}
        conclude(document, "`curling benchmark` measures it", as_json=as_json)
        return
    with progress_bar(unit="draw") as progress:
        judged = evaluation.evaluate(policy, thrown_on, draws=targets, progress=progress)
    result = {"format": evaluation.EVALUATION_FORMAT.name, **judged}
    write_json(output / "evaluation.json", result)
    over = result["agent_over_best"]
    misses = ", ".join(
        f"{name} {short_length(result[who]['mean_miss_with_error_m'], units)}"
        for name, who in (("agent", "agent"), ("planner", "planner"), ("best possible", "best"))
    )
    words = (
        f"mean miss with skill {settings.skill}, {result['draws']} draws: {misses}; agent over "
        f"best {over['ratio']:.2f} ({over['low']:.2f}-{over['high']:.2f})"
    )
    conclude(result, words, as_json=as_json)


def _rllib_workers(text: str) -> int:
    kind, _, count = text.partition(":")
    if kind != "rllib" or not (count.isascii() and count.isdigit() and int(count) > 0):
        raise InputError(f"--workers must be rllib: and a number of workers, got {text!r}")
    return int(count)


def _train_league(config: str, document: dict[str, Any], output: Path, seed: int | None) -> None:
    """Train a player of ends."""
    from agents.playing.league.run import run_league
    from agents.playing.league.settings import league_settings

    try:
        settings = league_settings(document, **({} if seed is None else {"seed": seed}))
    except InputError as error:
        raise InputError(error.problem, source=config) from error
    with progress_bar(unit="batch") as progress:
        run_league(output, settings, progress=progress, report=say)
    say(f"the agent: {output / 'model.npz'}")
