"""The detector finds drawn stones that it has not seen, at any size a camera shows them."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from learn.rink_patches import draw_patch

from curling_env.sheet import PAPER_SHEET, TEE_Y
from friction_estimation.appearance import StoneModel
from friction_estimation.camera.camera import Camera
from friction_estimation.tracking.detection import detector
from friction_estimation.tracking.detection.detector import (
    SURE,
    DetectorNetwork,
    StoneFinder,
    stone_width_px,
)

MODEL = StoneModel(radius=0.145, height=0.1143)
NEAR_PX = 5.0
"""A third of a stone in a patch [px]."""


def test_drawn_stones_are_found_and_little_else(rng):
    detector = DetectorNetwork()
    found = invented = total = 0
    for _ in range(110):
        patch = draw_patch(rng)
        picture = cv2.cvtColor(patch.picture, cv2.COLOR_RGB2BGR)
        seen = [one.px for one in detector.detect(picture) if one.score >= SURE]
        apart = np.full((len(patch.stones), len(seen)), np.inf)
        for k, place in enumerate(seen):
            apart[:, k] = np.linalg.norm(patch.stones - place, axis=1)
        hits = int((apart.min(axis=1, initial=np.inf) < NEAR_PX).sum())
        found, total, invented = (
            found + hits,
            total + len(patch.stones),
            invented + len(seen) - hits,
        )
    assert total > 200
    assert found > 0.85 * total
    assert invented < 0.06 * total


@pytest.fixture(scope="module")
def end_camera():
    """Behind the home end, 3 m high: far stones are narrow and flat."""
    return Camera.looking_at(
        position=(0.3, -26.0, 3.0), target=(0.0, 4.0, 0.0), focal_px=1900.0, size=(1920, 1080)
    )


def stones_before(camera, places):
    """A picture of grey stones with red handles on white ice, each as a stack of discs."""
    picture = np.full((camera.size[1], camera.size[0], 3), 215, np.uint8)
    circle = np.linspace(0, 2 * np.pi, 60)
    around = np.column_stack([np.cos(circle), np.sin(circle), np.zeros(60)])
    discs = [
        (z, 0.145 - 0.03 * abs(z / 0.057 - 1) ** 3, (95, 95, 95)) for z in np.linspace(0, 0.114, 12)
    ]
    discs += [(0.12, 0.09, (40, 40, 190)), (0.15, 0.03, (30, 30, 150))]
    for x, y in sorted(places, key=lambda place: -place[1]):
        for height, radius, colour in discs:
            px = camera.project(np.array([x, y, height]) + radius * around)
            cv2.fillPoly(picture, [np.round(px * 16).astype(np.int32)], colour, cv2.LINE_AA, 4)
    return cv2.GaussianBlur(picture, (0, 0), 0.8)


def test_near_and_far_stones_are_found_by_one_camera(end_camera):
    places = [(0.5, -17.0), (-1.0, -8.0), (0.8, 0.0), (-0.4, 8.0), (0.4, TEE_Y)]
    picture = stones_before(end_camera, places)
    widths = stone_width_px(end_camera, np.array(places), MODEL)
    assert widths.max() > 4 * widths.min()
    detector = StoneFinder(end_camera, MODEL, PAPER_SHEET)
    found = [one for one in detector.detect(picture) if one.is_sure]
    assert len(found) == len(places)
    for place in places:
        near = min(found, key=lambda one: np.linalg.norm(one.xy - place))
        off = near.xy - place
        assert off @ np.linalg.solve(near.covariance, off) < 16  # squared standard errors


def test_parts_at_the_rim_of_a_picture_may_be_narrow(end_camera):
    """A few columns of large stones leave nothing once they are resampled."""
    picture = np.full((1080, 1920, 3), 215, np.uint8)
    detector = StoneFinder(end_camera, MODEL, PAPER_SHEET)
    for x in range(0, 2300, 7):
        box = np.array([[[x, 900.0], [x + 5.0, 905.0]]])
        assert detector.detect(picture, box) == []


def test_a_stone_on_the_button_needs_a_clearer_picture(end_camera, monkeypatch):
    """A distant button is as small and round as a stone."""
    at_tee, beside = (0.0, -TEE_Y), (0.6, -TEE_Y)
    picture = stones_before(end_camera, [at_tee, beside])

    def scores():
        found = StoneFinder(end_camera, MODEL, PAPER_SHEET).detect(picture)
        nearest = (
            min(found, key=lambda one: np.linalg.norm(one.xy - place)) for place in (at_tee, beside)
        )
        return np.array([one.score for one in nearest])

    score = scores()
    monkeypatch.setattr(detector, "BUTTON_ODDS", 1.0)
    of_pictures = scores()
    assert score[1] == of_pictures[1] >= SURE
    odds, of_picture = (value[0] / (1 - value[0]) for value in (score, of_pictures))
    assert odds == pytest.approx(0.44 * of_picture)
