"""The paper's figure 6: Lucas–Kanade in one scale and in a pyramid, before and after mid-sheet.

A stone is filmed as it comes towards a camera that sees the whole sheet. Points on it are followed
by optical flow alone, as in the paper. Far from the camera the stone moves a pixel a frame and
both forms follow it; near the camera it moves farther than a window of one scale reaches.
"""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from curling_env.ice import Ice
from curling_env.physics import slide
from curling_env.render.figures import INK, new_figure, save_figure
from curling_env.sheet import RULE_BOOK_STONE, Direction
from curling_env.throw import Throw
from curling_env.trajectory import Trajectory
from curling_env.typing import Floats, Image
from friction_estimation.appearance import StoneModel
from friction_estimation.camera.camera import Camera
from friction_estimation.film.video import Film
from friction_estimation.synthetic import FilmSpec, render_film
from friction_estimation.tracking.films.film_track import FlowMethod
from friction_estimation.tracking.path.optical_flow import (
    FLOW_METHODS,
    lucas_kanade,
    points_to_follow,
)

SPEED = 3.2
"""Of the filmed stone [m/s]: a takeout's, which flow must follow too."""
FPS = 10.0
"""A surveillance camera's rate [1/s]; at 30 both forms follow any throw."""
MARGIN_PX = np.array([90, 45])
"""Of the picture around the followed path [px]."""
STRETCHES = {"before mid-sheet": (7.0, 3.0), "after mid-sheet": (-4.0, -10.5)}
"""Where the stone is followed, y at the beginning and the end [m]; it is played home."""


def draw_flow_figure(
    path: Path, rng: np.random.Generator
) -> tuple[str, dict[tuple[str, str], float]]:
    """Film a throw, follow it with both forms, draw figure 6.

    Parameters
    ----------
    path : of the picture
    rng : of the film's noise

    Returns
    -------
    what was found, as text: points kept and distance to the true stone at the end; and that
        distance by form and stretch [m]
    """
    spec = FilmSpec(
        camera=_camera(),
        fps=FPS,
        people=False,
        lead_in=0.0,
        tail=0.0,
        seed=int(rng.integers(2**31)),
    )
    truth, frames = _filmed(spec)
    camera = spec.resolved()
    model = StoneModel(radius=RULE_BOOK_STONE.radius, height=RULE_BOOK_STONE.height)
    figure = new_figure(10, 6.4)
    panels = figure.subplots(2, 2)
    lines: list[str] = []
    misses: dict[tuple[str, str], float] = {}
    for row, flow in enumerate(FLOW_METHODS):
        for column, (name, (begin, end)) in enumerate(STRETCHES.items()):
            first = int(np.argmax(truth.xy[:, 1] <= begin))
            last = int(np.argmax(truth.xy[:, 1] <= end))
            outline = model.outline_px(camera, truth.xy[first])
            trail, points = _follow(frames[first : last + 1], outline, flow)
            heights = np.full((last + 1 - first, 1), RULE_BOOK_STONE.height)
            true_px = camera.project(np.hstack([truth.xy[first : last + 1], heights]))
            ax = panels[row, column]
            _draw(ax, frames[last], trail, points, true_px)
            miss = _miss(camera, trail, truth.xy[first : last + 1])
            misses[flow, name] = miss
            kept = f"{len(points)} points kept" if len(points) else "all points lost"
            ax.set_title(f"{flow}, {name}: {kept}", fontsize=10, color=INK)
            followed = len(trail) / (last + 1 - first)
            lines.append(
                f"{flow:>10}, {name:<17} {kept:<16} followed {100 * followed:3.0f} % of the "
                f"frames, {100 * miss:6.1f} cm from the stone at the end"
            )
    figure.suptitle(
        f"Figure 6: points on a takeout at {SPEED} m/s followed by Lucas–Kanade (red), its true "
        f"path (white), {FPS:.0f} frames a second",
        fontsize=12, color=INK,
    )  # fmt: skip
    save_figure(figure, path)
    return "\n".join(lines), misses


def _camera() -> Camera:
    """On a tripod at the home end, as the paper's: the whole sheet in view, the near part large."""
    return Camera.looking_at(
        position=(0.9, -25.0, 4.0), target=(0.05, -6.0, 0.0), focal_px=1450.0, size=(1920, 1080)
    )


def _filmed(spec: FilmSpec) -> tuple[Trajectory, list[Image]]:
    """The throw's truth per frame, and the frames read back from the compressed film."""
    far = np.array([-3.0, 3.0, -12.0, 12.0])
    release = Throw(speed=SPEED, spin=1.2).release(Direction.HOME)
    path = slide(Ice.uniform(0.009), release, bounds=far, fps=120.0).trajectory
    assert path is not None
    with tempfile.TemporaryDirectory() as folder:
        film = Path(folder) / "figure6.mp4"
        truth = render_film(film, path, spec)
        frames = [frame for _, frame in Film.open(film).frames()]
    return truth, frames


def _follow(frames: list[Image], outline_px: Floats, flow: FlowMethod) -> tuple[Floats, Floats]:
    """Mean place of the points frame by frame, (k, 2) [px], and the points left at the end."""
    before = _grey(frames[0])
    points = points_to_follow(before, outline_px)
    trail = [points.mean(axis=0)] if len(points) else []
    for frame in frames[1:]:
        after = _grey(frame)
        there, good = lucas_kanade(before, after, points, flow)
        points = there[good]
        if len(points) == 0:
            break
        trail.append(points.mean(axis=0))
        before = after
    return np.array(trail).reshape(-1, 2), points


def _grey(frame: Image) -> Image:
    return np.asarray(cv2.cvtColor(frame, cv2.COLOR_BGR2GRAY), dtype=np.uint8)


def _draw(ax: Any, frame: Image, trail: Floats, points: Floats, true_px: Floats) -> None:
    """The last frame around the path, with trail, points and truth."""
    low = np.floor(true_px.min(axis=0) - MARGIN_PX).astype(int)
    high = np.ceil(true_px.max(axis=0) + MARGIN_PX).astype(int)
    low = np.maximum(low, 0)
    high = np.minimum(high, [frame.shape[1], frame.shape[0]])
    part = frame[low[1] : high[1], low[0] : high[0], ::-1]
    edge = (low[0], high[0], high[1], low[1])
    ax.imshow(part, extent=edge, aspect="auto")
    ax.plot(*true_px.T, color="white", lw=1.0)
    if len(trail):
        ax.plot(*trail.T, ".-", color="#e02020", ms=3, lw=0.8)
    if len(points):
        ax.plot(*points.T, "o", mfc="none", mec="#e02020", ms=5)
    ax.set_xlim(low[0], high[0])
    ax.set_ylim(high[1], low[1])
    ax.set_xticks([])
    ax.set_yticks([])


def _miss(camera: Camera, trail: Floats, truth: Floats) -> float:
    """Distance of the last followed place from where the stone then ends [m]."""
    if len(trail) == 0:
        return float("nan")
    place = camera.on_plane(trail[-1:], RULE_BOOK_STONE.height)[0]
    return float(np.hypot(*(place - truth[-1])))
