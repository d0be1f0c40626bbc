"""Looks that fit nearly as well, and where they place the stone."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from friction_estimation.appearance import (
    REVERSIBLE,
    Appearance,
    Crop,
    ShapePrior,
    ShapeUncertainty,
    StoneModel,
    composite,
    coverage,
    window_at,
)
from friction_estimation.appearance.ambiguity import sight_uncertainty
from friction_estimation.appearance.profile import fit_profile, shape_uncertainty
from friction_estimation.camera import Camera

CAMERA = Camera.looking_at(
    position=(0.4, -36.0, 9.0), target=(0.0, -3.0, 0.0), focal_px=800.0, size=(640, 360)
)
PLAIN = StoneModel(radius=0.143, height=0.1143)
COLOURS = np.array([[90, 0, 0], [80, 0, 0], [95, 0, 0], [100, 0, 0], [100, 0, 0]], dtype=float)


def pictures(shown, rng):
    """Crops of a stone on its way from the camera, and where it is in each."""
    crops, places = [], np.array([[0.2, y] for y in (-14.0, -6.0, 2.0, 10.0)])
    for t, place in enumerate(places):
        window = window_at(CAMERA, shown.model.outline_px(CAMERA, place), 5.0)
        ice = np.tile([220.0, 0.0, 0.0], (len(window.ray_xy), 1))
        pose = np.append(place, 0.0)
        crop = Crop(window=window, pixels=ice, background=ice, pose=pose, t=float(t))
        seen = composite(coverage(crop, shown), ice, shown.colours)
        seen += rng.normal(0, [2.0, 0.5, 0.5], seen.shape)
        crops.append(replace(crop, pixels=seen))
    return crops, places


def test_crops_that_were_placed_too_far_away_come_nearer_to_the_camera():
    """A look may fit nearly as well with the stone elsewhere on its lines of sight."""
    real = replace(PLAIN, **{name: row[0] for name, row in REVERSIBLE.items()})
    shown = Appearance(model=real, colours=COLOURS, noise=np.array([2.0, 3, 3]), has_handle=False)
    crops, places = pictures(shown, np.random.default_rng(7))
    for crop in crops:
        crop.pose = crop.pose - np.append(0.004 * crop.window.ray_slope.mean(axis=0), 0.0)
    prior = ShapePrior.reversible(PLAIN)
    found = np.array([crop.pose[:2] for crop in crops])
    fit = fit_profile(crops, shown, prior, 0)
    uncertainty, alone = (
        sight_uncertainty(crops, fit, prior, True),
        shape_uncertainty(crops, fit),
    )
    better = np.abs(found + uncertainty.shift - places)
    assert better.max() < 0.6 * np.abs(found - places).max()
    assert (better < 2 * np.hypot(uncertainty.sigma, 0.002)).all()
    assert (uncertainty.sigma >= alone.sigma).all()
    guess = sight_uncertainty(crops, fit, prior, False)
    assert not guess.shift.any()
    assert guess.sigma[-1, 1] > abs(uncertainty.shift[-1, 1])


def test_two_looks_are_weighed_by_how_likely_they_are():
    places = np.column_stack([np.zeros(5), np.linspace(-10, 10, 5)])
    still = np.zeros_like(places)
    one = ShapeUncertainty(places=places, sigma=still + 0.003, shift=still + 0.001)
    other = ShapeUncertainty(
        places=places + np.array([0.0, 0.02]), sigma=still + 0.004, shift=still
    )
    mixed = one.mixed_with(other, 0.25)
    np.testing.assert_allclose(mixed.shift, still + np.array([0.00075, 0.00575]), atol=1e-9)
    variance = 0.75 * 0.003**2 + 0.25 * 0.004**2 + 0.1875 * np.array([0.001, 0.019]) ** 2
    np.testing.assert_allclose(mixed.sigma**2, still + variance, rtol=1e-6)
    np.testing.assert_allclose(one.mixed_with(other, 0.0).sigma, one.sigma)
