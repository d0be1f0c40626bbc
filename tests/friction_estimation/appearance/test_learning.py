"""Appearance of a stone, learned from its pictures."""

from __future__ import annotations

from dataclasses import replace
from itertools import islice

import numpy as np
import pytest

from curling_env.ice import Ice
from curling_env.physics import slide
from curling_env.throw import Throw
from friction_estimation.appearance import (
    REVERSIBLE,
    Appearance,
    Crop,
    ShapePrior,
    StoneModel,
    channels_of,
    composite,
    coverage,
    crops_at,
    learn_appearance,
    window_at,
)
from friction_estimation.appearance.crops import fit_pose
from friction_estimation.appearance.profile import fit_profile
from friction_estimation.camera import Camera
from friction_estimation.synthetic import FilmRenderer, FilmSpec, all_on_film

MODEL = StoneModel(radius=0.145, height=0.1143)
CHAMFERED = replace(
    MODEL,
    bevel_height=0.02,
    bevel_inset=0.012,
    roundness=1.1,
    foot_height=0.02,
    foot_inset=0.09,
    foot_roundness=1.1,
)
"""A stone that cannot be turned over: its upper edge is nearly square, and its foot a cone."""
REVERSIBLE_STONE = replace(MODEL, **{name: row[0] for name, row in REVERSIBLE.items()})
RED_HANDLE = (95.0, -8.0, 45.0)


def painted(seed, *, focal_px, position, noise, has_handle=True, model=CHAMFERED):
    """Pictures of a stone that turns on its way, and its pose in each, (n, 3)."""
    camera = Camera.looking_at(
        position=position, target=(0.0, 0.0, 0.0), focal_px=focal_px, size=(1920, 1080)
    )
    body = [[92, 0, 0], [92, 0, 0], [105, 0, 0], [130, 0, 0]]
    shown = Appearance(
        model=model,
        colours=np.array([*body, RED_HANDLE], dtype=float),
        noise=np.ones(3),
        has_handle=has_handle,
    )
    rng = np.random.default_rng(seed)
    crops, poses = [], []
    for k, y in enumerate(np.linspace(-9.0, 9.0, 14)):
        pose = np.array([0.2 + 0.01 * k, y, 1.0 + 0.7 * k])
        window = window_at(camera, MODEL.outline_px(camera, pose[:2]), 8.0)
        ice = np.tile([222.0, 0.0, 0.0], (len(window.ray_xy), 1))
        crop = Crop(window=window, pixels=ice, background=ice, pose=pose, t=0.8 * k)
        seen = composite(coverage(crop, shown), ice, shown.colours)
        seen += rng.normal(0.0, [noise, 0.6 * noise, 0.6 * noise], seen.shape)
        rough = np.array([pose[0] + 0.01, pose[1] - 0.01, 0.0])
        crops.append(replace(crop, pixels=np.round(seen), pose=rough))
        poses.append(pose)
    return crops, np.array(poses)


@pytest.fixture(scope="module")
def small_stone():
    """Crops of a stone of a few pixels that turns, seen from the side, and its true track."""
    spec = FilmSpec(camera="side", size=(960, 540), people=False, fps=4.0)
    path = slide(Ice.uniform(0.02), Throw(speed=2.1, spin=1.4).release(), fps=120).trajectory
    renderer = FilmRenderer(spec)
    frames = [frame.copy() for frame in islice(renderer.frames(path, seed=1), 12)]
    (truth,) = all_on_film([path], spec)
    t = np.arange(len(frames)) / spec.fps
    places = np.column_stack([np.interp(t, truth.t, axis) for axis in truth.xy.T])
    ice = channels_of(np.median(frames, axis=0).astype(np.uint8))
    crops = crops_at(frames, list(t), list(places), ice, (0, 0), renderer.camera, MODEL)
    assert len(crops) == len(frames)
    return crops, truth


def learnt(crops, moved=0.0):
    """Copies of crops with the poses that are learnt from them, and the look.

    `moved` shifts the poses to begin with [m].
    """
    own = [replace(crop, pose=crop.pose + np.array([moved, -moved, 0.0])) for crop in crops]
    return own, learn_appearance(own, MODEL, 2.0)


@pytest.fixture(scope="module")
def learnt_small(small_stone):
    """Crops of the small stone with the poses learnt from them, and the look; see `learnt`."""
    return learnt(small_stone[0])


def test_shade_that_does_not_turn_with_the_stone_is_not_taken_for_its_handle(
    small_stone, learnt_small
):
    """From the side the lit half of a small stone stays where it is while the stone turns."""
    (_, truth), (crops, look) = small_stone, learnt_small
    t = np.array([crop.t for crop in crops])
    assert look.has_handle
    headings = np.array([crop.pose[2] for crop in crops])
    miss = np.angle(np.exp(1j * (headings - np.interp(t, truth.t, truth.theta))))
    assert np.ptp(truth.theta[truth.t <= t[-1]]) > 2.5
    assert np.abs(miss).max() < 0.4


def test_where_a_fit_begins_hardly_changes_what_is_learnt(small_stone, learnt_small):
    """The picture once changed in jumps, and a fit ended where the last jump left it."""
    (one, look), (other, as_well) = learnt_small, learnt(small_stone[0], 1e-6)
    assert look.uncertainty is not None
    assert as_well.uncertainty is not None
    places = np.array([crop.pose[:2] for crop in one]) + look.uncertainty.shift
    others = np.array([crop.pose[:2] for crop in other]) + as_well.uncertainty.shift
    assert np.sqrt(np.mean(np.sum((others - places) ** 2, axis=1))) < 2e-4


def test_a_mirror_image_of_lamps_from_above_does_not_move_the_stone():
    """Stones on glossy ice were placed too near the point below the camera."""
    camera = Camera.looking_at(
        position=(0.0, 0.0, 8.0),
        target=(0.0, 0.0, 0.0),
        up=(-1.0, 0.0, 0.0),
        focal_px=480.0,
        size=(960, 540),
    )
    model = StoneModel(radius=0.145, height=0.1143)
    colours = np.array([[90, 0, 0], [80, 0, 0], [95, 0, 0], [100, 0, 0], [100, 0, 0]], dtype=float)
    shown = Appearance(
        model=replace(model, gloss=0.08), colours=colours, noise=np.ones(3), has_handle=False
    )
    crops, places = [], (2.0, 3.5, 5.0, 6.5)
    for t, y in enumerate(places):
        place = np.array([0.3, y, 0.0])
        window = window_at(camera, model.outline_px(camera, place[:2]), 8.0)
        ice = np.tile([230.0, 0.0, 0.0], (len(window.ray_xy), 1))
        crop = Crop(window=window, pixels=ice, background=ice, pose=place, t=float(t))
        seen = np.round(composite(coverage(crop, shown), ice, colours))
        crops.append(replace(crop, pixels=seen, pose=place + np.array([0.0, 0.004, 0.0])))
    dull = replace(shown, model=model)
    found = fit_profile(crops, dull, ShapePrior(typical=model), 20).look
    assert abs(found.model.gloss - 0.08) < 0.02
    assert max(abs(crop.pose[1] - y) for crop, y in zip(crops, places, strict=True)) < 0.001


BESIDE, BEHIND = (-14.0, 0.0, 11.0), (0.0, -36.0, 9.0)


def test_a_handle_that_no_pixel_shows_alone_is_found():
    """Red mixed with the ice behind it looked grey, and the stone seemed to have no handle."""
    crops, poses = painted(1, focal_px=520.0, position=BESIDE, noise=2.0)
    look = learn_appearance(crops, MODEL, 1.5, try_others=False)
    assert look.has_handle
    miss = np.array([crop.pose[2] for crop in crops]) - poses[:, 2]
    assert np.abs(np.angle(np.exp(1j * miss))).max() < 0.3


def test_a_small_stone_without_a_handle_gets_none():
    crops, _ = painted(2, focal_px=520.0, position=BESIDE, noise=2.0, has_handle=False)
    assert not learn_appearance(crops, MODEL, 1.5, try_others=False).has_handle


@pytest.mark.parametrize("model", [CHAMFERED, REVERSIBLE_STONE], ids=["chamfered", "reversible"])
def test_the_pictures_are_placed_by_the_look_that_is_returned(model):
    """Poses were left where the other kind of stone had them, and whole films were refused."""
    crops, _ = painted(4, focal_px=1000.0, position=BEHIND, noise=3.0, model=model)
    look = learn_appearance(crops, MODEL, 3.0)
    again = [replace(crop) for crop in crops]
    for crop in again:
        fit_pose(crop, look)
    moved = [after.pose - before.pose for before, after in zip(crops, again, strict=True)]
    assert np.hypot(*np.mean(moved, axis=0)[:2]) < 0.001
