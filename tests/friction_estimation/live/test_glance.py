"""First numbers of a throw on a film whose truth is known, with sweepers around the stone."""

from __future__ import annotations

import numpy as np
import pytest

from curling_env.ice import load_ice
from curling_env.physics import slide
from curling_env.throw import Release
from friction_estimation.camera.pose import camera_from_scene
from friction_estimation.live.glance import Glance
from friction_estimation.synthetic import FilmRenderer, FilmSpec, on_film, scene_of
from friction_estimation.tracks.throw_table import measure_throw


@pytest.mark.slow
def test_a_split_is_measured_live_beside_thrower_and_sweepers():
    # From before the back line, so that the split is seen.
    release = Release(x=0.0, y=-20.2, vx=0.02, vy=2.45, theta=0.0, omega=1.5)
    path = slide(load_ice("standard"), release, fps=30.0).trajectory
    spec = FilmSpec(camera="end", size=(960, 540), fps=8.0, people=True, tail=3.0)
    scene = scene_of(spec.resolved())
    glance = Glance(camera_from_scene(scene, (960, 540)), scene)
    truth, true = measure_throw(path), on_film(path, spec)
    split_at, rested_at = np.inf, np.inf
    for t, picture in zip(true.t, FilmRenderer(spec).frames(path), strict=True):
        glance.add(float(t), picture)
        if glance.seen is not None and glance.seen.back_to_hog is not None:
            split_at = min(split_at, t)
        if glance.rests:
            rested_at = min(rested_at, t)
    seen = glance.seen
    assert seen.back_to_hog.value == pytest.approx(truth.back_to_hog.value, abs=0.05)
    assert seen.hog_to_hog.value == pytest.approx(truth.hog_to_hog.value, abs=0.1)
    passed_hog = true.t[np.argmax(true.xy[:, 1] >= -10.9725)]
    assert split_at - passed_hog < 1.0
    moving = np.hypot(*(true.xy - true.xy[-1]).T) > 0.03
    assert 0 <= rested_at - true.t[np.flatnonzero(moving)[-1]] < 5.0
    assert seen.right.value == pytest.approx(truth.right.value, abs=0.1)
    assert seen.past.value == pytest.approx(truth.past.value, abs=0.3)
