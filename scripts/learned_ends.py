"""Ends of learned players: their points, their games, and the recorded ends that copies learn from.

python scripts/learned_ends.py learned      points per end, and games of two ends against `greedy`
python scripts/learned_ends.py runs/ends.npz --episodes 100 --games 20
"""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Annotated, Any

import gymnasium
import h5py
import numpy as np
import typer

from agents.benchmark import TASKS, difference_of, played
from agents.benchmark.contestants import Contestant, contestant
from agents.playing.learned.lessons import Lessons, lessons_of
from agents.playing.offline_data import DATASET, RECORDED, _episodes
from curling_env.game import player_named
from curling_env.typing import Singles, no_progress

ROOT = Path(__file__).parents[1]
OPPONENTS = ("draw", "rulebased", "greedy")
"""Opponents of the benchmark."""
PLAYER, FIRST_SEED = "search:200:points", 7500
"""Player and first seed of the newest recorded dataset."""


def points(
    who: Contestant, opponents: Sequence[str] = OPPONENTS, *, episodes: int = 600
) -> dict[str, float]:
    """Return points per end by opponent, and how much more that is than `rulebased` scores.

    Parameters
    ----------
    who : the player
    opponents : names of the opponents, some of `OPPONENTS`
    episodes : number of ends against each
    """
    tasks = [TASKS[f"end-{name}"] for name in opponents]
    own = [played(task, who, episodes=episodes)[0] for task in tasks]
    others = [played(task, contestant("rulebased"), episodes=episodes)[0] for task in tasks]
    found = {name: float(each.mean()) for name, each in zip(opponents, own, strict=True)}
    return found | {"more_than_rulebased": difference_of(own, others).mean}


def games(player: str | Path, count: int = 60) -> dict[str, float]:
    """Return games of two ends won against `greedy` [%], and points per end.

    Parameters
    ----------
    player : name of the player, or file of a model
    count : number of games
    """
    words = ["tournament", str(player), "greedy", "--ends", "2", "--seed", "11", "--json"]
    printed = subprocess.check_output(
        [sys.executable, "-m", "curling", *words, "--games", str(count)], cwd=ROOT
    )
    standings = {standing["name"]: standing for standing in json.loads(printed)["standings"]}
    other = standings["greedy"]
    return {
        "won": 100 * (1 - other["share"]),
        "points": other["points_against"],
        "conceded": other["points_for"],
    }


def recorded(ends: int) -> Iterator[dict[str, Any]]:
    """Play ends as `curling record-games` does for the newest dataset, without Minari."""
    env = gymnasium.make(
        "CurlingEnd-v0", disable_env_checker=True, opponent=["rulebased", "draw"], ice="standard"
    )
    yield from _episodes(env, player_named(PLAYER), ends, FIRST_SEED, no_progress)


def positions_of(episodes: Iterator[dict[str, Any]]) -> Singles:
    """Return the observations before each delivery, (n, k)."""
    return np.concatenate([np.asarray(one["observations"])[:-1] for one in episodes])


def packaged_positions(count: int) -> Singles:
    """Return evenly spaced positions of the ends that come with the package, (count, k)."""
    with h5py.File(RECORDED / DATASET / "data" / "main_data.hdf5") as file:
        every: Any = file
        seen = positions_of({"observations": every[name]["observations"][:]} for name in every)
    return seen[:: len(seen) // count][:count]


def lessons_in(positions: Singles) -> Lessons:
    """Return lessons in positions of `CurlingEnd-v0`, by simulation."""
    env: Any = gymnasium.make("CurlingEnd-v0").unwrapped
    return lessons_of(positions, env.simulator, seed=0)


def main(
    player: Annotated[str, typer.Argument(help="A player's name, or the file of a model.")],
    episodes: Annotated[int, typer.Option(min=2, help="Ends against each opponent.")] = 600,
    count: Annotated[int, typer.Option("--games", min=1, help="Games against `greedy`.")] = 60,
) -> None:
    """Print points per end, and games won."""
    for name, value in points(contestant(player), episodes=episodes).items():
        print(f"{name:20} {value:6.2f} points per end")
    for name, value in games(player, count).items():
        print(f"{name:20} {value:6.2f}")


if __name__ == "__main__":
    typer.run(main)
