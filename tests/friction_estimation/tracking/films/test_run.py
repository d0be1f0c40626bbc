"""Films tracked one after the other: what is left out is let go."""

from __future__ import annotations

import gc
import weakref
from pathlib import Path

import numpy as np
import pytest

from curling_env.errors import InputError
from friction_estimation.synthetic import named_camera, scene_of
from friction_estimation.tracking import SharedCameras, track_each
from friction_estimation.tracking.cutting.pieces import Piece
from friction_estimation.tracking.films import run
from friction_estimation.tracking.films.given_tracker import GivenTracker
from friction_estimation.tracking.films.throws_of_film import ThrowTracker


class Pictures(np.ndarray):
    """Pictures of a throw; unlike an ordinary array, they can be watched."""


def test_the_pictures_of_a_throw_that_is_left_out_are_not_kept(monkeypatch):
    kept, alive, reasons = [], [], []

    def refuse(*_, **__):
        pictures = np.zeros(3).view(Pictures)
        gc.collect()
        alive.append(sum(one() is not None for one in kept))
        kept.append(weakref.ref(pictures))
        try:
            raise ValueError("no stone")
        except ValueError as why:
            raise InputError("no thrown stone found", source="film.mp4") from why

    film = Path("film.mp4")
    several = [Piece(path=film, film=film, begin=k, end=k + 1) for k in range(4)]
    monkeypatch.setattr(ThrowTracker, "_pieces", lambda *_: several)
    monkeypatch.setattr(GivenTracker, "track", refuse)
    monkeypatch.setattr(run, "ordinary_file", lambda *_: None)
    monkeypatch.setattr(SharedCameras, "of", lambda *_: None)
    scene = scene_of(named_camera("gantry", (640, 360)))
    with pytest.raises(InputError, match="no thrown stone found"):
        list(track_each([film], scene, left_out=reasons.append))
    assert len(reasons) == 4
    assert alive == [0, 0, 0, 0]
