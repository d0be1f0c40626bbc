"""Crops: the pixels of a stone and of its surroundings."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from friction_estimation.appearance import (
    Appearance,
    Crop,
    StoneModel,
    clear_surroundings,
    composite,
    coverage,
    explained_crops,
    window_at,
)
from friction_estimation.camera import Camera

CAMERA = Camera.looking_at(
    position=(0.0, -20.0, 6.0), target=(0.0, 0.0, 0.0), focal_px=2000.0, size=(640, 480)
)
MODEL = StoneModel(radius=0.145, height=0.1143)
LOOK = Appearance(
    model=replace(MODEL, mirror=1.0),
    colours=np.tile([60.0, 0.0, 0.0], (5, 1)),
    noise=np.ones(3),
    has_handle=False,
)


def crop_at(xy=(0.0, 0.0)):
    """A crop around the middle of the ice that shows a stone at a place."""
    window = window_at(CAMERA, MODEL.outline_px(CAMERA, np.zeros(2)), 40.0)
    assert window is not None
    ice = np.tile([230.0, 0.0, 0.0], (len(window.ray_xy), 1))
    crop = Crop(window=window, pixels=ice, background=ice, pose=np.array([*xy, 0.0]), t=0.0)
    crop.pixels = composite(coverage(crop, LOOK), ice, LOOK.colours)
    return crop


def test_pictures_of_another_stone_are_no_pictures_of_this_one():
    """A path may go over to a stone that was hit; then the throw was refused."""
    own = [crop_at() for _ in range(3)]
    other = replace(crop_at((0.12, 0.05)), pose=np.zeros(3))
    assert explained_crops([*own, other], LOOK) == own
    # Where the look explains no more than half of the pictures, it may be the look that is wrong.
    assert explained_crops([own[0], other, other], LOOK) == [own[0], other, other]


def test_the_surroundings_of_a_stone_are_cleared_but_its_mirror_image_stays():
    """Without it, stones seen from the end were taken to stand nearer to the camera."""
    crop = crop_at()
    window, stone = crop.window, crop.pixels.copy()
    sweeper = np.hypot(*(window.ray_xy - [0.4, 0.0]).T) < 0.1
    crop.pixels[sweeper] = 0.0
    clear_surroundings(crop, CAMERA, MODEL)
    np.testing.assert_allclose(crop.pixels, stone, atol=1.0)
