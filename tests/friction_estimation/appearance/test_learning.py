"""What is learnt of a stone from its pictures."""

from __future__ import annotations

from itertools import islice

import numpy as np

from curling_env.ice import Ice
from curling_env.physics.one_stone.slide import slide
from curling_env.throw import Throw
from friction_estimation.appearance import StoneModel, crops_at, learn_appearance
from friction_estimation.appearance.fit import channels_of
from friction_estimation.synthetic import FilmRenderer, FilmSpec, all_on_film


def test_shade_that_does_not_turn_with_the_stone_is_not_taken_for_its_handle():
    """From the side the lit half of a small stone stays where it is while the stone turns."""
    spec = FilmSpec(camera="side", size=(960, 540), people=False, fps=4.0)
    path = slide(Ice.uniform(0.02), Throw(speed=2.1, spin=1.4).release(), fps=120).trajectory
    renderer = FilmRenderer(spec)
    frames = [frame.copy() for frame in islice(renderer.frames(path, seed=1), 12)]
    (truth,) = all_on_film([path], spec)
    t = np.arange(len(frames)) / spec.fps
    places = np.column_stack([np.interp(t, truth.t, axis) for axis in truth.xy.T])
    ice = channels_of(np.median(frames, axis=0).astype(np.uint8))
    model = StoneModel(radius=0.145, height=0.1143)
    crops = crops_at(frames, list(t), list(places), ice, (0, 0), renderer.camera, model)
    assert len(crops) == len(frames)
    assert learn_appearance(crops, model, 2.0).has_handle
    headings = np.array([crop.pose[2] for crop in crops])
    miss = np.angle(np.exp(1j * (headings - np.interp(t, truth.t, truth.theta))))
    assert np.ptp(truth.theta[truth.t <= t[-1]]) > 2.5
    assert np.abs(miss).max() < 0.4
