"""Display of `CurlingSheet-v0`: pictures, films of the last throw, and a window."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from curling_env.envs.rendering import FPS, ClipRenderer, signed
from curling_env.envs.sheet.reset import FIRST_OWN_STONE
from curling_env.ice import Ice
from curling_env.physics.engine import Status, StoneState
from curling_env.render import (
    RED,
    YELLOW,
    DrawnScene,
    drawn_stones,
    playback_frames,
    scene_at,
)
from curling_env.render.canvas import Colour
from curling_env.sheet import Direction, to_sheet
from curling_env.typing import Floats, Image

STATUS_TEXT = {
    Status.REST: "at rest",
    Status.OUT_SIDE: "out, side line",
    Status.OUT_BACK: "out, back line",
    Status.HOGGED: "hogged",
}


@dataclass(frozen=True, kw_only=True)
class Shown:
    """State of an episode to be shown.

    Parameters
    ----------
    ice : the ice thrown on
    task : name of the task
    direction : the end played to
    target : (2,) where the delivered stone should end, delivery frame [m]
    before, stones : stones on the sheet before the last throw, and now
    throw_number, throws : number of the throw, from 1, and throws in the episode
    last : the `info` of the last throw; None before the first
    """

    ice: Ice
    task: str
    direction: Direction
    target: Floats
    before: tuple[StoneState, ...]
    stones: tuple[StoneState, ...]
    throw_number: int
    throws: int
    last: dict[str, Any] | None

    def scene(self, *, at_rest: bool = True) -> DrawnScene:
        """Return the stones and the target, and the last throw in words.

        Parameters
        ----------
        at_rest : whether all stones rest, so that the result of the throw may be shown
        """
        end = self.direction.name.lower()
        number = f"throw {self.throw_number} of {self.throws}" if self.throws > 1 else "throw"
        facts: list[tuple[str, str]] = []
        if self.last is not None:
            throw, outcome = self.last["throw"], self.last["outcome"]
            facts = [
                ("Speed", f"{throw.speed:.2f} m/s"),
                ("Line", signed(np.degrees(throw.angle), "°")),
                ("Spin", signed(throw.spin, " rad/s")),
            ]
            came_of_it = [
                ("Time", f"{outcome.time:.1f} s"),
                ("From target", f"{self.last['distance_m']:.2f} m"),
                ("Result", STATUS_TEXT[outcome.delivered_status]),
                (
                    self.task.replace("_", " ").capitalize(),
                    "made" if self.last["success"] else "missed",
                ),
            ]
            facts += came_of_it if at_rest else []
        return DrawnScene(
            stones=drawn_stones(self.stones, _handle_colour),
            target=to_sheet(self.target, self.direction),
            title=f"CurlingSheet, {number} to the {end} end",
            facts=facts,
        )


class SheetRenderer(ClipRenderer[Shown]):
    """Renderer of `CurlingSheet-v0`."""

    title = "CurlingSheet-v0"
    window_speed = 8.0  # a draw takes 25 s

    def picture(self, clip: Shown) -> Image:
        """Return the sheet with the path of the last throw, (720, 1280, 3) RGB."""
        scene = clip.scene()
        if clip.last is not None:
            scene = scene_at(scene, clip.before, clip.last["outcome"], math.inf, _handle_colour)
        return self.sheet(clip.ice, clip.direction).draw(scene)

    def frames(self, clip: Shown, speed: float) -> Iterator[Image]:
        """Yield the frames of the last throw at `speed` times the true speed."""
        if clip.last is None:
            yield self.picture(clip)
            return
        yield from playback_frames(
            self.sheet(clip.ice, clip.direction),
            clip.scene(at_rest=False),
            clip.before,
            clip.last["outcome"],
            _handle_colour,
            fps=FPS,
            speed=speed,
            scene_at_rest=clip.scene(),
        )


def _handle_colour(stone: int) -> Colour:
    """Return the handle colour: red for the agent's stones, yellow for the others."""
    return RED if stone >= FIRST_OWN_STONE else YELLOW
