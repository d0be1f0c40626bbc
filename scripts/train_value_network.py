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

from agents.playing.league.self_play import (
    LEADS,
    MOST_ENDS_LEFT,
    SIDE_BY_SIDE,
    Careless,
    Ends,
    learn,
    sheet_for,
    spread_of,
    surprise,
    worth_of_scores,
)
from agents.playing.league.self_play import play_ends as play_on
from agents.playing.search.positions import Sheet
from agents.playing.search.value_network import FILE, SCORES, Network, load_network, save_network
from curling_env.executor import executor
from curling_env.storage import make_directory
from curling_env.throw import SKILLS

HELD_OUT = 12
"""One batch of ends of so many is not learnt from, but shows what was learnt."""


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("-o", "--output", type=Path, required=True)
    parser.add_argument("--ends", type=int, nargs="+", default=[1000, 1500, 3000, 5000])
    parser.add_argument("--network", type=Path, help="begin with this one")
    parser.add_argument("--ice", default="standard")
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--seed", type=int, default=0)
    arguments = parser.parse_args()
    torch.manual_seed(arguments.seed)
    torch.set_num_threads(1)
    rng = np.random.default_rng(arguments.seed)
    folder = make_directory(arguments.output)
    sheet = sheet_for(arguments.ice, "world_curling_2024")
    network = None if arguments.network is None else load_network(arguments.network)
    lived: list[tuple[Ends, np.ndarray]] = []
    for number, ends in enumerate(arguments.ends):
        seeds = np.random.SeedSequence((arguments.seed, number)).spawn(-(-ends // SIDE_BY_SIDE))
        with executor(arguments.workers) as workers:
            play = workers.map(partial(play_ends, sheet, network), seeds)
            fresh = list(tqdm(play, f"round {number + 1}", total=len(seeds), unit="batch"))
        known = number > 1 or arguments.network is not None
        lived = [*lived, *fresh] if known else fresh  # but not how the rule of thumb plays
        held = set(rng.choice(len(lived), max(len(lived) // HELD_OUT, 1), replace=False).tolist())
        taught = [ends for k, (ends, _) in enumerate(lived) if k not in held]
        network = learn(sheet.lines, taught, rng, through=tqdm)
        unseen = np.mean([surprise(network, sheet.lines, lived[k][0]) for k in sorted(held)])
        print(f"round {number + 1}: surprised by ends it had not seen by {unseen:.4f}")
        save_network(folder / FILE, network)
        scores = np.concatenate([ends.score[level] for ends, level in fresh])
        shares = [round(float((scores == s).mean()), 3) for s in SCORES]
        print(f"round {number + 1}: shares {dict(zip(SCORES.tolist(), shares, strict=True))}")


def play_ends(
    sheet: Sheet, network: Network | None, seed: np.random.SeedSequence
) -> tuple[Ends, np.ndarray]:
    """Ends by hands of many kinds, and which of them are level, by `elite` hands and in earnest."""
    n, rng = SIDE_BY_SIDE, np.random.default_rng(seed)
    skill = np.where(rng.random(n) < 0.6, 0.0, rng.uniform(-0.7, 1.2, n))
    left = rng.integers(1, MOST_ENDS_LEFT + 1, n)
    lead = np.rint(rng.normal(0, LEADS, n)).astype(int)
    level = rng.random(n) < 0.4
    left[level], lead[level] = rng.integers(3, MOST_ENDS_LEFT + 1, level.sum()), 0
    worth = worth_of_scores(sheet.rules, lead, left)
    sigma = spread_of(SKILLS["elite"]) * np.exp(skill)[:, None]
    # Ends begin in a position that players of another kind have left, so that the network knows
    # those too: each team throws at random, at the button, or away, until the end is in earnest.
    until = np.where(rng.random(n) < 0.3, 0, rng.integers(0, sheet.rules.deliveries, n))
    careless = Careless(until, rng.random((2, n)))
    players = (network, network)
    ends = play_on(sheet, players, worth, sigma, rng, skill=skill, careless=careless)
    return ends, level & (skill == 0) & (until == 0)


if __name__ == "__main__":
    main()
