"""The colours and the heading of another stone, from one picture of it or from all of its way."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from friction_estimation.appearance import (
    Appearance,
    Crop,
    StoneModel,
    channels_of,
    composite,
    coverage,
)
from friction_estimation.appearance.model import window_at
from friction_estimation.camera import Camera
from friction_estimation.tracking.detection.own_look import own_look
from friction_estimation.tracking.path.heading import fit_heading_curve
from friction_estimation.tracking.several.later_look import views_on_the_way

MODEL = StoneModel(radius=0.145, height=0.1143, blur_px=0.7, colour_blur_px=1.0)
YELLOW, RED = (40, 190, 235), (40, 40, 190)
ICE = np.array([225.0, 0.0, 0.0])


def camera(focal_px):
    return Camera.looking_at(
        position=(0.0, -20.0, 8.0), target=(0.0, 0.0, 0.0), focal_px=focal_px, size=(1280, 720)
    )


def look_of(handle_bgr, brightness=110.0):
    handle = channels_of(np.array([[handle_bgr]], dtype=np.float32))[0, 0]
    colours = np.vstack([np.tile([brightness, 0.0, 0.0], (4, 1)), handle])
    return Appearance(model=MODEL, colours=colours, noise=np.full(3, 3.0), has_handle=True)


def picture(look, pose, focal_px, rng, t=0.0):
    """A stone on bare ice, with noise."""
    seen_by = camera(focal_px)
    window = window_at(seen_by, MODEL.outline_px(seen_by, np.array(pose[:2])), 6.0)
    assert window is not None
    ice = np.tile(ICE, (len(window.ray_xy), 1))
    crop = Crop(window=window, pixels=ice, background=ice, pose=np.array(pose), t=t)
    crop.pixels = composite(coverage(crop, look), ice, look.colours) + rng.normal(0, 2, ice.shape)
    return crop


@pytest.mark.parametrize("heading", [0.3, 2.4, -1.8])
def test_another_handle_and_other_granite_are_told(heading):
    rng = np.random.default_rng(1)
    crop = picture(look_of(YELLOW, 120.0), (0.2, 3.0, heading), 2200.0, rng)
    crop.pose = np.array([0.2, 3.0, 0.0])
    found = own_look(crop, look_of(RED))
    assert found.clear
    assert abs(np.angle(np.exp(1j * (found.heading - heading)))) < 0.3
    assert np.abs(found.look.colours[4] - look_of(YELLOW).colours[4]).max() < 25
    assert found.look.colours[:4, 0].mean() == pytest.approx(120, abs=8)


def test_no_handle_is_more_colourful_than_film_and_a_speck_shows_no_heading():
    rng = np.random.default_rng(2)
    crop = picture(look_of(YELLOW), (0.2, 3.0, 1.0), 350.0, rng)
    crop.pixels[crop.pixels[:, 2] > 2] += [0.0, -40.0, 60.0]
    found = own_look(crop, look_of(RED))
    luma, *differences = found.look.colours[4]
    blue, red = luma + np.array(differences) / [0.564, 0.713]
    assert -1 < min(blue, red) <= max(blue, red) < 256
    assert not found.clear


def test_hidden_pixels_do_not_count():
    rng = np.random.default_rng(3)
    crop = picture(look_of(YELLOW), (0.2, 3.0, 0.3), 2200.0, rng)
    hidden = np.arange(len(crop.pixels)) % 3 == 0
    crop.pixels[hidden] = 0.0
    found = own_look(crop, look_of(RED), hidden)
    assert abs(found.heading - 0.3) < 0.3
    assert found.look.colours[:4, 0].mean() == pytest.approx(110, abs=8)


def test_on_its_way_a_stone_shows_its_colours_though_where_it_lay_they_seemed_others():
    rng = np.random.default_rng(4)
    t = np.arange(14) * 0.3
    truth = 0.5 + 0.9 * t
    places = np.column_stack([0.1 * t, 1.0 + 1.2 * t])
    pictures = [
        picture(look_of(YELLOW), (*xy, heading), 700.0, rng, moment)
        for moment, xy, heading in zip(t, places, truth, strict=True)
    ]
    wrong = look_of(YELLOW)
    wrong = replace(wrong, colours=np.vstack([wrong.colours[:4], [60.0, 40.0, -40.0]]))
    views = views_on_the_way(pictures, wrong, look_of(RED), t, np.full(len(t), 1.2))
    curve = fit_heading_curve(views, t, np.full(len(t), 1.2))
    assert curve is not None
    assert np.abs(np.angle(np.exp(1j * (curve.at(t) - truth)))).max() < 0.5
