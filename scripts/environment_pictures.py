"""The pictures of docs/environments.md: what `render()` shows of each environment.

python scripts/environment_pictures.py docs
"""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import gymnasium
import numpy as np
from scipy.ndimage import gaussian_filter

import curling_env
from curling_env.game import player_named
from curling_env.ice import Ice, load_ice
from curling_env.infrastructure.files.storage import atomic_path
from curling_env.physics.one_stone.aim import Aim
from curling_env.sheet import Direction
from curling_env.typing import Image

QUALITY = 82


def keen_and_heavy() -> Ice:
    """Standard ice with areas that differ by some percent."""
    ice = load_ice("standard")
    rough = gaussian_filter(np.random.default_rng(3).standard_normal(ice.sheet.shape), 3)
    mu = ice.friction.mu * (1 + 0.04 * rough / rough.std())
    return replace(ice, friction=replace(ice.friction, mu=mu))


def sheet() -> Image:
    """A draw that comes off a stone in the house."""
    ice = keen_and_heavy()
    stones = np.array([[0.3, 0.1], [-0.9, -0.6], [0.8, -3.0], [-1.2, 0.9]])
    env = gymnasium.make("CurlingSheet-v0", ice=ice, stones=stones, render_mode="rgb_array")
    env.reset(seed=1)
    drawn = Aim(ice, Direction.AWAY).draw(0.05, 0.35, 1.5)
    assert drawn is not None  # the button can be reached on this ice
    env.step(env.unwrapped.action_of(drawn))  # pyright: ignore[reportAttributeAccessIssue]
    return _shown(env)


def end() -> Image:
    """The middle of an end between two rule-based players."""
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
    return _shown(env)


def match() -> Image:
    """The first stones of mixed doubles after a power play."""
    player = player_named("rulebased")
    env = curling_env.curling_v0.env(
        rules="mixed_doubles_2024", ice=keen_and_heavy(), render_mode="rgb_array"
    )
    env.reset(seed=2, options={"last_stone": "away", "power_play": "right"})
    game: Any = env.unwrapped
    for _ in range(3):
        env.step(game.action_of(player.call(game.simulator.view(game.state))))
    return _shown(env)


def _shown(env: Any) -> Image:
    picture = env.render()
    env.close()
    return picture


PICTURES = {"curling-sheet.jpg": sheet, "curling-end.jpg": end, "curling-v0.jpg": match}


def main(folder: Path) -> None:
    """Write all of them."""
    for name, draw in PICTURES.items():
        with atomic_path(folder / name) as draft:
            bgr = cv2.cvtColor(draw(), cv2.COLOR_RGB2BGR)
            done, coded = cv2.imencode(".jpg", bgr, [cv2.IMWRITE_JPEG_QUALITY, QUALITY])
            assert done
            draft.write_bytes(coded.tobytes())


if __name__ == "__main__":
    main(Path(sys.argv[1]))
