"""A stone covers its pixels, and its handle points in its direction."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from curling_env.sheet import (
    Stone,
)
from friction_estimation.camera import Camera
from friction_estimation.synthetic import (
    CAMERAS,
    StoneOnIce,
    StoneShape,
    named_camera,
)
from friction_estimation.synthetic.sheet_drawing import PixelRays
from friction_estimation.synthetic.stone_drawing import draw_stones, stone_box

from .conftest import EVEN, PLACES_SEEN, above

SPECKLE = np.zeros(65536, dtype=np.float32)


def cover_of(camera: Camera, stone: StoneOnIce, shape: StoneShape, exposure: float = 0.0):
    """The share of every pixel that a stone covers, and the picture it is drawn in."""
    width, height = camera.size
    picture = np.full((height, width, 3), 200.0, dtype=np.float32)
    box = stone_box(camera, shape, stone)
    cover = np.zeros((height, width))
    cover[box.slices] = draw_stones(
        picture[box.slices],
        _rays(camera),
        box,
        [stone],
        shape,
        light=EVEN,
        speckle=SPECKLE,
        exposure=exposure,
    )
    return cover, picture


_RAYS: dict[int, PixelRays] = {}


def _rays(camera: Camera) -> PixelRays:
    return _RAYS.setdefault(id(camera), PixelRays.of(camera))


def silhouette(camera: Camera, stone: StoneOnIce, shape: StoneShape):
    """Area and centroid of the stone's true outline in the image, from its projected surface."""
    angle = np.linspace(0, 2 * np.pi, 400, endpoint=False)
    body = np.concatenate(
        [
            np.column_stack([r * np.cos(angle), r * np.sin(angle), np.full(400, z)])
            for r, z in shape.outline
        ]
    )
    ball = np.random.default_rng(0).standard_normal((4000, 3))
    ball /= np.linalg.norm(ball, axis=1, keepdims=True)
    r, h = shape.radius, shape.height
    parts = [
        body,
        np.concatenate([0.014 * ball + [-0.2 * r, 0, h], 0.014 * ball + [-0.24 * r, 0, h + 0.045]]),
        np.concatenate(
            [0.0145 * ball + [-0.24 * r, 0, h + 0.047], 0.0145 * ball + [0.72 * r, 0, h + 0.053]]
        ),
    ]
    c, s = np.cos(stone.theta), np.sin(stone.theta)
    turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    px = [camera.project(part @ turn.T + [stone.x, stone.y, 0]) for part in parts]
    everything = np.concatenate(px)
    corner = np.floor(everything.min(axis=0)) - 1
    extent = everything.max(axis=0) + 2 - corner
    fine = int(3000 / extent.max())
    size = np.ceil(extent * fine).astype(int)
    mask = np.zeros((size[1], size[0]), dtype=np.uint8)
    for points in px:
        place = ((points - corner) * fine).astype(np.float32)
        cv2.fillConvexPoly(mask, np.round(cv2.convexHull(place)).astype(np.int32), 1)
    moments = cv2.moments(mask, binaryImage=True)
    centre = np.array([moments["m10"], moments["m01"]]) / moments["m00"]
    return moments["m00"] / fine**2, corner + centre / fine


@pytest.mark.parametrize(
    ("name", "y"),
    [(name, PLACES_SEEN.get(name, (11.3, 16.9))[k % 2]) for k, name in enumerate(CAMERAS)],
)
def test_a_stone_covers_its_true_outline(name, y):
    camera = named_camera(name)
    shape = StoneShape()
    stone = StoneOnIce(x=-0.6123, y=y, theta=2.1)
    cover, _ = cover_of(camera, stone, shape)
    area, centre = silhouette(camera, stone, shape)
    v, u = np.mgrid[: cover.shape[0], : cover.shape[1]]
    centroid = np.array([(cover * u).sum(), (cover * v).sum()]) / cover.sum()
    assert cover.sum() == pytest.approx(area, rel=0.01)
    np.testing.assert_allclose(centroid, centre, atol=0.02)


def test_the_top_of_a_stone_is_shifted_by_its_height():
    """A low cylinder's top disc, in granite, from straight above: no side is seen."""
    camera = above(0.3, 2.0, height=6.0, focal_px=1500.0)
    shape = StoneShape(radius=0.14, height=0.11, profile=((0.8, 0.0), (1.0, 1.0)))
    stone = StoneOnIce(x=0.45, y=2.1)
    cover, _ = cover_of(camera, stone, shape)
    v, u = np.mgrid[:240, :320]
    centroid = np.array([(cover * u).sum(), (cover * v).sum()]) / cover.sum()
    top = camera.project([[0.45, 2.1, 0.11]])[0]
    np.testing.assert_allclose(centroid, top, atol=0.02)
    assert cover.sum() == pytest.approx(np.pi * (0.14 * 1500 / (6 - 0.11)) ** 2, rel=0.003)


@pytest.mark.parametrize("theta", [0.0, 1.0, 2.5, -1.9])
def test_the_handle_points_along_theta(theta):
    camera = above(0.0, 0.0, height=5.0, focal_px=1500.0)
    _, picture = cover_of(camera, StoneOnIce(x=0, y=0, theta=theta), StoneShape())
    red = np.clip(picture[..., 2] - picture[..., 0] - 30, 0, None)
    v, u = np.mgrid[:240, :320]
    forward = (red * (u - 160)).sum(), (red * (v - 120)).sum()  # along y, along x
    assert np.arctan2(forward[0], forward[1]) == pytest.approx(theta, abs=0.03)


def test_a_stone_of_another_size_is_drawn_in_its_size():
    camera = above(0.0, 0.0)
    large, _ = cover_of(camera, StoneOnIce(x=0, y=0), StoneShape())
    small, _ = cover_of(camera, StoneOnIce(x=0, y=0), StoneShape.of(Stone(radius=0.105)))
    assert small.sum() / large.sum() == pytest.approx((0.105 / 0.145) ** 2, rel=0.02)


def test_exposure_smears_a_stone_without_shifting_it():
    camera = above(0.0, 0.0)
    still = StoneOnIce(x=0.013, y=0.02)
    moving = StoneOnIce(x=0.013, y=0.02, vx=-0.5, vy=3.0)
    sharp, _ = cover_of(camera, still, StoneShape())
    smeared, _ = cover_of(camera, moving, StoneShape(), exposure=0.02)
    u = np.arange(320)
    spread = [
        (cover * (u - (cover * u).sum() / cover.sum()) ** 2).sum() / cover.sum()
        for cover in (sharp, smeared)
    ]
    assert (smeared * u).sum() / smeared.sum() == pytest.approx(
        (sharp * u).sum() / sharp.sum(), abs=0.02
    )
    # A uniform smear of 3 m/s · 0.02 s at 100 px/m adds 6²/12 px² of variance.
    assert spread[1] - spread[0] == pytest.approx(3.0, rel=0.05)
