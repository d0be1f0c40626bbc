"""Films tracked one after the other; no state remains of a skipped film."""

from __future__ import annotations

import gc
import weakref

import numpy as np
import pytest

from curling_env.errors import NoThrowError
from friction_estimation.synthetic import named_camera, scene_of
from friction_estimation.tracking import track_each


class Pictures(np.ndarray):
    """Pictures of a throw; unlike an ordinary array, they can be watched."""


def test_the_pictures_of_a_throw_that_is_left_out_are_not_kept(tmp_path):
    kept, alive, reasons = [], [], []

    def refuse(film, scene, *, progress):
        pictures = np.zeros(3).view(Pictures)
        gc.collect()
        alive.append(sum(one() is not None for one in kept))
        kept.append(weakref.ref(pictures))
        try:
            raise ValueError("no stone")
        except ValueError as why:
            raise NoThrowError("no thrown stone found", source=film) from why

    films = [tmp_path / f"{k}.mp4" for k in range(4)]
    scene = scene_of(named_camera("gantry", (640, 360)))
    with pytest.raises(NoThrowError, match="no thrown stone found"):
        list(track_each(films, scene, tracker=refuse, left_out=reasons.append))
    assert len(reasons) == 4
    assert alive == [0, 0, 0, 0]
