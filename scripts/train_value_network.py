"""Train the position values of the player `search` on ends of self-play.

    python scripts/train_value_network.py digital_curling

NAME is one of `agents.playing.search.networks.NETWORKS`, which defines the ice, rules, delivery
and players of the training; `--ice`, `--rules`, `--delivery` and `--skill` set others.

First a league (`agents.playing.league.run`) plays ends without past opponents, by players of many
skills. It begins with the package's network `standard`, or with a heuristic when training that one.
One in twelve batches of ends is held out to compare the network with the initial one, and with the
shares of the scores alone.

Last, the positions of the last generation's ends are learned backwards, from the last stone of an
end to its first, from the value after a good next stone (`learn.backwards`).

Every generation and every part of these positions is kept in the folder, and an interrupted run
continues from there. `--keep` puts the final network into the package.
"""

from __future__ import annotations

import argparse
from dataclasses import asdict, replace
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from learn.backwards import STAGE_EPOCHS, STAGE_RATE, lesson_before
from tqdm import tqdm

from agents.learning.model_file import read_model, write_model
from agents.playing.league.fit import Lesson, fit_value_network
from agents.playing.league.run import (
    ends_from,
    errors_in_words,
    held_out,
    run_league,
    taught,
)
from agents.playing.league.self_play import PlayedEnds, end_simulator
from agents.playing.league.settings import LeagueSettings
from agents.playing.search import networks
from agents.playing.search.networks import NETWORKS, TrainingConditions
from agents.playing.search.value_network import ValueNetwork, save_network
from curling_env.commands.cli import progress_bar
from curling_env.infrastructure.executor import executor
from curling_env.infrastructure.files.writing import make_directory
from curling_env.throw import skill_named


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("name", choices=[known.name for known in NETWORKS])
    parser.add_argument("-o", "--output", type=Path, help="by default runs/value/NAME")
    parser.add_argument(
        "--ends", type=int, nargs="+", default=[1000, 1500, 3000, 5000], help="of each generation"
    )
    parser.add_argument("--keep", action="store_true", help="put the network into the package")
    for option in ("ice", "rules", "delivery", "skill"):
        parser.add_argument(f"--{option}")
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--seed", type=int, default=0)
    arguments = parser.parse_args()
    known = next(known for known in NETWORKS if known.name == arguments.name)
    changes = {
        option: getattr(arguments, option)
        for option in ("ice", "rules", "delivery", "skill")
        if getattr(arguments, option)
    }
    folder = make_directory(arguments.output or Path("runs/value") / known.name)
    settings = settings_for(
        replace(known, **changes), generations=tuple(arguments.ends), seed=arguments.seed
    )
    with progress_bar(unit="batch") as progress:
        network = run_league(
            folder, settings, workers=arguments.workers, progress=progress, report=print
        )
    network = learn_backwards(settings, folder, network, workers=arguments.workers)
    save_network(folder / known.file, network)
    if arguments.keep:
        save_network(Path(networks.__file__).parent / known.file, network)


def settings_for(learnt_for: TrainingConditions, **others: Any) -> LeagueSettings:
    """Return the settings of a league that learns a network for these conditions."""
    given = {k: v for k, v in asdict(learnt_for).items() if k not in ("name", "file")}
    first = NETWORKS[0].name
    begin = None if learnt_for.name == first else first
    return LeagueSettings(**given, begin=begin, past=0.0, various=True, **others)


def learn_backwards(
    settings: LeagueSettings, folder: Path, begin: ValueNetwork, *, workers: int
) -> ValueNetwork:
    """Learn the positions of the last ends backwards, from the last stone of an end to its first.

    Parameters
    ----------
    settings : settings of the league
    folder : its folder
    begin : network to begin with
    workers : processes
    """
    last = read_model(folder / f"generation-{len(settings.generations)}.npz")
    batches = [ends_from(played) for played in last["ends"]]
    simulator = end_simulator(settings.ice, settings.rules, settings.delivery)
    inside = make_directory(folder / "backwards")
    network, lessons = begin, list[Lesson]()
    with executor(workers) as pool:
        for left in range(1, simulator.rules.deliveries):
            parts = [
                Part(settings, ends, left, k, inside / f"{left:02d}-batch-{k:03d}.npz")
                for k, ends in enumerate(taught(batches))
            ]
            missing = [part for part in parts if not part.path.exists()]
            done = pool.map(partial(learn_part, network), missing)
            for _ in tqdm(done, f"{left} stones to come", total=len(missing), unit="batch"):
                pass
            fresh = [_read_lesson(part) for part in parts]
            network = fit_value_network(
                simulator.lines,
                fresh,
                np.random.default_rng((settings.seed, 2**20 + left)),
                epochs=STAGE_EPOCHS,
                learning_rate=STAGE_RATE,
                begin=network,
            )
            lessons += fresh
    with progress_bar(unit="epoch") as progress:
        network = fit_value_network(
            simulator.lines,
            lessons,
            np.random.default_rng((settings.seed, 2**20)),
            epochs=settings.epochs,
            begin=begin,
            progress=progress,
        )
    print(f"backwards: {sum(len(lesson.stones) for lesson in lessons)} positions")
    if held := held_out(batches):
        print(errors_in_words(simulator.lines, held, network, begin))
    return network


class Part(NamedTuple):
    """Positions of batch k of ends with `left` stones to come, and the file that keeps them."""

    settings: LeagueSettings
    ends: PlayedEnds
    left: int
    k: int
    path: Path


def learn_part(network: ValueNetwork, part: Part) -> None:
    """Compute the values of positions into the part's file."""
    settings = part.settings
    lesson = lesson_before(
        end_simulator(settings.ice, settings.rules, settings.delivery),
        network,
        part.ends,
        part.left,
        skill_named(settings.skill),
        np.random.default_rng((settings.seed, part.left, part.k)),
    )
    write_model(part.path, lesson._asdict())


def _read_lesson(part: Part) -> Lesson:
    document = read_model(part.path)
    return Lesson(*(document[name] for name in Lesson._fields))


if __name__ == "__main__":
    main()
