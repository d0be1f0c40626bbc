"""Train the position values of the player `search` on ends of self-play.

    python scripts/train_value_network.py digital_curling

NAME is one of `agents.playing.search.networks.NETWORKS`, which defines the ice, rules, delivery
and players of the training; `--ice`, `--rules`, `--delivery` and `--skill` set others.

In each round, ends are played with the network of the previous round. The first round begins with
the package's network `standard`, or with a heuristic when training that one. Each team maximises
the win probability from a random score of a game. The network of
`agents.playing.search.value_network` is then fitted to the ends of all rounds played: it predicts
the score of an end. One in twelve batches of ends is held out to compare the network with the
initial one, and with the shares of the scores alone.

Last, the positions of the last round's ends are learned backwards, from the last stone of an end to
its first, from the value after a good next stone (`learn.backwards`).

Every batch of ends and every part of these positions is kept in the folder, and an interrupted run
continues from there. `--keep` puts the final network into the package.
"""

from __future__ import annotations

import argparse
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np
import torch
from learn.backwards import STAGE_EPOCHS, STAGE_RATE, lesson_before
from tqdm import tqdm

from agents.learning.model_file import read_model, write_model
from agents.playing.league.fit import (
    Lesson,
    fit_value_network,
    lessons_of,
    negative_log_likelihood,
)
from agents.playing.league.run import ends_document, ends_from
from agents.playing.league.self_play import (
    ExploratoryPrefix,
    PlayedEnds,
    end_simulator,
    play_ends,
    score_values,
    sigmas_of,
)
from agents.playing.league.tuning import (
    LEAD_SPREAD,
    MAX_ENDS_LEFT,
    PARALLEL_ENDS,
)
from agents.playing.search import networks
from agents.playing.search.networks import NETWORKS, TrainingConditions, network_named
from agents.playing.search.positions import SCORES
from agents.playing.search.value_network import (
    ValueNetwork,
    save_network,
    skill_feature,
)
from curling_env.commands.cli import progress_bar
from curling_env.errors import InputError
from curling_env.game.rules.lines import Lines
from curling_env.infrastructure.executor import executor
from curling_env.infrastructure.files.writing import make_directory
from curling_env.throw import skill_named

HELD_OUT = 12
"""Interval of held-out batches of ends."""
EPOCHS = 8
"""Passes through all ends."""


class Batch(NamedTuple):
    """Batch of ends to play, and its file."""

    learnt_for: TrainingConditions
    seed: tuple[int, int, int]
    path: Path


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("name", choices=[known.name for known in NETWORKS])
    parser.add_argument("-o", "--output", type=Path, help="by default runs/value/NAME")
    parser.add_argument(
        "--ends", type=int, nargs="+", default=[1000, 1500, 3000, 5000], help="of each round"
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
    learnt_for = replace(known, **changes)
    folder = make_directory(arguments.output or Path("runs/value") / learnt_for.name)
    how = {"epochs": EPOCHS, "workers": arguments.workers, "seed": arguments.seed}
    begin = None if known is NETWORKS[0] else network_named(NETWORKS[0].name)
    network = learn(learnt_for, folder, begin=begin, rounds=arguments.ends, **how)
    last = len(arguments.ends)
    network = learn_backwards(learnt_for, folder, network, round_number=last, **how)
    save_network(folder / known.file, network)
    if arguments.keep:
        save_network(Path(networks.__file__).parent / known.file, network)


def learn(
    learnt_for: TrainingConditions,
    folder: Path,
    *,
    begin: ValueNetwork | None,
    rounds: list[int],
    epochs: int,
    workers: int,
    seed: int,
) -> ValueNetwork:
    """Learn a network, round by round.

    Parameters
    ----------
    learnt_for : conditions of the training
    folder : keeps the ends and the networks
    begin : network to begin with; None for a heuristic
    rounds : number of ends in each round
    epochs, workers, seed : passes through the ends, processes, seed of everything random

    Raises
    ------
    InputError : the folder holds ends of another training
    """
    torch.set_num_threads(1)
    network = begin
    lines = end_simulator(learnt_for.ice, learnt_for.rules, learnt_for.delivery).lines
    experience: list[tuple[int, PlayedEnds]] = []
    for number, ends in enumerate(rounds):
        inside = make_directory(folder / f"round-{number + 1}")
        batches = [
            Batch(learnt_for, (seed, number, k), inside / f"batch-{k:03d}.npz")
            for k in range(-(-ends // PARALLEL_ENDS))
        ]
        missing = [batch for batch in batches if not batch.path.exists()]
        with executor(workers) as pool:
            done = pool.map(partial(play_batch, network), missing)
            for _ in tqdm(done, f"round {number + 1}", total=len(missing), unit="batch"):
                pass
        fresh = [(k, _read(batch)) for k, batch in enumerate(batches)]
        # Ends that the heuristic played are used only once.
        kept = number > 1 or begin is not None
        experience = [*experience, *fresh] if kept else fresh
        torch.manual_seed(seed + number)
        with progress_bar(unit="epoch") as progress:
            network = fit_value_network(
                lines,
                [
                    lesson
                    for k, played in experience
                    if k % HELD_OUT
                    for lesson in lessons_of(played)
                ],
                np.random.default_rng((seed, number)),
                epochs=epochs,
                begin=begin,
                progress=progress,
            )
        save_network(folder / f"round-{number + 1}.npz", network)
        held_out = [played for k, played in experience if k % HELD_OUT == 0]
        print(f"round {number + 1}: {sum(len(p.score) for _, p in experience)} ends")
        _report_errors(lines, held_out, network, begin)
    assert network is not None
    return network


def learn_backwards(
    learnt_for: TrainingConditions,
    folder: Path,
    begin: ValueNetwork,
    *,
    round_number: int,
    epochs: int,
    workers: int,
    seed: int,
) -> ValueNetwork:
    """Learn the positions of a round's ends backwards, from the last stone of an end to its first.

    Parameters
    ----------
    learnt_for, folder : conditions of the training, and the folder of `learn`
    begin : network to begin with
    round_number : the round whose ends are taken
    epochs, workers, seed : passes through all positions, processes, seed of everything random
    """
    batches = sorted((folder / f"round-{round_number}").glob("batch-*.npz"))
    taught = [batch for k, batch in enumerate(batches) if k % HELD_OUT]
    simulator = end_simulator(learnt_for.ice, learnt_for.rules, learnt_for.delivery)
    inside = make_directory(folder / "backwards")
    network, lessons = begin, list[Lesson]()
    with executor(workers) as pool:
        for left in range(1, simulator.rules.deliveries):
            parts = [
                Part(learnt_for, batch, left, (seed, left, k), inside / f"{left:02d}-{batch.name}")
                for k, batch in enumerate(taught)
            ]
            missing = [part for part in parts if not part.path.exists()]
            done = pool.map(partial(learn_part, network), missing)
            for _ in tqdm(done, f"{left} stones to come", total=len(missing), unit="batch"):
                pass
            fresh = [_read_lesson(part) for part in parts]
            network = fit_value_network(
                simulator.lines,
                fresh,
                np.random.default_rng((seed, 2**20 + left)),
                epochs=STAGE_EPOCHS,
                learning_rate=STAGE_RATE,
                begin=network,
            )
            lessons += fresh
    with progress_bar(unit="epoch") as progress:
        network = fit_value_network(
            simulator.lines,
            lessons,
            np.random.default_rng((seed, 2**20)),
            epochs=epochs,
            begin=begin,
            progress=progress,
        )
    print(f"backwards: {sum(len(lesson.stones) for lesson in lessons)} positions")
    held_out = [ends_from(read_model(batch)["ends"]) for batch in batches[::HELD_OUT]]
    _report_errors(simulator.lines, held_out, network, begin)
    return network


class Part(NamedTuple):
    """Positions of a batch of ends with `left` stones to come, and the file that keeps them."""

    learnt_for: TrainingConditions
    batch: Path
    left: int
    seed: tuple[int, int, int]
    path: Path


def learn_part(network: ValueNetwork, part: Part) -> None:
    """Compute the values of positions into the part's file."""
    learnt_for = part.learnt_for
    simulator = end_simulator(learnt_for.ice, learnt_for.rules, learnt_for.delivery)
    lesson = lesson_before(
        simulator,
        network,
        ends_from(read_model(part.batch)["ends"]),
        part.left,
        skill_named(learnt_for.skill),
        np.random.default_rng(part.seed),
    )
    write_model(part.path, lesson._asdict())


def _read_lesson(part: Part) -> Lesson:
    document = read_model(part.path)
    return Lesson(*(document[name] for name in Lesson._fields))


def _report_errors(
    lines: Lines, held_out: list[PlayedEnds], network: ValueNetwork, begin: ValueNetwork | None
) -> None:
    """Report the negative log-likelihood of held-out ends: networks, and shares alone."""
    scores = np.concatenate([played.score for played in held_out])
    entropy = shares_error(scores)
    ours = np.array([negative_log_likelihood(network, lines, played) for played in held_out])
    errors = [f"this network {ours.mean():.4f}", f"shares alone {entropy:.4f}"]
    if begin is not None:
        other = np.array([negative_log_likelihood(begin, lines, played) for played in held_out])
        error = (other - ours).std(ddof=1) / len(ours) ** 0.5 if len(ours) > 1 else np.nan
        errors.append(
            f"the one to begin with {other.mean():.4f}, worse by {(other - ours).mean():.4f} "
            f"± {error:.4f}"
        )
    print(f"    −ln p of the score of {len(scores)} held-out ends: {', '.join(errors)}")


def play_batch(network: ValueNetwork | None, batch: Batch) -> None:
    """Play ends with players of many skills, and keep them in the batch's file."""
    ends = played_ends(network, batch.learnt_for, batch.seed)
    document = {"for": _document(batch), "ends": ends_document(ends)}
    write_model(batch.path, document)


def played_ends(
    network: ValueNetwork | None, learnt_for: TrainingConditions, seed: tuple[int, int, int]
) -> PlayedEnds:
    """Play ends with players of many skills.

    Parameters
    ----------
    network : values the positions for both teams; None for the heuristic
    learnt_for : ice, rules, delivery and usual players
    seed : seed of everything random
    """
    n = PARALLEL_ENDS
    simulator = end_simulator(learnt_for.ice, learnt_for.rules, learnt_for.delivery)
    rng = np.random.default_rng(seed)
    usual = skill_named(learnt_for.skill)
    other = np.where(rng.random(n) < 0.6, 0.0, rng.uniform(-0.7, 1.2, n))
    left = rng.integers(1, MAX_ENDS_LEFT + 1, n)
    lead = np.rint(rng.normal(0, LEAD_SPREAD, n)).astype(int)
    level = rng.random(n) < 0.4
    left[level], lead[level] = rng.integers(3, MAX_ENDS_LEFT + 1, level.sum()), 0
    values = score_values(simulator.rules, lead, left)
    sigma = sigmas_of(usual) * np.exp(other)[:, None]
    # Most ends begin with random throws, so that the network also learns positions that players of
    # another kind leave.
    until = np.where(rng.random(n) < 0.3, 0, rng.integers(0, simulator.rules.deliveries, n))
    prefix = ExploratoryPrefix(until, rng.random((2, n)))
    skill = skill_feature(usual) + other
    players = network, network
    return play_ends(simulator, players, values, sigma, rng, skill=skill, prefix=prefix)


def shares_error(scores: np.ndarray) -> float:
    """Return minus the mean log-probability of scores, if only their shares are known."""
    shares = np.array([(np.clip(scores, SCORES[0], SCORES[-1]) == s).mean() for s in SCORES])
    return -float((shares[shares > 0] * np.log(shares[shares > 0])).sum())


def _read(batch: Batch) -> PlayedEnds:
    document = read_model(batch.path)
    if document.get("for") != _document(batch):
        raise InputError("was learnt for something else; choose another folder", source=batch.path)
    return ends_from(document["ends"])


def _document(batch: Batch) -> dict[str, str]:
    return {name: getattr(batch.learnt_for, name) for name in ("ice", "rules", "delivery", "skill")}


if __name__ == "__main__":
    main()
