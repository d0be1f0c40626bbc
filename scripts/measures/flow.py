"""Repetition of the paper's figure 6: points on a stone, by plain and pyramidal optical flow.

A takeout is filmed as it comes towards a camera that sees the whole sheet. Points on it are
followed by optical flow alone, as in the paper. Far from the camera the stone moves one pixel per
frame and both forms follow it; near the camera it moves beyond the window of a single scale.
"""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory

import cv2
import numpy as np

from curling_env.ice import Ice
from curling_env.physics import slide
from curling_env.sheet import RULE_BOOK_STONE, Direction
from curling_env.throw import Throw
from curling_env.typing import Floats, Image
from friction_estimation.appearance import StoneModel
from friction_estimation.camera.camera import Camera
from friction_estimation.film.video import Film
from friction_estimation.synthetic import FilmSpec, render_film
from friction_estimation.tracking.optical_flow import (
    FLOW_METHODS,
    FlowMethod,
    lucas_kanade,
    points_to_follow,
)

SPEED = 3.2
"""Speed of the filmed stone [m/s]: a takeout's, which flow must follow too."""
FPS = 10.0
"""A surveillance camera's rate [1/s]; at 30 both forms follow any throw."""
STRETCHES = {"before mid-sheet": (7.0, 3.0), "after mid-sheet": (-4.0, -10.5)}
"""First and last y at which the stone is followed [m]; it is played towards the home end."""


def flow_misses(rng: np.random.Generator) -> dict[tuple[str, str], float]:
    """Return the distance from the true stone at the end, by form and stretch [m].

    Parameters
    ----------
    rng : source of the film's noise
    """
    # On a tripod at the home end, as the paper's: the whole sheet in view, the near part large.
    camera = Camera.looking_at(
        position=(0.9, -25.0, 4.0), target=(0.05, -6.0, 0.0), focal_px=1450.0, size=(1920, 1080)
    )
    seed = int(rng.integers(2**31))
    spec = FilmSpec(camera=camera, fps=FPS, people=False, lead_in=0.0, tail=0.0, seed=seed)
    far = np.array([-3.0, 3.0, -12.0, 12.0])
    release = Throw(speed=SPEED, spin=1.2).release(Direction.HOME)
    path = slide(Ice.uniform(0.009), release, bounds=far, fps=120.0).trajectory
    assert path is not None  # a rate was given
    with TemporaryDirectory() as folder:
        film = Path(folder) / "figure6.mp4"
        truth = render_film(film, path, spec)
        frames = [frame for _, frame in Film.open(film).frames()]
    camera = spec.resolved()
    model = StoneModel(radius=RULE_BOOK_STONE.radius, height=RULE_BOOK_STONE.height)
    misses: dict[tuple[str, str], float] = {}
    for flow in FLOW_METHODS:
        for name, (begin, end) in STRETCHES.items():
            first = int(np.argmax(truth.xy[:, 1] <= begin))
            last = int(np.argmax(truth.xy[:, 1] <= end))
            outline = model.outline_px(camera, truth.xy[first])
            followed = _follow(frames[first : last + 1], outline, flow)
            place = camera.on_plane(followed, RULE_BOOK_STONE.height)[0]
            misses[flow, name] = float(np.hypot(*(place - truth.xy[last])))
    return misses


def _follow(frames: list[Image], outline_px: Floats, flow: FlowMethod) -> Floats:
    """Return the last mean place of the points that are followed, (1, 2) [px]."""
    before = _grey(frames[0])
    points = points_to_follow(before, outline_px)
    place = points.mean(axis=0)
    for frame in frames[1:]:
        after = _grey(frame)
        there, good = lucas_kanade(before, after, points, flow)
        points = there[good]
        if len(points) == 0:
            break
        place, before = points.mean(axis=0), after
    return place[None]


def _grey(frame: Image) -> Image:
    return np.asarray(cv2.cvtColor(frame, cv2.COLOR_BGR2GRAY), dtype=np.uint8)
