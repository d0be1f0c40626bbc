"""What pictures of a stone show of it, and of what is around it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from friction_estimation.appearance import Appearance, StoneModel, clear_surroundings
from friction_estimation.appearance.crops import Crop, composite, coverage
from friction_estimation.appearance.model import window_at
from friction_estimation.camera.camera import Camera


def test_the_surroundings_of_a_stone_are_cleared_but_its_mirror_image_stays():
    """Without it, stones seen from the end were taken to stand nearer to the camera."""
    camera = Camera.looking_at(
        position=(0.0, -20.0, 6.0), target=(0.0, 0.0, 0.0), focal_px=2000.0, size=(640, 480)
    )
    model = StoneModel(radius=0.145, height=0.1143)
    colours = np.tile([60.0, 0.0, 0.0], (5, 1))
    look = Appearance(
        model=replace(model, mirror=1.0), colours=colours, noise=np.ones(3), has_handle=False
    )
    window = window_at(camera, model.outline_px(camera, np.zeros(2)), 40.0)
    assert window is not None
    ice = np.tile([230.0, 0.0, 0.0], (len(window.ray_xy), 1))
    crop = Crop(window=window, pixels=ice, background=ice, pose=np.zeros(3), t=0.0)
    stone = composite(coverage(crop, look), ice, colours)
    crop.pixels = stone.copy()
    sweeper = np.hypot(*(window.ray_xy - [0.4, 0.0]).T) < 0.1
    crop.pixels[sweeper] = 0.0
    clear_surroundings(crop, camera, model)
    np.testing.assert_allclose(crop.pixels, stone, atol=1.0)
