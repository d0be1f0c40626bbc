"""`curling train`: train an agent to draw, or a player of ends."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from curling_env.commands.options import IceOption, Measured, OutputDirectory, grouped, option
from curling_env.commands.terminal import print_remark, progress_bar
from curling_env.errors import InputError, placed


@dataclass(frozen=True, kw_only=True)
class Run:
    """Run"""

    config: str = option(
        "house-one-ice", "Name of a configuration, or your own file.", metavar="NAME|FILE"
    )
    steps: int | None = option(None, "Number of training throws, if not as configured.", min=1)
    skill: str | None = option(None, "Skill of the player, if not as configured.")
    resume: Path | None = option(None, "Folder of a run to continue.", metavar="CHECKPOINT.npz|DIR")
    workers: str | None = option(None, "Train with RLlib on N workers.", metavar="rllib:N")
    targets: int = option(50, "Number of draws in the evaluation.", min=1, max=100_000)
    seed: int | None = option(None, "Seed of all randomness, if not as configured.", min=0)


@grouped
def train(
    ice: IceOption = "standard",
    output: OutputDirectory = Path("runs/train"),
    *,
    run: Run,
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

    A configuration in the style of RL Zoo sets the algorithm, number of throws, policy, environment
    and hyperparameters; with `ices` the agent learns on random ices instead of --ice. At the end
    the agent is compared with the planner and the best possible throw. A resumed run gives the same
    result as an uninterrupted one. ends-league trains a player of ends over generations. See
    docs/agents.md.
    """
    from agents.learning import evaluation, training
    from agents.learning.configuration import load_settings, read_configuration, with_settings
    from agents.playing.league.run import run_league
    from agents.playing.league.settings import league_settings
    from curling_env.ice import load_ice
    from curling_env.infrastructure.files.storage import write_json

    rllib_workers = None if run.workers is None else _rllib_workers(run.workers)
    if run.resume is None:
        document = read_configuration(run.config)
        if isinstance(document, dict) and document.get("algorithm") == "league":
            if rllib_workers:
                raise InputError("RLlib cannot train a league; omit --workers", source=run.config)
            with placed(source=run.config):
                league = league_settings(
                    document, **({} if run.seed is None else {"seed": run.seed})
                )
            with progress_bar("batch") as progress:
                run_league(output, league, progress=progress, report=print_remark)
            print_remark(f"the agent: {output / 'model.npz'}")
            return
        checkpoint, settings = None, load_settings(run.config)
    elif rllib_workers:
        problem = "RLlib runs write no checkpoints; --resume cannot continue them"
        raise InputError(problem)
    else:
        checkpoint = training.latest_checkpoint(run.resume) if run.resume.is_dir() else run.resume
        settings = training.settings_of_run(checkpoint)
    settings = with_settings(settings, n_timesteps=run.steps, skill=run.skill, seed=run.seed)
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
                print_remark(f"{missing} (pip install 'curling-sheet[train]')")
            policy = training.train(
                settings, output, thrown_on, resume=checkpoint, progress=progress
            )
    print_remark(f"the agent: {output / 'model.npz'}")
    if not evaluation.is_draw(settings):
        document = {"model": str(output / "model.npz"), "settings": settings.as_dict()}
        results.show(document, "measure it with `curling benchmark`")
        return
    with progress_bar("draw") as progress:
        judged = evaluation.evaluate(policy, thrown_on, draws=run.targets, progress=progress)
    result = {"format": evaluation.EVALUATION_FORMAT.name, **judged}
    write_json(output / "evaluation.json", result)
    results.show(result, evaluation.in_words(result, settings.skill, results.units))


def _rllib_workers(text: str) -> int:
    kind, _, count = text.partition(":")
    if kind != "rllib" or not (count.isascii() and count.isdigit() and int(count) > 0):
        raise InputError(f"--workers: expected rllib:N with a number of workers, got {text!r}")
    return int(count)
