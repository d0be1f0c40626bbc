"""Ends played by a player, as an offline dataset in Minari's format.

Needs Minari: ``pip install 'curling-sheet[offline]'``.
"""

# Minari is optional.
# pyright: reportMissingImports=false

from __future__ import annotations

import os
import shutil
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np

import curling_env  # noqa: F401  (registers the environments)
from curling_env.envs.game.end_env import AGENT, CurlingEndEnv
from curling_env.errors import InputError
from curling_env.game import Player
from curling_env.infrastructure.files.writing import make_directory
from curling_env.typing import Progress, no_progress

DATASET = "curling/ends-v0"
"""Identifier of the dataset, which is also its folder inside the given one."""
RECORDED = Path(__file__).with_name("recorded")
"""Folder of the small dataset of the package: 100 ends by `search:400`."""


def record_ends(
    output: str | Path,
    player: Player,
    *,
    ends: int,
    options: dict[str, Any] | None = None,
    seed: int = 0,
    progress: Progress = no_progress,
) -> Path:
    """Play ends of `CurlingEnd-v0` and write them as a Minari dataset.

    Every delivery of the player is a step: the observation before it, the action of its throw
    without execution error, the reward.

    Parameters
    ----------
    output : folder of datasets; ``minari.load_dataset("curling/ends-v0")`` finds it there with
        ``MINARI_DATASETS_PATH`` set to the folder
    player : player in the role of the agent
    ends : number of ends, each an episode
    options : options of `CurlingEnd-v0`, as plain data that are written with the dataset
    seed : seed of the first end; the others count up
    progress : called after every end

    Returns
    -------
    the folder of the dataset

    Raises
    ------
    InputError : a dataset already exists there, or observations that are not vectors
    ModuleNotFoundError : Minari is not installed
    """
    from minari.data_collector import EpisodeBuffer
    from minari.utils import create_dataset_from_buffers

    # Minari puts the folder before the names of its files twice where it is relative.
    root = make_directory(output).absolute()
    if (root / DATASET).exists():
        raise InputError(f"a dataset already exists: remove {root / DATASET}", source=output)
    env = gymnasium.make("CurlingEnd-v0", disable_env_checker=True, **(options or {}))
    if not isinstance(env.observation_space, gymnasium.spaces.Box):
        raise InputError("a dataset needs vector observations: expected observation='flat'")
    # Written end by end, so that memory does not grow with their number.
    played: Any = (
        EpisodeBuffer(id=k, seed=seed + k, **episode)
        for k, episode in enumerate(_episodes(env, player, ends, seed, progress))
    )
    draft = root / ".being-written"
    shutil.rmtree(draft, ignore_errors=True)
    try:
        with _datasets_in(draft), warnings.catch_warnings():
            warnings.simplefilter("ignore")  # missing metadata on authors
            create_dataset_from_buffers(
                DATASET,
                played,
                env=env.spec,
                algorithm_name=player.name,
                description=f"Ends of CurlingEnd-v0 played by {player.name}",
                requirements=["curling-sheet"],
                data_format="hdf5",
            )
        (root / DATASET).parent.mkdir(parents=True, exist_ok=True)
        (draft / DATASET).rename(root / DATASET)
    finally:
        shutil.rmtree(draft, ignore_errors=True)
    return root / DATASET


def _episodes(
    env: Any, player: Player, ends: int, seed: int, progress: Progress
) -> Iterator[dict[str, Any]]:
    game: CurlingEndEnv = env.unwrapped
    for k in range(ends):
        observation, _ = env.reset(seed=seed + k)
        seen, actions, rewards, over = [observation], list[Any](), list[float](), False
        while not over:
            call = player.call(game.simulator.view(game.state, AGENT))
            actions.append(game.action_of(call))
            observation, reward, over, _, _ = env.step(actions[-1])
            seen.append(observation)
            rewards.append(float(reward))
        steps = len(rewards)
        yield {
            "observations": np.stack(seen),
            "actions": np.stack(actions),
            "rewards": rewards,
            "terminations": [False] * (steps - 1) + [True],
            "truncations": [False] * steps,
        }
        progress("ends", k + 1, ends)


@contextmanager
def _datasets_in(folder: Path) -> Iterator[None]:
    """Set Minari's folder of datasets temporarily."""
    before = os.environ.get("MINARI_DATASETS_PATH")
    os.environ["MINARI_DATASETS_PATH"] = str(folder)
    try:
        yield
    finally:
        if before is None:
            del os.environ["MINARI_DATASETS_PATH"]
        else:
            os.environ["MINARI_DATASETS_PATH"] = before
