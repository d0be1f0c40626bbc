"""The height of a camera that looks straight down, found from the pictures of stones."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest

from friction_estimation.appearance import StoneModel
from friction_estimation.camera import Camera, unrefined
from friction_estimation.tracking.focal_from_stone import _spread_best, _Trial, likely_height
from friction_estimation.tracking.path.uncertainty import camera_variance, systematic_sigma
from friction_estimation.tracking.tuning import EDGE_ERROR_PX

STONE = StoneModel(radius=0.145, height=0.1143)
LEANS = np.linspace(0.04, 0.4, 11)


@pytest.mark.parametrize("height", [4.5, 6.2, 15.0])
def test_the_height_of_least_misfit_is_found_with_the_error_that_its_rise_tells(height):
    rise = 15.0
    misfit = 900 + rise * np.log(LEANS * height) ** 2
    log_height, sigma = likely_height(list(zip(LEANS.tolist(), misfit.tolist(), strict=True)))
    assert sigma == pytest.approx(np.sqrt(1 / rise), rel=0.1)
    assert log_height == pytest.approx(np.log(height), abs=0.3 * sigma)


def test_misfits_without_a_minimum_leave_the_height_open():
    log_height, sigma = likely_height([(lean, 900.0) for lean in LEANS.tolist()])
    assert np.log(1 / LEANS[-1]) < log_height < np.log(1 / LEANS[0])
    assert sigma == pytest.approx(np.log(LEANS[-1] / LEANS[0]) / np.sqrt(12), rel=0.05)


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
    assert (systematic_sigma(doubt, xy, STONE) >= systematic_sigma(level, xy, STONE)).all()
    expected = 0.1143 / 2 * np.array([0.0, 2.0, 4.0]) / camera.position[2] * 0.1 / 1.1
    assert added[:, 1] == pytest.approx(expected, rel=0.1, abs=1e-5)


def test_a_stone_of_few_pixels_is_known_less_well():
    def known_px(focal_px):
        camera = Camera.looking_at(
            position=(0.0, 0.0, 16.0),
            target=(0.0, 0.0, 0.0),
            up=(-1.0, 0.0, 0.0),
            focal_px=focal_px,
            size=(1280, 720),
        )
        exact = replace(unrefined(camera), measured=500)
        exact = replace(exact, covariance=np.zeros_like(exact.covariance))
        sigma = systematic_sigma(exact, np.zeros((1, 2)), STONE)
        return float(sigma[0]) * focal_px / (16.0 - STONE.height / 2)

    small, large = known_px(300.0), known_px(3000.0)  # radii of 2.7 and 27 px
    assert EDGE_ERROR_PX < large < 1.07 * EDGE_ERROR_PX
    assert 1.9 * large < small < 2.2 * large


@dataclass
class Valleys:
    """Heights whose looks rest in one of two valleys: the seen one, or one that costs more."""

    tried: int = 0

    def beside(self, known, lean):
        self.tried += 1
        return replace(known, lean=lean, cost=_cost(lean, known.seen))


def _cost(lean, valley):
    return 500.0 + 300 * np.log(lean / 0.0625) ** 2 + (80.0 if valley == "wrong" else 0.0)


def test_a_height_whose_look_is_in_a_wrong_valley_is_tried_again():
    leans = [0.035, 0.05, 0.065, 0.08, 0.095]
    valley = ["right", "right", "wrong", "right", "wrong"]
    trials = {
        k: _Trial(lean=k, cost=_cost(k, v), seen=v) for k, v in zip(leans, valley, strict=True)
    }
    heights = Valleys()
    _spread_best(trials, heights)
    assert {trial.seen for trial in trials.values()} == {"right"}
    assert min(trials.values(), key=lambda trial: trial.cost).lean == 0.065
    assert heights.tried <= 12
