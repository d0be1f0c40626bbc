"""Ends played by a player, as an offline dataset in Minari's format.

Needs Minari: ``pip install 'curling-sheet[offline]'``.
"""

# Minari is optional.
# pyright: reportMissingImports=false

from __future__ import annotations

import os
import shutil
import warnings
from collections.abc import Callable, Iterable, Iterator
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
    env = gymnasium.make("CurlingEnd-v0", disable_env_checker=True, **(options or {}))
    if not isinstance(env.observation_space, gymnasium.spaces.Box):
        raise InputError("a dataset needs vector observations: expected observation='flat'")
    return write_dataset(
        output,
        DATASET,
        env,
        _episodes(env, player, ends, seed, progress),
        by=player.name,
        what=f"Ends of CurlingEnd-v0 played by {player.name}",
        seed=seed,
    )


def check_minari() -> None:
    """Check before long work that a dataset can be written.

    Raises
    ------
    ModuleNotFoundError : Minari is not installed
    """
    import minari  # noqa: F401


def write_dataset(
    output: str | Path,
    name: str,
    env: Any,
    episodes: Iterable[dict[str, Any]],
    *,
    by: str,
    what: str,
    seed: int | None = None,
    references: tuple[float, float] | None = None,
) -> Path:
    """Write episodes as a Minari dataset, complete or not at all.

    Parameters
    ----------
    output : folder of datasets
    name : identifier of the dataset, which is also its folder there
    env : their environment
    episodes : fields of Minari's `EpisodeBuffer`, taken one by one, so that memory does not grow
        with their number
    by, what : name of the player, and a description
    seed : seed of the first episode, if the others count up
    references : mean returns that count as 0 and 1; None without any

    Returns
    -------
    the folder of the dataset

    Raises
    ------
    InputError : a dataset already exists there
    ModuleNotFoundError : Minari is not installed
    """
    from minari.data_collector import EpisodeBuffer
    from minari.utils import create_dataset_from_buffers

    # Minari repeats a relative folder in the names of its files.
    root = make_directory(output).absolute()
    if (root / name).exists():
        raise InputError(f"a dataset already exists: remove {root / name}", source=output)
    buffers: Any = (
        EpisodeBuffer(id=k, seed=None if seed is None else seed + k, **episode)
        for k, episode in enumerate(episodes)
    )
    low, high = references or (None, None)
    draft = root / ".being-written"
    shutil.rmtree(draft, ignore_errors=True)
    try:
        with _datasets_in(draft), warnings.catch_warnings():
            warnings.simplefilter("ignore")  # missing metadata on authors
            create_dataset_from_buffers(
                name,
                buffers,
                env=env.spec,
                algorithm_name=by,
                description=what,
                requirements=["curling-sheet"],
                ref_min_score=low,
                ref_max_score=high,
                data_format="hdf5",
            )
        (root / name).parent.mkdir(parents=True, exist_ok=True)
        (draft / name).rename(root / name)
    finally:
        shutil.rmtree(draft, ignore_errors=True)
    return root / name


def episode_of(
    env: Any, act: Callable[[Any, Any, dict[str, Any]], Any], *, seed: int, masks: bool = False
) -> dict[str, Any]:
    """Play an episode; the fields of Minari's `EpisodeBuffer`.

    Parameters
    ----------
    env : the environment
    act : the action, given the environment (unwrapped), its observation and its `info`
    seed : seed of the episode
    masks : whether the masks of actions are kept in its infos
    """
    observation, info = env.reset(seed=seed)
    seen, there = [observation], [info.get("action_mask")]
    actions, rewards, over = list[Any](), list[float](), False
    while not over:
        actions.append(act(env.unwrapped, observation, info))
        observation, reward, over, _, info = env.step(actions[-1])
        seen.append(observation)
        there.append(info.get("action_mask"))
        rewards.append(float(reward))
    steps = len(rewards)
    return {
        "observations": np.stack(seen),
        "actions": np.stack(actions),
        "rewards": rewards,
        "terminations": [False] * (steps - 1) + [True],
        "truncations": [False] * steps,
        **({"infos": {"action_mask": np.stack(there)}} if masks else {}),
    }


def _episodes(
    env: Any, player: Player, ends: int, seed: int, progress: Progress
) -> Iterator[dict[str, Any]]:
    def act(game: CurlingEndEnv, observation: Any, info: Any) -> Any:
        return game.action_of(player.call(game.simulator.view(game.state, AGENT)))

    for k in range(ends):
        yield episode_of(env, act, seed=seed + k)
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
