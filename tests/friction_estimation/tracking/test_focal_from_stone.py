"""The height of a camera that looks straight down, found from misfits that scatter."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from friction_estimation.camera.camera import Camera
from friction_estimation.camera.refinement import unrefined
from friction_estimation.tracking.focal_from_stone import lowest_of
from friction_estimation.tracking.path.uncertainty import camera_variance, systematic_sigma

PLACES = np.array([0.10, 0.12, 0.14, 0.16, 0.18, 0.20, 0.22])
LEAN = 1 / 6.2


@pytest.mark.parametrize("scatter", [0.0, 5.0, 25.0])
def test_the_minimum_is_found_with_an_honest_error(scatter):
    rng = np.random.default_rng(4)
    inside = []
    for _ in range(300):
        values = 1700 + 4e5 * (PLACES - LEAN) ** 2 + rng.normal(0, scatter, len(PLACES))
        at, sigma = lowest_of(list(zip(PLACES.tolist(), values.tolist(), strict=True)))
        assert PLACES[0] <= at <= PLACES[-1]
        inside.append(abs(at - LEAN) < 2 * sigma)
    assert np.mean(inside) > 0.9


def test_values_without_a_minimum_have_a_large_error():
    at, sigma = lowest_of([(x, 100 - 10 * x) for x in PLACES.tolist()])
    assert at == PLACES[-1]
    assert sigma >= np.ptp(PLACES)


def test_an_uncertain_height_adds_to_the_error_of_places_seen_at_a_slant():
    camera = Camera.looking_at(
        position=(0.0, 15.0, 6.0),
        target=(0.0, 15.0, 0.0),
        up=(-1.0, 0.0, 0.0),
        focal_px=690.0,
        size=(1280, 960),
    )
    level = replace(unrefined(camera), measured=500)
    # Farther by a tenth, and longer by as much: the ice looks the same, the stone's height less.
    up = camera.position + np.array([0.0, 0.0, 0.1 * camera.position[2]])
    matrix = camera.lens.matrix.copy()
    matrix[[0, 1], [0, 1]] *= 1.1
    lens = replace(camera.lens, matrix=matrix)
    farther = replace(camera, lens=lens, translation=-camera.rotation @ up)
    xy = np.column_stack([np.zeros(3), camera.position[1] - np.array([0.0, 2.0, 4.0])])
    doubt = replace(level, farther=farther)
    added = np.sqrt(camera_variance(doubt, xy, 0.1143 / 2) - camera_variance(level, xy, 0.1143 / 2))
    assert (systematic_sigma(doubt, xy, 0.1143) >= systematic_sigma(level, xy, 0.1143)).all()
    expected = 0.1143 / 2 * np.array([0.0, 2.0, 4.0]) / camera.position[2] * 0.1 / 1.1
    assert added[:, 1] == pytest.approx(expected, rel=0.1, abs=1e-5)
