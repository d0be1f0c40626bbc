"""Animation of a throw: the scene at one moment, and the frames of a film."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from curling_env.physics.engine import Outcome, StoneState
from curling_env.render.canvas import Colour
from curling_env.render.renderer import DrawnScene, DrawnStone, SheetRenderer
from curling_env.typing import Floats, Image

LINGER = 0.5
"""Time for which a stone that left play is still shown [s]."""
HOLD = 0.6
"""Time for which the end of a throw is held, in the time of the film [s]."""


def drawn_stones(
    stones: Sequence[StoneState], colour_of: Callable[[int], Colour]
) -> list[DrawnStone]:
    """Return resting stones for drawing; `colour_of` gives a handle's colour by identifier."""
    return [DrawnStone(x=s.x, y=s.y, theta=s.theta, colour=colour_of(s.stone)) for s in stones]


def scene_at(
    scene: DrawnScene,
    before: Sequence[StoneState],
    outcome: Outcome,
    t: float,
    colour_of: Callable[[int], Colour],
) -> DrawnScene:
    """Return a scene with the stones of a throw at one moment, and their paths up to then.

    Parameters
    ----------
    scene : title, facts and target
    before : stones on the sheet before the throw
    outcome : outcome of the throw, with trajectories
    t : time since release [s]
    colour_of : colour of a stone's handle, by the stone's identifier
    """
    stones: list[DrawnStone] = []
    paths: list[tuple[Floats, Colour]] = []
    moved = dict(zip(outcome.moved, outcome.trajectories, strict=True))
    for k, final in enumerate(outcome.stones):
        colour = colour_of(final.stone)
        if k not in moved:
            stones += drawn_stones([before[k]], colour_of)
            continue
        path = moved[k]
        gone = not outcome.status[k].in_play
        x, y, theta = (float(np.interp(t, path.t, column)) for column in (*path.xy.T, path.theta))
        if not (gone and t > outcome.ends[k] + LINGER):
            stones.append(DrawnStone(x=x, y=y, theta=theta, colour=colour))
        if t > path.t[0]:
            paths.append((np.vstack([path.xy[path.t < t], [x, y]]), colour))
    return replace(scene, stones=stones, paths=paths)


def playback_frames(
    renderer: SheetRenderer,
    scene: DrawnScene,
    before: Sequence[StoneState],
    outcome: Outcome,
    colour_of: Callable[[int], Colour],
    *,
    fps: float = 30.0,
    speed: float = 1.0,
    scene_at_rest: DrawnScene | None = None,
) -> Iterator[Image]:
    """Yield the frames of a throw, from release until everything rests.

    Parameters
    ----------
    renderer : draws the ice, seen along the throw
    scene : title, facts and target
    before : stones on the sheet before the throw
    outcome : outcome of the throw, with trajectories
    colour_of : colour of a stone's handle, by the stone's identifier
    fps : frames per second of the film
    speed : playback speed over real time
    scene_at_rest : title, facts and target once everything rests; by default the same
    """
    frames = int(np.ceil((outcome.time / speed + HOLD) * fps))
    for k in range(frames + 1):
        t = min(k * speed / fps, outcome.time + LINGER + 1e-6)
        shown = scene_at_rest if scene_at_rest is not None and t >= outcome.time else scene
        yield renderer.draw(scene_at(shown, before, outcome, t, colour_of))
