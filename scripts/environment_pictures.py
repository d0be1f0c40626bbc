"""Pictures and films for the environments' pages, by `render()`.

    python scripts/environment_pictures.py docs

The films of the benchmark's tasks show the released policies, whose weights need
stable-baselines3, and sb3-contrib for ends.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
from PIL import Image as Picture
from scipy.ndimage import gaussian_filter

import curling_env
from agents.benchmark import contestant
from agents.benchmark import make as make_task
from curling_env.envs.rendering import FPS
from curling_env.game import player_named
from curling_env.ice import Ice, load_ice
from curling_env.infrastructure.files.writing import atomic_path
from curling_env.physics import Aim
from curling_env.sheet import Direction
from curling_env.typing import Image

QUALITY = 82
FILM_SIZE, FILM_QUALITY = (800, 450), 50
SPEED, HELD = 7.0, 2000
"""Playback speed over real time, and duration of the last picture [ms]."""


def keen_and_heavy() -> Ice:
    """Return standard ice with areas that differ by some percent."""
    ice = load_ice("standard")
    rough = gaussian_filter(np.random.default_rng(3).standard_normal(ice.sheet.shape), 3)
    mu = ice.friction.mu * (1 + 0.04 * rough / rough.std())
    return replace(ice, friction=replace(ice.friction, mu=mu))


def sheet() -> Any:
    """Render a draw that comes off a stone in the house."""
    ice = keen_and_heavy()
    stones = np.array([[0.3, 0.1], [-0.9, -0.6], [0.8, -3.0], [-1.2, 0.9]])
    env = gymnasium.make("CurlingSheet-v0", ice=ice, stones=stones, render_mode="rgb_array")
    env.reset(seed=1)
    drawn = Aim(ice, Direction.AWAY).draw(0.05, 0.35, 1.5)
    assert drawn is not None  # the button can be reached on this ice
    env.step(env.unwrapped.action_of(drawn))  # pyright: ignore[reportAttributeAccessIssue]
    return env


def end() -> Any:
    """Render the middle of an end between two rule-based players."""
    player = player_named("rulebased")
    env = gymnasium.make(
        "CurlingEnd-v0",
        opponent=player,
        hammer="own",
        render_mode="rgb_array",
        ice=keen_and_heavy(),
    )
    env.reset(seed=1)
    game: Any = env.unwrapped
    for _ in range(5):
        env.step(game.action_of(player.call(game.simulator.view(game.state))))
    return env


def match() -> Any:
    """Render the first stones of mixed doubles after a power play."""
    player = player_named("rulebased")
    env = curling_env.curling_v0.env(
        rules="mixed_doubles_2024", ice=keen_and_heavy(), render_mode="rgb_array"
    )
    env.reset(seed=2, options={"last_stone": "away", "power_play": "right"})
    game: Any = env.unwrapped
    for _ in range(3):
        env.step(game.action_of(player.call(game.simulator.view(game.state))))
    return env


TASK_FILM_SIZE, THROWS_SHOWN, FIRST_SEED = (480, 270), 3, 1
POLICIES = {
    **dict.fromkeys(("draw", "guard", "takeout", "hit-and-stay", "freeze"), "sac"),
    "end-rulebased": "maskable-ppo",
}
"""The policies whose films are shown, by task."""


def task_frames(name: str, weights: Path) -> Iterator[Image]:
    """Show the first throws of a policy, or the last deliveries of its first end."""
    env, act = make_task(name, render_mode="rgb_array"), contestant(str(weights))
    game: Any = env.unwrapped
    steps = THROWS_SHOWN if name in THROWN else 8
    observation, over = None, True
    for number in range(steps):
        if over:
            observation, _ = env.reset(seed=FIRST_SEED + number)
        observation, _, over, _, _ = env.step(act(game, observation))
        if name in THROWN or number >= steps - 2:
            yield from game.frames(speed=SPEED)
    env.close()


THROWN = [name for name, policy in POLICIES.items() if policy == "sac"]
STILLS = ("curling-sheet", "curling-end")
PICTURES = {"curling-sheet": sheet, "curling-end": end, "curling-v0": match}


def main(folder: Path) -> None:
    """Write all films as pictures/NAME.webp, and the last picture of some as NAME.jpg."""
    for name, played in PICTURES.items():
        env = played()
        if name in STILLS:
            with atomic_path(folder / f"{name}.jpg") as draft:
                Picture.fromarray(env.render()).save(draft, "JPEG", quality=QUALITY)
        with atomic_path(folder / "pictures" / f"{name}.webp") as draft:
            film(env.unwrapped.frames(speed=SPEED), draft)
        env.close()
    for name, policy in POLICIES.items():
        weights = folder / "baselines" / "weights" / f"{policy}-{name}.zip"
        with atomic_path(folder / "pictures" / f"task-{name}.webp") as draft:
            film(task_frames(name, weights), draft, TASK_FILM_SIZE)


def film(frames: Iterable[Image], path: Path, size: tuple[int, int] = FILM_SIZE) -> None:
    """Write pictures as an animated WebP that stays at its last one for a while."""
    shown = [Picture.fromarray(frame).resize(size, Picture.Resampling.LANCZOS) for frame in frames]
    shown = [*shown[:-1:2], shown[-1]]
    times = [1000 * 2 // FPS] * (len(shown) - 1) + [HELD]
    shown[0].save(
        path, "WEBP", save_all=True, append_images=shown[1:], duration=times, loop=0,
        quality=FILM_QUALITY, method=6, minimize_size=True,
    )  # fmt: skip


if __name__ == "__main__":
    main(Path(sys.argv[1]))
