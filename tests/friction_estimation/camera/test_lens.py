"""The lens: its one formula in all its uses, and unknown lenses that the paint must tell."""

from __future__ import annotations

import ast
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

import friction_estimation
from friction_estimation.camera import (
    TERMS,
    Camera,
    FreeLens,
    camera_from_scene,
    refine,
    refine_at_focal,
)
from friction_estimation.synthetic import FilmRenderer, FilmSpec, named_camera, scene_of

BENT = (-0.12, 0.03, 0.002, -0.001, 0.004)
FULL = FreeLens(focal=True, bends=True, minor=True, axis=True)
STONE = 0.057
"""Height at which a stone is placed [m]."""
SIZES = {"ceiling": (720, 540), "side": (960, 540), "end": (1280, 720)}


@pytest.fixture
def bent() -> Camera:
    return Camera.looking_at(
        position=(0.7, -34.0, 8.0),
        target=(0.2, -8.0, 0.0),
        focal_px=1400.0,
        size=(1920, 1080),
        distortion=BENT,
    )


def test_the_formula_is_opencvs(bent):
    points = np.random.default_rng(3).uniform([-2, -22, 0], [2, 22, 0.3], (200, 3))
    lens, turn = bent.lens, cv2.Rodrigues(bent.rotation)[0]
    seen = cv2.projectPoints(points, turn, bent.translation, lens.matrix, lens.distortion)[0]
    assert bent.project(points) == pytest.approx(seen.reshape(-1, 2), abs=1e-7)


def test_only_one_module_knows_the_terms_of_the_lens():
    """Lens parameters that another lens model would have to change."""
    root = Path(friction_estimation.__file__).parent
    knowing = set()
    for path in root.rglob("*.py"):
        names = {n.id for n in ast.walk(ast.parse(path.read_text())) if isinstance(n, ast.Name)}
        if names & set(TERMS):
            knowing.add(path.relative_to(root).as_posix())
    assert knowing == {"camera/lens.py"}


def lens_like(camera: Camera, rng: np.random.Generator) -> Camera:
    """The camera with another lens: bent, a little askew, its axis beside the middle."""
    first = rng.uniform(-0.14, -0.02) - camera.lens.shares[0]
    second = rng.uniform(0.0, 0.015) - camera.lens.shares[1]
    third, *tangential = rng.normal(0, [0.002, 4e-4, 4e-4])
    minor = [*tangential, third]
    axis = rng.normal(0, 0.008, 2)
    return camera.moved(np.r_[np.zeros(6), rng.normal(0, 0.03), first, second, minor, axis], FULL)


def places_seen(camera: Camera) -> np.ndarray:
    """Places along the sheet at the height of a stone, (n, 3) [m], those within a lens's reach."""
    x, y = np.meshgrid([-1.2, 0.0, 1.2], np.linspace(-19, 19, 39))
    points = np.column_stack([x.ravel(), y.ravel(), np.full(x.size, STONE)])
    local = points @ camera.rotation.T + camera.translation
    reach = np.hypot(*camera.size) / 2 / camera.lens.matrix[0, 0] * 1.2
    near = np.linalg.norm(local[:, :2], axis=1) < reach * local[:, 2]
    return points[camera.sees(points, 15.0) & near]


@pytest.fixture(scope="module")
def found():
    """For each camera: places along the sheet, by how much each is missed, and σ [m]."""
    results = {}
    for name, size in SIZES.items():
        rng = np.random.default_rng([11, len(name)])
        camera = lens_like(named_camera(name, size), rng)
        renderer = FilmRenderer(FilmSpec(camera=camera, people=False))
        still = np.clip(renderer.still + rng.normal(0, 1.0, renderer.still.shape), 0, 255).astype(
            "f4"
        )
        scene = scene_of(camera, click_px=3.0, rng=rng)
        scene = replace(scene, camera_matrix=None, distortion=None)
        seen = refine(camera_from_scene(scene, size), scene, still)
        if name == "ceiling":  # straight down the stone tells the height, to two per cent or so
            change = np.log(camera.position[2] / seen.camera.position[2])
            result = refine_at_focal(seen, scene, still, (0, 0), change + rng.normal(0, 0.02))
            farther = refine_at_focal(seen, scene, still, (0, 0), change + 0.03)
            seen = replace(result, farther=farther.camera)
        points = places_seen(camera)
        off = seen.camera.on_plane(camera.project(points), STONE) - points[:, :2]
        sigma = seen.place_sigma(points[:, :2], STONE)
        results[name] = points, off, sigma
    return results


@pytest.mark.parametrize("name", SIZES)
def test_places_lie_in_their_intervals_wherever_the_stone_is(found, name):
    _, off, sigma = found[name]
    assert np.mean(np.abs(off) < 1.96 * sigma[:, None]) >= 0.95


@pytest.mark.parametrize(("name", "limit"), [("ceiling", 0.008), ("side", 0.004), ("end", 0.012)])
def test_small_terms_of_a_lens_are_found_with_the_large_ones(found, name, limit):
    _, off, _ = found[name]
    assert np.sqrt(np.mean(np.sum(off**2, axis=1))) < limit


def test_places_far_from_the_paint_that_determined_the_lens_are_less_certain(found):
    points, _, sigma = found["ceiling"]
    beyond = points[:, 1] < 10.2  # the hog line is at 10.97 m
    assert beyond.any()
    assert sigma[beyond].max() > 1.5 * np.median(sigma[~beyond])
    assert sigma[beyond].max() > sigma[~beyond].max()


def test_a_lens_bent_beyond_what_straight_points_allow_is_begun_with_a_bend():
    camera = named_camera("ceiling_middle")
    bends = np.array([-0.2, 0.02]) - camera.lens.shares[:2]
    curved = camera.moved(np.r_[np.zeros(7), bends], FreeLens(focal=True, bends=True))
    scene = replace(scene_of(curved), camera_matrix=None, distortion=None)
    begun = camera_from_scene(scene, curved.size)
    assert begun.lens.shares[0] < -0.1
    seen = begun.project(np.column_stack([scene.sheet_points, np.zeros(len(scene.sheet_points))]))
    assert np.abs(seen - scene.points_px).max() < 0.02 * np.hypot(*curved.size)


def test_a_step_changes_what_is_free_and_nothing_else():
    camera = named_camera("side", SIZES["side"])
    step = np.r_[np.zeros(6), 0.0, 0.0, 0.0, 0.002, 0.001, -0.001, 0.01, 0.0]
    changed = camera.moved(step, FULL)
    assert changed.lens.shares - camera.lens.shares == pytest.approx([0, 0, 0.002, 0.001, -0.001])
    moved_by = changed.lens.matrix[0, 2] - camera.lens.matrix[0, 2]
    assert moved_by == pytest.approx(0.01 * camera.size[0] / 2)
    assert changed.position == pytest.approx(camera.position)
