"""Teach the player `search` the value of positions, from ends that it plays against itself.

    python scripts/train_value_network.py -o runs/value --ends 1000 1500 3000 5000

In each round, ends are played with the network of the round before; the first round uses a
heuristic. Each team aims for the win probabilities of some score in a game. The network of
`agents.playing.search.value_network` is then fitted to the ends of the later rounds: it predicts
how an end is scored. Needs the extra `train` (torch). Prints how often each score was made in
level games.
"""

from __future__ import annotations

import argparse
from functools import partial
from pathlib import Path

import numpy as np
import torch
from tqdm import tqdm

from agents.playing.league.fit import fit_value_network, negative_log_likelihood
from agents.playing.league.self_play import (
    ExploratoryPrefix,
    PlayedEnds,
    end_simulator,
    play_ends,
    score_values,
    sigmas_of,
)
from agents.playing.league.tuning import ENDS_SIDE_BY_SIDE, LEAD_SPREAD, MAX_ENDS_LEFT
from agents.playing.search.positions import SCORES, EndSimulator
from agents.playing.search.value_network import FILE, ValueNetwork, load_network, save_network
from curling_env.commands.cli import progress_bar
from curling_env.infrastructure.executor import executor
from curling_env.infrastructure.files.storage import make_directory
from curling_env.throw import SKILLS

HELD_OUT = 12
"""One in so many batches of ends is held out, to show what was learnt."""


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("-o", "--output", type=Path, required=True)
    parser.add_argument("--ends", type=int, nargs="+", default=[1000, 1500, 3000, 5000])
    parser.add_argument("--network", type=Path, help="network to begin with")
    parser.add_argument("--ice", default="standard")
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--seed", type=int, default=0)
    arguments = parser.parse_args()
    torch.manual_seed(arguments.seed)
    torch.set_num_threads(1)
    rng = np.random.default_rng(arguments.seed)
    folder = make_directory(arguments.output)
    simulator = end_simulator(arguments.ice, "world_curling_2024")
    network = None if arguments.network is None else load_network(arguments.network)
    experience: list[tuple[PlayedEnds, np.ndarray]] = []
    for number, ends in enumerate(arguments.ends):
        seeds = np.random.SeedSequence((arguments.seed, number)).spawn(
            -(-ends // ENDS_SIDE_BY_SIDE)
        )
        with executor(arguments.workers) as workers:
            play = workers.map(partial(play_batch, simulator, network), seeds)
            fresh = list(tqdm(play, f"round {number + 1}", total=len(seeds), unit="batch"))
        # Ends that the heuristic played are used only once.
        kept = number > 1 or arguments.network is not None
        experience = [*experience, *fresh] if kept else fresh
        count = max(len(experience) // HELD_OUT, 1)
        held = set(rng.choice(len(experience), count, replace=False).tolist())
        taught = [ends for k, (ends, _) in enumerate(experience) if k not in held]
        with progress_bar(unit="epoch") as progress:
            network = fit_value_network(simulator.lines, taught, rng, progress=progress)
        unseen = [
            negative_log_likelihood(network, simulator.lines, experience[k][0])
            for k in sorted(held)
        ]
        print(f"round {number + 1}: negative log-likelihood of held-out ends {np.mean(unseen):.4f}")
        save_network(folder / FILE, network)
        scores = np.concatenate([ends.score[level] for ends, level in fresh])
        shares = [round(float((scores == s).mean()), 3) for s in SCORES]
        print(f"round {number + 1}: shares {dict(zip(SCORES.tolist(), shares, strict=True))}")


def play_batch(
    simulator: EndSimulator, network: ValueNetwork | None, seed: np.random.SeedSequence
) -> tuple[PlayedEnds, np.ndarray]:
    """Ends by players of many skills, and which are level, by `elite` players, and not random."""
    n, rng = ENDS_SIDE_BY_SIDE, np.random.default_rng(seed)
    skill = np.where(rng.random(n) < 0.6, 0.0, rng.uniform(-0.7, 1.2, n))
    left = rng.integers(1, MAX_ENDS_LEFT + 1, n)
    lead = np.rint(rng.normal(0, LEAD_SPREAD, n)).astype(int)
    level = rng.random(n) < 0.4
    left[level], lead[level] = rng.integers(3, MAX_ENDS_LEFT + 1, level.sum()), 0
    values = score_values(simulator.rules, lead, left)
    sigma = sigmas_of(SKILLS["elite"]) * np.exp(skill)[:, None]
    # Most ends begin with random throws, so that the network also learns positions that players of
    # another kind leave.
    until = np.where(rng.random(n) < 0.3, 0, rng.integers(0, simulator.rules.deliveries, n))
    prefix = ExploratoryPrefix(until, rng.random((2, n)))
    players = (network, network)
    ends = play_ends(simulator, players, values, sigma, rng, skill=skill, prefix=prefix)
    return ends, level & (skill == 0) & (until == 0)


if __name__ == "__main__":
    main()
