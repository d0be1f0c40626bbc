"""How fast films are tracked, on one core and including decoding."""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory

import cv2

from curling_env.commands.benchmarks import Measure, rate
from curling_env.ice import load_ice
from curling_env.physics.slides import slide
from curling_env.throw import Throw
from friction_estimation.camera.scene import load_scene
from friction_estimation.synthetic import FilmSpec, render_films
from friction_estimation.tracking import track_film
from friction_estimation.tracking.overlay.film import write_overlay

SIZE = (1920, 1080)
FPS = 50.0
DRAW_SPEED = 2.15
"""Speed of a draw at the hog line [m/s], the throw that is filmed most."""


def measures() -> Iterator[Measure]:
    """Frames per second for a draw in 1080p50 from behind the sheet, which is rendered first."""
    threads = cv2.getNumThreads()
    cv2.setNumThreads(1)
    try:
        with TemporaryDirectory() as folder:
            yield from _tracking(Path(folder))
    finally:
        cv2.setNumThreads(threads)


def _tracking(folder: Path) -> Iterator[Measure]:
    thrown = slide(
        load_ice("standard"), Throw(speed=DRAW_SPEED, angle=-0.02, spin=1.5).release(), fps=2 * FPS
    )
    assert thrown.trajectory is not None  # a rate was given
    spec = FilmSpec(camera="end", size=SIZE, fps=FPS, people=False)
    (film,) = render_films(folder, [thrown.trajectory], spec)
    scene = load_scene(folder / f"{spec.name}.scene.json")

    found = track_film(film, scene)  # also compiles

    frames_begun: list[float] = []  # processor times at which the first frame was followed

    def note_begin(_what: str, done: float, _total: float = 1.0, /) -> None:
        if not done:
            frames_begun.append(time.process_time())

    learning, looping = 0.0, 0.0

    def track() -> int:
        nonlocal learning, looping
        begun = time.process_time()
        count = track_film(film, scene, progress=note_begin).frame_count
        learning = frames_begun[-1] - begun
        looping = (time.process_time() - frames_begun[-1]) / count
        return count

    def draw() -> int:
        write_overlay(film, scene, found, folder / "overlay.mp4")
        return found.frame_count

    tracked = rate(track, repeats=1, warm=True)
    drawn = rate(draw, repeats=1, warm=True)
    yield Measure(name="track_frames_per_s", value=tracked, unit="frames/s")
    # Learning is done once per film, however long the film is.
    yield Measure(name="track_frame_loop_per_s", value=1 / looping, unit="frames/s")
    yield Measure(name="track_learning_s", value=learning, unit="s")
    yield Measure(
        name="track_frames_per_s_with_overlay",
        value=1 / (1 / tracked + 1 / drawn),
        unit="frames/s",
    )
