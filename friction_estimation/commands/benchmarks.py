"""Measure of tracking films, on one core and including decoding."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory

import cv2

from curling_env.benchmarks.measures import Measure, rate
from curling_env.ice import load_ice
from curling_env.physics.slides import slide
from curling_env.throw import Throw
from friction_estimation.camera.scene import load_scene
from friction_estimation.synthetic import FilmSpec, render_films
from friction_estimation.tracking import track_film

SIZE = (1920, 1080)
FPS = 50.0
DRAW_SPEED = 2.15
"""Speed of a draw at the hog line [m/s], the most common throw."""


def measures() -> Iterator[Measure]:
    """Measure frames per second for a rendered draw in 1080p50 from behind the sheet."""
    threads = cv2.getNumThreads()
    cv2.setNumThreads(1)
    thrown = slide(
        load_ice("standard"), Throw(speed=DRAW_SPEED, angle=-0.02, spin=1.5).release(), fps=2 * FPS
    )
    assert thrown.trajectory is not None  # a rate was requested
    spec = FilmSpec(camera="end", size=SIZE, fps=FPS, people=False)
    try:
        with TemporaryDirectory() as folder:
            (film,) = render_films(Path(folder), [thrown.trajectory], spec)
            scene = load_scene(Path(folder) / f"{spec.name}.scene.json")
            tracked = rate(lambda: track_film(film, scene).frame_count, repeats=1)
    finally:
        cv2.setNumThreads(threads)
    yield Measure(name="track_frames_per_s", value=tracked, unit="frames/s")
