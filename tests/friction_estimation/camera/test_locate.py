"""A camera from one photo: rendered as clubs pass them on, small, stretched, bent and cut."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
import pytest

from curling_env.errors import InputError
from curling_env.sheet import HOG_LINE_WIDTH, HOG_LINE_Y, RING_RADII, TEE_Y
from friction_estimation import load_scene
from friction_estimation.camera import (
    Camera,
    camera_from_photo,
    camera_from_scene,
    grey_levels,
    markings_of,
    place_sigma,
    save_scene,
    seen_curves,
)
from friction_estimation.synthetic import FilmRenderer, FilmSpec

TEE = [0.0, TEE_Y]
HOG = [0.0, HOG_LINE_Y + HOG_LINE_WIDTH / 2]


def landmarks():
    """Points on the rings and on the hog line, (n, 2) [m]."""
    around = np.linspace(0, 2 * np.pi, 36, endpoint=False)
    circle = np.column_stack([np.cos(around), np.sin(around)])
    rings = [radius * circle + TEE for radius in RING_RADII[:3]]
    x = np.linspace(-1.8, 1.8, 19)
    return np.concatenate([*rings, np.column_stack([x, np.full(len(x), HOG_LINE_Y)])])


def clicks(photo, off=((0.0, 0.0), (0.0, 0.0))):
    tee, hog = photo.px(np.array([TEE, HOG])) + np.array(off)
    return {"away_tee": tuple(tee), "away_hog_centre": tuple(hog)}


def apart(camera, photo):
    """Distance of rings and hog line from their true pixels in the photo, rms [px]."""
    ice = landmarks()
    true = photo.px(ice)
    inside = ((true > 0) & (true < np.array(camera.size) - 1)).all(axis=1)
    off = camera.project(np.column_stack([ice, np.zeros(len(ice))])) - true
    return float(np.sqrt(np.mean(np.sum(off[inside] ** 2, axis=1))))


@pytest.fixture(scope="module")
def located(club_photo):
    """The camera by exact clicks."""
    return camera_from_photo(club_photo.empty, clicks(club_photo))


@pytest.mark.parametrize("off", [((5.0, -4.0), (-6.0, 4.0)), ((-6.0, 6.0), (5.0, -3.0))])
def test_two_rough_clicks_lead_to_rings_and_hog_line(club_photo, off):
    found = camera_from_photo(club_photo.empty, clicks(club_photo, off))
    assert apart(found.camera, club_photo) < 0.8
    assert max(found.refined.misses_px[name] for name in ("12-foot ring", "hog line")) < 0.5


def test_a_height_that_was_measured_is_kept_and_places_the_tops_of_stones(club_photo, located):
    known = camera_from_photo(club_photo.empty, clicks(club_photo), height=6.0)
    assert known.camera.position[2] == pytest.approx(6.0, rel=0.03)
    assert located.refined.log_focal_sigma > 3 * known.refined.log_focal_sigma


def test_the_command_writes_a_scene_that_reads_the_photo_and_a_picture(
    club_photo, tmp_path, curling
):
    photo, scene, drawn = (tmp_path / name for name in ("ice.png", "scene.json", "drawn.png"))
    cv2.imwrite(str(photo), club_photo.empty)
    marks = [f"{name}={u:.0f},{v:.0f}" for name, (u, v) in clicks(club_photo).items()]
    asked = ["--mark", marks[0], "--mark", marks[1], "-o", str(scene), "--picture", str(drawn)]
    done = curling("locate", photo, *asked)
    assert done.status == 0, done.err
    result = done.json()
    assert result["misses_px"]["hog line"] < 0.5
    size = (club_photo.empty.shape[1], club_photo.empty.shape[0])
    assert apart(camera_from_scene(load_scene(scene), size), club_photo) < 0.8
    picture = cv2.imread(str(drawn))
    changed = cv2.absdiff(picture, cv2.resize(club_photo.empty, picture.shape[1::-1]))
    assert 0.001 < np.mean(changed.max(axis=2) > 60) < 0.2  # lines are drawn, and only lines


@pytest.mark.parametrize(
    ("marks", "message"),
    [
        ({"away_tee": (60.0, 60.0)}, "tee and hog_centre of one end"),
        ({"away_tee": (60.0, 60.0), "tea": (1.0, 1.0)}, "unknown point 'tea'"),
        ({"away_tee": (9e3, 60.0), "away_hog_centre": (1.0, 1.0)}, "away_tee at .* outside"),
        ({"away_tee": (60.0, 60.0), "away_hog_centre": (61.0, 60.0)}, "at the same place"),
    ],
)
def test_clicks_that_say_nothing_are_refused(club_photo, marks, message):
    with pytest.raises(InputError, match=message):
        camera_from_photo(club_photo.empty, marks)


def test_clicks_on_the_wrong_things_are_found_out(club_photo):
    tee, hog = clicks(club_photo).values()
    swapped = {"away_tee": hog, "away_hog_centre": tee}
    with pytest.raises(InputError, match="check the marks|near the marks"):
        camera_from_photo(club_photo.empty, swapped)


def test_a_photo_without_paint_is_refused(club_photo):
    blank = np.random.default_rng(1).normal(200, 3, club_photo.empty.shape)
    with pytest.raises(InputError, match="check the marks|near the marks"):
        camera_from_photo(blank.astype(np.uint8), clicks(club_photo))


@pytest.mark.parametrize("factor", [2.0, 3.0])
def test_the_size_of_the_photo_does_not_matter(club_photo, factor):
    large = cv2.resize(club_photo.empty, None, fx=factor, fy=factor, interpolation=cv2.INTER_CUBIC)
    marks = {
        name: ((u + 0.5) * factor - 0.5, (v + 0.5) * factor - 0.5)
        for name, (u, v) in clicks(club_photo).items()
    }
    found = camera_from_photo(large, marks)
    ice = landmarks()
    true = (club_photo.px(ice) + 0.5) * factor - 0.5
    inside = ((true > 0) & (true < np.array(found.camera.size) - 1)).all(axis=1)
    off = found.camera.on_plane(true[inside]) - ice[inside]
    assert np.sqrt(np.mean(np.sum(off**2, axis=1))) < 0.03


@pytest.mark.parametrize("seed", range(3))
def test_a_strongly_bent_photo_with_marks_a_third_of_a_metre_off(seed):
    """A wide camera upright over the sheet, whose lens bends lines at the rim by a fifth."""
    true = Camera.looking_at(
        position=(0.3, 14.6, 5.0),
        target=(0.0, 14.4, 0.0),
        up=(0.0, 1.0, 0.0),
        focal_px=470.0,
        size=(540, 960),
        distortion=(-0.22, 0.045, 0.0, 0.0, 0.0),
    )
    rng = np.random.default_rng(seed)
    still = FilmRenderer(FilmSpec(camera=true, people=False)).still
    photo = np.clip(still + rng.normal(0, 2.0, still.shape), 0, 255).astype(np.uint8)
    turn = rng.uniform(0, 2 * np.pi, 2)
    off = np.column_stack([np.cos(turn), np.sin(turn), 0 * turn]) * 0.3
    (tee, hog) = true.project(np.array([[*TEE, 0.0], [*HOG, 0.0]]) + off)
    found = camera_from_photo(photo, {"away_tee": tuple(tee), "away_hog_centre": tuple(hog)})
    x, y = np.meshgrid([-1.5, 0.0, 1.5], np.linspace(11.0, 19.0, 9))
    ice = np.column_stack([x.ravel(), y.ravel(), 0 * x.ravel()])
    missed = found.camera.on_plane(true.project(ice)) - ice[:, :2]
    assert np.abs(missed).max() < 0.02
    assert found.summary()["agrees"]


@pytest.mark.parametrize("shift", [(0.2, 0.0), (0.0, 0.3), (-0.3, 0.2)])
def test_a_camera_that_is_wrong_never_agrees_and_the_curve_is_named(club_photo, located, shift):
    markings, grey = markings_of(located.scene.sheet), grey_levels(club_photo.empty)
    assert not any(c.contradicts for c in seen_curves(located.camera, grey, (0, 0), markings))
    camera = located.camera
    aside = camera.rotation @ np.array([*shift, 0.0])
    moved = replace(camera, translation=camera.translation + aside)
    wrong = {c.name for c in seen_curves(moved, grey, (0, 0), markings) if c.contradicts}
    assert wrong & {"12-foot ring", "8-foot ring", "hog line"}


def test_a_ring_of_another_size_is_named(club_photo):
    """The 8-foot ring is painted over, and another one is drawn 0.2 m outside it."""
    photo = club_photo.empty.copy()
    around = np.linspace(0, 2 * np.pi, 90)
    circle = np.column_stack([np.cos(around), np.sin(around)])
    inner, outer = (np.round(club_photo.px(r * circle + TEE)).astype(np.int32) for r in (1.5, 0.7))
    cv2.fillPoly(photo, [inner], (60, 60, 190))
    cv2.fillPoly(photo, [outer], (235, 235, 235))
    with pytest.raises(InputError, match="not with the .* ring"):
        camera_from_photo(photo, clicks(club_photo))


def test_the_scene_has_the_standard_error_of_its_places(club_photo, located, tmp_path):
    save_scene(located.scene, tmp_path / "scene.json")
    scene = load_scene(tmp_path / "scene.json")
    x, y = np.meshgrid([-1.3, 0.0, 1.3], np.linspace(11.5, 18.5, 8))
    places = np.column_stack([x.ravel(), y.ravel()])
    sigma = place_sigma(scene, located.camera, places)
    off = located.camera.on_plane(club_photo.px(places)) - places
    assert np.mean(np.abs(off) < 1.96 * sigma[:, None]) > 0.9
    assert (sigma < 0.05).all()
