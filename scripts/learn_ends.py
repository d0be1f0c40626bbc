"""Learn to play ends: first from recorded games, then by playing.

    curling record-games --player search:200:points --opponent rulebased --opponent draw \\
        --ends 2500 --seed 7500 -o runs/data
    python scripts/learn_ends.py clone runs/data -o runs/cloned.npz
    python scripts/learn_ends.py play -o runs/ends.npz --start runs/cloned.npz --deliveries 30720
    curling tournament runs/ends.npz greedy --games 60 --ends 4
    curling benchmark runs/ends.npz

`clone` clones a search: in each position of a Minari dataset every shot of the list is simulated
with execution errors, and the network learns to call the most valuable ones from one simulation of
each without error.

`play` learns by proximal policy optimisation (Schulman et al. 2017) with masks, through the public
environments alone: `gymnasium.make_vec("CurlingEnd-v0")` with shots as actions, reward shaping by
the value network, and a pool of opponents: two of the package's, and earlier versions of the
network. It begins with a random network, or with a given one.

Neither uses the benchmark's episodes.
"""

# Minari is optional.
# pyright: reportMissingImports=false

from __future__ import annotations

import argparse
import os
import time
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import torch
from learn.cloning import ShotModule, clone
from learn.lessons import lessons_of
from ppo import Settings, advantages

import curling_env  # noqa: F401  (registers the environments)
from agents.playing.learned.features import Seen
from agents.playing.learned.network import IMPOSSIBLE, ShotNetwork
from agents.playing.learned.player import LearnedPlayer
from curling_env.commands.cli import progress_bar
from curling_env.errors import CurlingError

DATASET = "curling/ends-v0"
ENVS, ROLLOUT = 32, 16
"""Number of environments, and of deliveries of each between updates: two ends."""
EPOCHS, MINIBATCH, LEARNING_RATE = 3, 256, 1e-3
"""Passes through the deliveries, positions per step, and learning rate, which falls to zero."""
WEIGHTS = Settings(gamma=1.0, gae_lambda=0.8)
"""No discount, and the weight of later advantages."""
CLIP, ENTROPY = 0.2, 0.003
"""Bound on the change of a probability, and weight of the entropy."""
PAST = 30
"""Number of updates after which the network joins its opponents."""


# --- learning from recorded games -----------------------------------------------------------------


def learn_from(data: Path, output: Path) -> None:
    """Learn from a dataset of `curling record-games`, by behaviour cloning."""
    os.environ["MINARI_DATASETS_PATH"] = str(data)
    try:
        import minari
    except ModuleNotFoundError as error:
        raise SystemExit("datasets need Minari: pip install 'curling-sheet[offline]'") from error

    games = minari.load_dataset(DATASET)
    env: Any = games.recover_environment().unwrapped
    seen = np.concatenate([np.asarray(e.observations)[:-1] for e in games.iterate_episodes()])
    with progress_bar(unit="position") as progress:
        lessons = lessons_of(seen, env.simulator, progress=progress)
    with progress_bar(unit="epoch") as progress:
        network, lost = clone(lessons, progress=progress)
    network.save(output, learnt_from=[data.name], held_out={"lost": round(lost, 4)})
    print(f"{len(lessons)} lessons; in those held out a call loses {lost:.3f} points")


# --- learning by playing --------------------------------------------------------------------------


def chances_of(worths: torch.Tensor, masks: torch.Tensor) -> torch.distributions.Categorical:
    """Return the probabilities of the available shots."""
    return torch.distributions.Categorical(logits=worths.masked_fill(masks == 0, IMPOSSIBLE))


def play(start: Path | None, output: Path, deliveries: int, *, keep: bool = False) -> None:
    """Train a network further by proximal policy optimisation, writing the output on the way.

    Parameters
    ----------
    start : network to begin with; None for a random one
    output : file of the network
    deliveries : deliveries of the agent
    keep : also keep each network that was written on the way, as ``OUTPUT-DELIVERIES.npz``
    """
    torch.manual_seed(0)
    torch.set_num_threads(1)
    envs: Any = gymnasium.make_vec(
        "CurlingEnd-v0",
        num_envs=ENVS,
        autoreset_mode="SameStep",
        actions="shots",
        potential="value-network",
        opponent=["rulebased", "draw"],
    )
    module = ShotModule(None if start is None else ShotNetwork.load(start))
    optimiser = torch.optim.Adam(module.parameters(), lr=LEARNING_RATE, eps=1e-5)
    n, length = ENVS, ROLLOUT
    updates = max(deliveries // (n * length), 1)
    observation, info = envs.reset(seed=0)
    scores: list[int] = []
    began = time.process_time()
    eyes = module.network()
    for update in range(updates):
        if update % PAST == 0:
            envs.unwrapped.opponents.append(LearnedPlayer(module.network()))
        optimiser.param_groups[0]["lr"] = LEARNING_RATE * (1 - update / updates)
        seen: list[Seen] = []
        masks = torch.zeros(length, n, info["action_mask"].shape[1])
        shots, logs = torch.zeros(length, n, dtype=torch.long), torch.zeros(length, n)
        rewards, over, values = np.zeros((length, n)), np.zeros((length, n)), np.zeros((length, n))
        for t in range(length):
            seen.append(eyes.seen(observation))
            masks[t] = torch.from_numpy(info["action_mask"])
            with torch.no_grad():
                worths, value = module(seen[-1])
                chances = chances_of(worths, masks[t])
                shots[t] = chances.sample()
                logs[t], values[t] = chances.log_prob(shots[t]), value.numpy()
            observation, rewards[t], ended, _, info = envs.step(shots[t].numpy())
            over[t] = ended
            if ended.any():
                ends = info["final_info"]["score"][ended]
                scores += [own - other for own, other in ends]
        with torch.no_grad():
            _, last = module(eyes.seen(observation))
        values = np.concatenate([values, last.numpy()[None]])
        advantage = advantages(*map(torch.from_numpy, (rewards, values, over)), WEIGHTS).numpy()
        learn(module, optimiser, seen, masks, shots, logs, advantage, values[:-1])
        if (update + 1) % 10 == 0 or update + 1 == updates:
            done = (update + 1) * n * length
            for path in (output, output.with_stem(f"{output.stem}-{done}"))[: 1 + keep]:
                module.network().save(path, deliveries=done)
            print(
                f"{done:8} deliveries  {np.mean(scores):6.2f} points an end  "
                f"{time.process_time() - began:6.0f} s",
                flush=True,
            )
            scores = []
    envs.close()


def learn(
    module: ShotModule,
    optimiser: Any,
    seen: list[Seen],
    masks: torch.Tensor,
    shots: torch.Tensor,
    logs: torch.Tensor,
    advantage: Any,
    values: Any,
) -> None:
    """Run one update from the played deliveries."""
    parts = tuple(torch.from_numpy(np.concatenate(part)) for part in zip(*seen, strict=True))
    good = torch.from_numpy(advantage.astype(np.float32).ravel())
    target = good + torch.from_numpy(values.astype(np.float32).ravel())
    good = (good - good.mean()) / (good.std() + 1e-8)
    masks, shots, logs = masks.flatten(0, 1), shots.flatten(), logs.flatten()
    for _ in range(EPOCHS):
        for rows in torch.randperm(len(good)).split(MINIBATCH):
            worths, value = module(tuple(part[rows] for part in parts))
            chances = chances_of(worths, masks[rows])
            ratio = (chances.log_prob(shots[rows]) - logs[rows]).exp()
            clipped = ratio.clamp(1 - CLIP, 1 + CLIP)
            loss = -torch.minimum(ratio * good[rows], clipped * good[rows]).mean()
            loss = loss + 0.5 * ((value - target[rows]) ** 2).mean()
            loss = loss - ENTROPY * chances.entropy().mean()
            optimiser.zero_grad()
            loss.backward()
            torch.nn.utils.clip_grad_norm_(module.parameters(), 0.5)
            optimiser.step()


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    ways = parser.add_subparsers(dest="way", required=True)
    one = ways.add_parser("clone", help="learn from a dataset of games")
    one.add_argument("data", type=Path, help="folder of `curling record-games`")
    other = ways.add_parser("play", help="continue by playing")
    other.add_argument("--start", type=Path, help="a network, such as one of `clone`")
    other.add_argument("--deliveries", type=int, default=80_000)
    other.add_argument("--keep", action="store_true", help="keep what is written on the way")
    for way in (one, other):
        way.add_argument("-o", "--output", type=Path, required=True, help="file of the network")
    given = parser.parse_args()
    try:
        given.output.parent.mkdir(parents=True, exist_ok=True)
        if given.way == "clone":
            learn_from(given.data, given.output)
        else:
            play(given.start, given.output, given.deliveries, keep=given.keep)
    except CurlingError as error:
        parser.exit(2, f"learn_ends: {error}\n")


if __name__ == "__main__":
    main()
