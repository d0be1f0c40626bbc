"""A painted stone against one drawn by brute force: many slices, many samples, a Gaussian blur."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from friction_estimation.appearance import (
    PARTS,
    Appearance,
    Crop,
    StoneModel,
    learn_appearance,
    window_at,
)
from friction_estimation.appearance.fit import fit_stone
from friction_estimation.appearance.painting import painted, shares
from friction_estimation.appearance.shape import LIT, SIDE
from friction_estimation.camera import Camera

CAMERA = Camera.looking_at(
    position=(0.4, -36.0, 9.0),
    target=(0.0, -3.0, 0.0),
    focal_px=2300.0,
    size=(1920, 1080),
    distortion=(-0.1, 0.02, 0.0, 0.0, 0.0),
)
MODEL = StoneModel(
    radius=0.145,
    height=0.114,
    foot_inset=0.07,
    foot_height=0.043,
    foot_roundness=2.3,
    bevel_height=0.04,
    bevel_inset=0.03,
    roundness=1.9,
    blur_px=0.7,
    colour_blur_px=0.9,
)
GREY = np.array([101.0, 92.0, 119.0, 137.0, 112.0])
ICE, SAMPLES, SLICES = 222.0, 8, 120


def slices():
    """Height, radius, brightness and uprightness of thin discs from the ice to the top."""
    m, angle = MODEL, np.linspace(0, np.pi / 2, SLICES)
    foot_z = m.foot_height * (1 - np.cos(angle) ** (2 / m.foot_roundness))
    foot_r = m.radius - m.foot_inset * (1 - np.sin(angle) ** (2 / m.foot_roundness))
    bevel_z = m.height - m.bevel_height * (1 - np.sin(angle) ** (2 / m.roundness))
    bevel_r = m.radius - m.bevel_inset * (1 - np.cos(angle) ** (2 / m.roundness))
    side_z = np.linspace(m.foot_height, m.height - m.bevel_height, SLICES)
    z = np.concatenate([foot_z, side_z, bevel_z])
    r = np.concatenate([foot_r, np.full(SLICES, m.radius), bevel_r])
    lying = np.abs(np.gradient(r)) / (np.hypot(np.gradient(r), np.gradient(z)) + 1e-12)
    own = np.repeat([GREY[0], GREY[1], GREY[2]], SLICES)
    grey = GREY[1] + lying * (own - GREY[1])
    grey[-1] = GREY[3]
    upright = np.sqrt(np.maximum(1 - lying**2, 0))
    upright[-1] = 0.0
    return z, r, grey, upright


def drawn(window, xy, light=(0.0, 0.0)):
    rows, columns = window.shape
    u = (np.arange(columns * SAMPLES) + 0.5) / SAMPLES - 0.5 + window.origin_px[0]
    v = (np.arange(rows * SAMPLES) + 0.5) / SAMPLES - 0.5 + window.origin_px[1]
    px = np.stack(np.meshgrid(u, v), axis=-1).reshape(-1, 2)
    foot = CAMERA.on_plane(px, 0.0)
    lean = CAMERA.on_plane(px, 1.0) - foot
    picture = np.full(len(px), ICE)
    for z, r, grey, upright in zip(*slices(), strict=True):
        from_axis = foot + z * lean - xy
        away = np.hypot(*from_axis.T)
        seen = away <= r
        lit = upright * GREY[1] * (from_axis[seen] @ light) / (away[seen] + 1e-9)
        picture[seen] = grey + lit
    fine = picture.reshape(rows * SAMPLES, columns * SAMPLES)
    fine = gaussian_filter(fine, MODEL.blur_px * SAMPLES, mode="nearest")
    near = fine.reshape(rows, SAMPLES, columns, SAMPLES)
    half = SAMPLES // 2
    return near[:, half - 1 : half + 1, :, half - 1 : half + 1].mean(axis=(1, 3)).ravel()


@pytest.fixture(scope="module", params=[-11.0, 10.0])
def scene(request):
    xy = np.array([0.2, request.param])
    window = window_at(CAMERA, MODEL.outline_px(CAMERA, xy), 5.0)
    return xy, window, drawn(window, xy)


@pytest.fixture(scope="module")
def film_of_a_stone():
    """Crops of a stone at known places, (10,) and (10, 2) [m]."""
    rng = np.random.default_rng(2)
    places = np.column_stack([np.linspace(0.4, -0.3, 10), np.linspace(-13.0, 14.0, 10)])
    crops = []
    for k, xy in enumerate(places):
        window = window_at(CAMERA, MODEL.outline_px(CAMERA, xy), 5.0)
        assert window is not None
        truth = drawn(window, xy)
        pixels = np.column_stack([truth, np.zeros((len(truth), 2))])
        pixels += rng.normal(0.0, 2.0, pixels.shape)
        behind = np.tile([ICE, 0.0, 0.0], (len(truth), 1))
        pose = np.array([*xy + rng.normal(0.0, [0.02, 0.1]), 0.0])
        crops.append(Crop(window=window, pixels=pixels, background=behind, pose=pose, t=1.0 * k))
    return crops, places


def covered(window, model, xy):
    """Shares of pixels that the parts of a stone without a handle cover."""
    planes = painted(window, model.values, np.array([*xy, 0.0]), with_handle=False)
    return shares(planes, window, model.values)


def learnt(crops, change=0.0):
    """Places and appearance learned from copies of crops with pixels changed by an amount."""
    rng = np.random.default_rng(3)
    own = [
        replace(crop, pixels=crop.pixels + change * rng.standard_normal(crop.pixels.shape))
        for crop in crops
    ]
    look = learn_appearance(own, StoneModel(radius=0.145, height=0.114), 2.0)
    return np.array([crop.pose[:2] for crop in own]), look


def test_a_stone_is_misplaced_no_more_than_what_is_unknown_of_its_shape_allows(film_of_a_stone):
    crops, places = film_of_a_stone
    found, look = learnt(crops)
    assert look.uncertainty is not None
    uncertainty = look.uncertainty.at(places)
    assert np.abs(found - places).max() < 0.03
    assert (np.abs(found - places) < 3 * np.hypot(uncertainty, 0.001)).all()
    # What is far away, and seen from low down, is the least certain.
    assert uncertainty[-1, 1] > 1.5 * uncertainty[0, 1]
    assert uncertainty.max() < 0.03


def test_what_is_learnt_does_not_depend_on_rounding(film_of_a_stone):
    crops, _ = film_of_a_stone
    one, other = learnt(crops)[0], learnt(crops, 1e-9)[0]
    assert np.abs(one - other).max() < 1e-4


@pytest.mark.parametrize(
    "name", ["foot_height", "bevel_height", "bevel_inset", "roundness", "foot_roundness"]
)
def test_a_picture_changes_without_jumps(scene, name):
    """If whole strips of the body had one colour, fine pixels would jump from one to the next."""
    xy, window, _ = scene
    lit = replace(MODEL, light_x=0.2, light_y=-0.1)
    step = 1e-5 if name.endswith(("height", "inset")) else 1e-3
    pictures = [
        covered(window, replace(lit, **{name: getattr(lit, name) + k * step}), xy)
        for k in range(12)
    ]
    assert np.abs(np.diff(pictures, axis=0)).max() > 1e-5
    assert np.abs(np.diff(pictures, n=2, axis=0)).max() < 5e-3


def test_a_low_view_is_painted_to_a_grey_level(scene):
    xy, window, truth = scene
    out = covered(window, MODEL, xy)
    painted = out[0, :, : len(PARTS)] @ GREY + ICE * (1 - out[0].sum(axis=1))
    assert np.abs(painted - truth).max() < 6.0
    assert np.sqrt(np.mean((painted - truth) ** 2)) < 0.8


def test_light_from_one_side_is_painted_and_does_not_move_the_stone(scene):
    xy, window, _ = scene
    light = (0.3, -0.2)
    truth, lit = drawn(window, xy, light), replace(MODEL, light_x=light[0], light_y=light[1])
    out = covered(window, lit, xy)[0]
    parts = out[:, : len(PARTS)]
    painted = parts @ GREY + ICE * (1 - parts.sum(axis=1) - out[:, len(PARTS)])
    painted += GREY[SIDE] * out[:, LIT]
    assert np.ptp(GREY[SIDE] * out[:, LIT]) > 20
    assert np.sqrt(np.mean((painted - truth) ** 2)) < 0.8
    assert_placed(lit, truth, window, xy)


def test_a_known_stone_is_placed_to_a_millimetre_in_a_low_view(scene):
    xy, window, truth = scene
    assert_placed(MODEL, truth, window, xy)


def assert_placed(model, truth, window, xy):
    colours = np.column_stack([GREY, np.zeros((5, 2))])
    look = Appearance(
        model=model, colours=colours, noise=np.array([2.0, 50.0, 50.0]), has_handle=False
    )
    plain = np.zeros((len(truth), 2))
    picture = np.column_stack([truth, plain])
    behind = np.column_stack([np.full(len(truth), ICE), plain])
    start = np.array([xy[0] + 0.02, xy[1] - 0.1, 0.0])
    pose, _, _, visible = fit_stone(picture, behind, window, look, start)
    assert np.abs(pose[:2] - xy).max() < 1.5e-3
    assert visible > 0.95
