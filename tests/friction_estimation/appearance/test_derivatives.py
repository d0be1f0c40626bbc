"""Derivatives of a stone's picture by shape, colours and pose."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from friction_estimation.appearance import (
    PARTS,
    Appearance,
    Crop,
    StoneModel,
    composite,
    coverage,
    window_at,
)
from friction_estimation.appearance.derivatives import TURN_STEP, picture_derivatives, step_of
from friction_estimation.appearance.prior import SHAPE_PRIOR
from friction_estimation.camera import Camera

CAMERA = Camera.looking_at(
    position=(2.5, -9.0, 4.0), target=(0.0, 0.0, 0.0), focal_px=700.0, size=(640, 360)
)
MODEL = StoneModel(
    radius=0.143,
    height=0.1143,
    shadow_x=0.02,
    shadow_y=-0.01,
    shadow=0.3,
    contact=0.3,
    mirror=0.5,
    gloss=0.05,
    light_x=0.2,
    light_y=-0.1,
)
COLOURS = np.array(
    [[90.0, 1, -2], [80, 0, 0], [95, -1, 0], [100, 2, 1], [120, -20, 60]], dtype=float
)
LOOK = Appearance(model=MODEL, colours=COLOURS, noise=np.array([2.0, 6, 5]), has_handle=True)
ICE = np.array([225.0, 3, -4])


def stone_on_ice():
    pose = np.array([0.3, 0.4, 0.7])
    window = window_at(CAMERA, MODEL.outline_px(CAMERA, pose[:2]), 12.0)
    ice = np.tile(ICE, (len(window.ray_xy), 1))
    return Crop(window=window, pixels=ice, background=ice, pose=pose, t=0.0)


def painted(crop, look):
    """The crop's picture by the code that does not know of derivatives, (n, 3)."""
    return composite(coverage(crop, look), crop.background, look.colours)


def changed(crop, name, step):
    """Crop and look after a step of one parameter of the shape, or of the heading."""
    if name == "theta":
        return replace(crop, pose=crop.pose + np.array([0.0, 0.0, step])), LOOK
    model = replace(MODEL, **{name: getattr(MODEL, name) + step})
    return crop, replace(LOOK, model=model)


@pytest.mark.parametrize("name", [*SHAPE_PRIOR, "theta"])
def test_the_picture_changes_with_the_shape_as_pictures_of_two_shapes_differ(name):
    crop, turned = stone_on_ice(), name == "theta"
    names = [] if turned else [name]
    jacobian, _, _ = picture_derivatives(crop, LOOK, names, len(PARTS), 3)
    step = TURN_STEP if turned else step_of(name)
    there, here = painted(*changed(crop, name, step)), painted(crop, LOOK)
    expected = ((there - here) / (step * LOOK.noise)).T
    found = jacobian[-1 if turned else 0]
    assert np.linalg.norm(found - expected) < 0.01 * np.linalg.norm(expected)


def test_the_picture_changes_with_colours_and_place():
    crop = stone_on_ice()
    jacobian, residual, weight = picture_derivatives(crop, LOOK, [], len(PARTS), 3)
    now = painted(crop, LOOK)
    np.testing.assert_allclose(residual, ((crop.pixels - now) / LOOK.noise).T, atol=2e-3)
    assert weight.max() <= 1.0
    for part in range(len(PARTS)):
        for channel in range(3):
            colours = COLOURS.copy()
            colours[part, channel] += 1
            expected = (painted(crop, replace(LOOK, colours=colours)) - now) / LOOK.noise
            np.testing.assert_allclose(jacobian[3 * part + channel], expected.T, atol=2e-4)
    for axis in range(2):
        way = np.zeros(3)
        way[axis] = 0.001
        there, back = (painted(replace(crop, pose=crop.pose + s * way), LOOK) for s in (1, -1))
        expected = ((there - back) / (0.002 * LOOK.noise)).T
        # The picture is moved as a whole; the foot moves a little more than the top.
        error = np.linalg.norm(jacobian[-3 + axis] - expected)
        assert error < 0.25 * np.linalg.norm(expected)
