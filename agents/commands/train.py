"""`curling train`: train an agent to draw, or a player of ends."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

from typer import Option

from curling_env.commands.options import IceOption, Measured, OutputDirectory, grouped
from curling_env.commands.terminal import progress_bar, say
from curling_env.errors import InputError
from curling_env.units import Units, short_length


@grouped
def train(
    config: Annotated[
        str, Option(metavar="NAME|FILE", help="The project's configuration, or a YAML file.")
    ] = "house-one-ice",
    ice: IceOption = "standard",
    output: OutputDirectory = Path("runs/train"),
    steps: Annotated[
        int | None, Option(min=1, help="Throws to learn from; by default as configured.")
    ] = None,
    skill: Annotated[
        str | None,
        Option(help="none, elite, champion, championship, club; by default as configured."),
    ] = None,
    resume: Annotated[
        Path | None,
        Option(metavar="CHECKPOINT.npz|DIR", help="Continue a checkpoint, or the last of a run."),
    ] = None,
    workers: Annotated[
        str | None,
        Option(metavar="rllib:N", help="Learn with RLlib on N workers, on a cluster or here."),
    ] = None,
    targets: Annotated[
        int, Option(min=1, max=100_000, help="Number of draws in the evaluation.")
    ] = 50,
    seed: Annotated[
        int | None, Option(min=0, help="Seed of all randomness; by default as configured.")
    ] = None,
    *,
    results: Measured,
) -> None:
    """Train an agent to draw, or a player of ends.

    \b
    Examples:
        curling train --config button-one-ice --ice ice.json -o runs/button
        curling train --config house-random-ices -o runs/any-ice
        curling train --resume runs/any-ice -o runs/any-ice
        curling train --workers rllib:8 -o runs/cluster
        curling train --config ends-league -o runs/ends

    The agent learns on CurlingSheet-v0 with stable-baselines3. A configuration in the style of RL
    Zoo sets the algorithm, number of throws, policy, environment and hyperparameters; with `ices`
    the agent learns on random ices, and --ice is not used. At the end it is compared with the
    planner and the best possible throw. DIR holds model.npz, checkpoints, logs and evaluation.json.

    A resumed run ends like one that was not stopped, to the last bit. ends-league trains a player
    of ends in generations, and continues in the same folder. See docs/agents.md.
    """
    from agents.learning import evaluation, training
    from agents.learning.configuration import load_settings, read_configuration, with_settings
    from curling_env.ice import load_ice
    from curling_env.infrastructure.files.storage import write_json

    rllib_workers = None if workers is None else _rllib_workers(workers)
    if resume is None:
        document = read_configuration(config)
        if isinstance(document, dict) and document.get("algorithm") == "league":
            if rllib_workers:
                raise InputError("a league cannot be trained with RLlib", source=config)
            _train_league(config, document, output, seed)
            return
        checkpoint, settings = None, load_settings(config)
    elif rllib_workers:
        problem = "a run with RLlib writes no checkpoints, so --resume cannot be used with it"
        raise InputError(problem)
    else:
        checkpoint = training.latest_checkpoint(resume) if resume.is_dir() else resume
        settings = training.settings_of_run(checkpoint)
    settings = with_settings(settings, n_timesteps=steps, skill=skill, seed=seed)
    thrown_on = load_ice(ice)
    with progress_bar("throw") as progress:
        if rllib_workers:
            from agents.learning import rllib

            policy = rllib.train(
                settings, output, thrown_on, workers=rllib_workers, progress=progress
            )
        else:
            if not training.has_tensorboard():
                missing = "tensorboard is not installed: logs are CSV only"
                say(f"{missing} (pip install 'curling-sheet[train]')")
            policy = training.train(
                settings, output, thrown_on, resume=checkpoint, progress=progress
            )
    say(f"the agent: {output / 'model.npz'}")
    if not evaluation.is_draw(settings):
        document = {"model": str(output / "model.npz"), "settings": settings.as_dict()}
        results.show(document, "`curling benchmark` measures it")
        return
    with progress_bar("draw") as progress:
        judged = evaluation.evaluate(policy, thrown_on, draws=targets, progress=progress)
    result = {"format": evaluation.EVALUATION_FORMAT.newest, **judged}
    write_json(output / "evaluation.json", result)
    results.show(result, _in_words(result, settings.skill, results.units))


def _in_words(result: dict[str, Any], skill: str, units: Units) -> str:
    """Compare the agent's mean miss with that of the planner and of the best possible throw."""
    over = result["agent_over_best"]
    misses = ", ".join(
        f"{name} {short_length(result[who]['mean_miss_with_error_m'], units)}"
        for name, who in (("agent", "agent"), ("planner", "planner"), ("best possible", "best"))
    )
    return (
        f"mean miss with skill {skill}, {result['draws']} draws: {misses}; agent over "
        f"best {over['ratio']:.2f} ({over['low']:.2f}-{over['high']:.2f})"
    )


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
    with progress_bar("batch") as progress:
        run_league(output, settings, progress=progress, report=say)
    say(f"the agent: {output / 'model.npz'}")
