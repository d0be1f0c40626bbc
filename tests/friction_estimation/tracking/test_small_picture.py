"""A stone of four pixels fills none of them, and is tracked all the same."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from curling_env.ice import load_ice
from curling_env.physics import play_bounds, slide
from curling_env.throw import Release
from friction_estimation.synthetic import FilmSpec, render_film, scene_of
from friction_estimation.tracking import track_film


def test_a_stone_of_four_pixels_is_tracked(tmp_path: Path) -> None:
    ice = load_ice("standard")
    release = Release(x=0.2, y=-2.0, vx=0.0, vy=1.7, theta=0.0, omega=1.2)
    path = slide(ice, release, bounds=play_bounds(ice, release.direction), fps=60.0).trajectory
    assert path is not None
    spec = FilmSpec(camera="gantry", size=(320, 180), fps=6.0, noise=0.5, people=False)
    truth = render_film(tmp_path / "f.mp4", path, spec, sheet=ice.sheet, stone=ice.stone)
    scene = scene_of(spec.resolved(), sheet=ice.sheet, stone=ice.stone)
    track = track_film(tmp_path / "f.mp4", scene).trajectory
    true = np.column_stack([np.interp(track.t, truth.t, truth.xy[:, k]) for k in range(2)])
    error = np.hypot(*(track.xy - true).T)
    assert len(track) > 0.9 * len(truth)
    assert np.median(error) < 0.14, "a pixel"
