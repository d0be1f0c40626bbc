"""Paint corrects what a hand marked: on rendered sheets, by cameras whose place is known."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
import pytest

from curling_env.errors import InputError
from curling_env.sheet import RING_RADII, TEE_Y, Sheet
from friction_estimation.camera import (
    Camera,
    camera_from_scene,
    disagreeing,
    grey_levels,
    log_height_prior,
    markings_of,
    measure_markings,
    refine,
    refine_at_focal,
    seen_curves,
)
from friction_estimation.synthetic import FilmRenderer, FilmSpec, scene_of

SIZES = {"end": (1280, 720), "gantry": (1280, 720), "side": (1280, 720), "ceiling": (1280, 960)}


@pytest.fixture(scope="module")
def views():
    """Camera, scene with exact points, and a still with a sensor's noise, by name."""
    found = {}
    for name, size in SIZES.items():
        renderer = FilmRenderer(FilmSpec(camera=name, people=False, size=size))
        rng = np.random.default_rng(3)
        still = np.asarray(renderer.still, dtype=np.float64)
        still = np.clip(np.round(still + rng.normal(0, 1.0, still.shape)), 0, 255)
        found[name] = renderer.camera, scene_of(renderer.camera), still.astype(np.uint8)
    return found


def marked(scene, camera, seed, *, error_px=3.0, unknown=False):
    """A scene whose points are off, and whose lens may be unknown."""
    rng = np.random.default_rng(seed)
    px = scene.points_px + rng.normal(0, error_px, scene.points_px.shape)
    px = np.clip(px, 0, np.array(camera.size) - 1)
    if unknown:
        return replace(scene, points_px=px, camera_matrix=None, distortion=None)
    return replace(scene, points_px=px)


def misplaced(camera, true, z=0.0):
    """Root mean square error over the visible sheet of points at height z [m]."""
    x, y = np.meshgrid([-1.0, 0.0, 1.0], np.linspace(-19, 19, 39))
    points = np.column_stack([x.ravel(), y.ravel(), np.full(x.size, z)])
    points = points[true.sees(points)]
    off = camera.on_plane(true.project(points), z) - points[:, :2]
    return float(np.sqrt(np.mean(np.sum(off**2, axis=1))))


@pytest.mark.parametrize("name", SIZES)
@pytest.mark.parametrize("seed", [1, 2])
def test_corners_off_by_three_pixels_cost_a_few_millimetres(views, name, seed):
    true, scene, still = views[name]
    known = marked(scene, true, seed)
    before = camera_from_scene(known, true.size)
    refined = refine(before, known, still)
    assert misplaced(before, true) > 0.01
    assert misplaced(refined.camera, true) < 0.003
    assert refined.measured > 300
    assert refined.rms_px < 0.3


@pytest.mark.parametrize("name", SIZES)
def test_corners_far_off_are_found_or_the_failure_is_reported(views, name):
    true, scene, still = views[name]
    found = []
    for seed in range(4):
        known = marked(scene, true, seed, error_px=12.0)
        try:
            refined = refine(camera_from_scene(known, true.size), known, still)
        except InputError:
            continue
        if refined.measured:
            found.append(misplaced(refined.camera, true))
    assert len(found) >= 3
    assert max(found) < 0.01


@pytest.mark.parametrize(("name", "limit"), [("end", 0.004), ("side", 0.008)])
def test_an_unknown_lens_is_found_from_the_paint(views, name, limit):
    true, scene, still = views[name]
    known = marked(scene, true, 1, unknown=True)
    before = camera_from_scene(known, true.size)
    refined = refine(before, known, still)
    assert misplaced(before, true, 0.11) > 0.1
    assert misplaced(refined.camera, true, 0.11) < limit
    assert refined.camera.lens.matrix[0, 0] == pytest.approx(true.lens.matrix[0, 0], rel=0.005)
    assert refined.log_focal_sigma < 0.01


def test_straight_down_the_paint_leaves_the_height_open_and_says_so(views):
    true, scene, still = views["gantry"]
    known = marked(scene, true, 2, unknown=True)
    refined = refine(camera_from_scene(known, true.size), known, still)
    assert misplaced(refined.camera, true) < 0.006  # the ice itself is in place
    assert refined.log_focal_sigma > 0.2
    change = float(np.log(true.position[2] / refined.camera.position[2]))
    at_height = refine_at_focal(refined, known, still, (0, 0), change)
    assert at_height.camera.position[2] == pytest.approx(true.position[2], rel=0.03)
    assert at_height.rms_px == pytest.approx(refined.rms_px, rel=0.3)
    assert misplaced(at_height.camera, true, 0.11) < 0.008


def test_the_whole_sheet_is_hardly_seen_from_low_down(views):
    true, _, _ = views["gantry"]

    def unlikely(share):
        """The same picture of the ice from a share of the height."""
        matrix = true.lens.matrix.copy()
        matrix[[0, 1], [0, 1]] *= share
        position = true.position * np.array([1, 1, share])
        lens = replace(true.lens, matrix=matrix)
        return log_height_prior(replace(true, lens=lens, translation=-true.rotation @ position))

    assert unlikely(0.6) > unlikely(1.0) + 1
    assert unlikely(3.0) > unlikely(1.0) + 1
    measured = true.position[2]
    assert log_height_prior(true, 1.1 * measured) > log_height_prior(true, measured) + 50


def test_exact_points_and_a_known_lens_are_not_made_worse(views):
    true, scene, still = views["end"]
    refined = refine(true, scene, still)
    assert misplaced(refined.camera, true) < 0.002


@pytest.mark.parametrize("seed", range(3))
def test_points_that_leave_nothing_to_improve_are_checked_by_the_paint_all_the_same(views, seed):
    """Else σ would include the error of marks by hand, which the paint has removed."""
    true, scene, still = views["end"]
    grain = np.random.default_rng(seed).normal(0, 1.0, still.shape)
    refined = refine(true, scene, np.clip(still + grain, 0, 255).astype(np.float32))
    assert refined.measured > 300
    assert misplaced(refined.camera, true) < 0.003


def test_a_picture_without_paint_leaves_the_camera_as_it_was(views):
    true, scene, still = views["side"]
    rng = np.random.default_rng(0)
    blank = rng.normal(120, 2, still.shape).clip(0, 255).astype(np.uint8)
    known = marked(scene, true, 1)
    before = camera_from_scene(known, true.size)
    refined = refine(before, known, blank)
    assert refined.measured == 0
    assert refined.camera is before


def test_someone_standing_on_a_line_does_not_move_it(views):
    true, scene, still = views["side"]
    covered = still.copy()
    for u in (300, 560, 900):
        covered[280:420, u : u + 50] = (60, 70, 110)
    known = marked(scene, true, 1)
    refined = refine(camera_from_scene(known, true.size), known, covered)
    assert misplaced(refined.camera, true) < 0.005


def test_marks_are_read_where_they_are_to_a_tenth_of_a_pixel(views):
    true, scene, still = views["gantry"]
    markings = markings_of(scene.sheet)
    measured = measure_markings(grey_levels(still), (0, 0), true, markings, 3.0)
    assert len(measured.index) > 0.7 * measured.expected
    assert np.median(np.abs(measured.offset_px)) < 0.1


def test_part_of_a_picture_serves_with_its_place(views):
    true, scene, still = views["end"]
    known = marked(scene, true, 1)
    before = camera_from_scene(known, true.size)
    whole = refine(before, known, still).camera
    part = refine(before, known, still[10:, 40:], (40, 10)).camera
    assert part.translation == pytest.approx(whole.translation, abs=0.01)


def test_the_size_of_the_picture_does_not_matter(views):
    true, scene, still = views["end"]
    known = marked(scene, true, 1)
    large = tuple(3 * side for side in true.size)
    enlarged = cv2.resize(still, large, interpolation=cv2.INTER_CUBIC)[30:, 121:]
    at_large = replace(known, picture_size=true.size, image_size=true.size).for_size(large)
    refined = refine(camera_from_scene(at_large, large), at_large, enlarged, (121, 30))
    assert refined.camera.size == large
    found = replace(refined.camera, lens=refined.camera.lens.resized(np.full(2, 1 / 3), true.size))
    assert misplaced(found, true) < 0.004
    assert refined.rms_px < 1.0


@pytest.mark.parametrize("name", SIZES)
def test_a_camera_beside_its_place_disagrees_with_rings_or_hog_lines(views, name):
    true, scene, still = views[name]
    markings, grey = markings_of(scene.sheet), grey_levels(still)
    assert disagreeing(seen_curves(true, grey, (0, 0), markings)) == ()
    bold = markings.xy[markings.of("12-foot ring", "hog line")]
    there = np.column_stack([bold, np.zeros(len(bold))])
    for shift in ([0.3, 0.0, 0.0], [0.0, -0.4, 0.0], [0.2, 0.2, 0.1]):
        moved = replace(true, translation=true.translation + true.rotation @ np.array(shift))
        missed = moved.project(there) - true.project(there)
        if np.median(np.linalg.norm(missed[true.sees(there)], axis=1)) > 4.0:
            assert disagreeing(seen_curves(moved, grey, (0, 0), markings))


def test_a_line_thinner_than_a_pixel_is_seen_where_it_is():
    """Wherever it lies between rows of pixels, which it is along all of its length."""
    sheet = Sheet()
    markings = markings_of(sheet)
    centre = markings[markings.of("centre line")]
    # From above, 18 px a metre: the line is a quarter of a pixel wide, along the rows.
    px_per_metre, size = 18.0, (853, 480)
    off = []
    for phase in np.linspace(0.0, 0.9, 10):
        camera = Camera.looking_at(
            position=(phase / px_per_metre, 0.0, 16.0),
            target=(phase / px_per_metre, 0.0, 0.0),
            up=(-1.0, 0.0, 0.0),
            focal_px=px_per_metre * 16.0,
            size=size,
        )
        row = camera.project([[0.0, 0.0, 0.0]])[0, 1]
        light = 230.0 - 40.0 * np.exp(-0.5 * ((np.arange(size[1]) - row) / 0.65) ** 2)
        grey = np.repeat(light[:, None], size[0], axis=1).astype(np.float32)
        seen = measure_markings(grey, (0, 0), camera, centre, 2.0)
        off.append(np.mean(seen.offset_px))
        assert len(seen.index) > 50
    assert np.abs(off).max() < 0.02


def test_a_ring_seen_at_a_slant_is_where_it_is():
    """Its narrow ends, which a blur moves inwards, are ignored."""
    camera = Camera.looking_at(
        position=(0.4, -36.5, 8.8), target=(0.0, -12.5, 0.0), focal_px=1480.0, size=(1280, 720)
    )
    far, near = camera.project([[-2, TEE_Y + 2, 0], [2, TEE_Y - 2, 0]])
    (u0, v0), (u1, v1) = np.floor(far) - 15, np.floor(near) + 15
    fine = (np.arange(5) - 2) / 5
    u = (np.arange(u0, u1)[:, None] + fine).ravel()
    v = (np.arange(v0, v1)[:, None] + fine).ravel()
    rays = np.stack(np.meshgrid(u, v), axis=-1).reshape(-1, 2)
    inside = np.linalg.norm(camera.on_plane(rays) - [0, TEE_Y], axis=1) < RING_RADII[1]
    shares = inside.reshape(len(v) // 5, 5, len(u) // 5, 5).mean(axis=(1, 3))
    grey = cv2.GaussianBlur(230 - 100 * shares.astype(np.float32), (0, 0), 0.6)
    markings = markings_of(Sheet())
    ring = markings[markings.of("8-foot ring") & (markings.xy[:, 1] > 0)]
    seen = measure_markings(grey, (int(u0), int(v0)), camera, ring, 2.0)
    assert len(seen.index) > 10
    assert np.abs(seen.offset_px).max() < 0.12
