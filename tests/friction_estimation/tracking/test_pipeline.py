"""From film to track, on a small film that is drawn without the tracker's own model."""

from __future__ import annotations

import json

import cv2
import numpy as np
import pytest

from curling_env.trajectory import read_tracks
from friction_estimation import Scene, load_scene
from friction_estimation.camera import Camera, save_scene
from friction_estimation.film import Film, film_writer

SIZE = (480, 270)
FPS = 12.0
RADIUS, HEIGHT = 0.145, 0.114
CAMERA = Camera.looking_at(
    position=(0.8, 6.0, 7.0),
    target=(0.0, 11.0, 0.0),
    focal_px=330.0,
    size=SIZE,
    distortion=(-0.05, 0.01, 0, 0, 0),
)
FINE = 4
"""Pixels are drawn four times finer and averaged, for smooth edges."""


def truth_at(t):
    """A stone that slides, curls a little, turns, and comes to rest after 3.6 s."""
    t = np.minimum(t, 3.6)
    y = 7.6 + 1.8 * t - 0.25 * t**2
    return np.array([-0.3 + 0.02 * t**2, y, 0.4 + 1.1 * t])


def fill(image, points, colour):
    px = (CAMERA.project(points) + 0.5) * FINE - 0.5
    hull = cv2.convexHull(px.astype(np.float32)).reshape(-1, 2)
    cv2.fillConvexPoly(image, np.round(hull * 16).astype(np.int32), colour, cv2.LINE_AA, 4)


def ring(centre, radius, z):
    a = np.linspace(0, 2 * np.pi, 60)
    return np.column_stack(
        [centre[0] + radius * np.cos(a), centre[1] + radius * np.sin(a), np.full(60, z)]
    )


def draw_stone(image, x, y, theta):
    side = [ring((x, y), RADIUS - 0.02, 0.0), ring((x, y), RADIUS, 0.02)]
    side += [ring((x, y), RADIUS, 0.1), ring((x, y), RADIUS - 0.015, HEIGHT)]
    fill(image, np.concatenate(side), (90, 92, 95))
    fill(image, ring((x, y), RADIUS - 0.015, HEIGHT), (128, 130, 132))
    along = np.array([np.cos(theta), np.sin(theta)])
    across = np.array([-along[1], along[0]])
    bar = [np.array([x, y]) + a * along + b * across for a in (-0.02, 0.11) for b in (-0.02, 0.02)]
    fill(image, np.column_stack([bar, np.full(4, HEIGHT + 0.03)]), (30, 190, 230))


def draw_ice():
    image = np.full((SIZE[1] * FINE, SIZE[0] * FINE, 3), (50, 44, 40), dtype=np.uint8)
    grid = [(x, y) for x in (-2.25, 2.25) for y in np.linspace(6.5, 22.25, 40)]
    fill(image, np.array([[x, y, 0.0] for x, y in grid]), (232, 230, 228))
    tee = (0.0, 17.3735)
    for radius, colour in (
        (1.829, (190, 120, 50)),
        (1.219, (232, 230, 228)),
        (0.61, (50, 50, 200)),
    ):
        fill(image, ring(tee, radius, 0.0), colour)
    fill(
        image, np.array([[x, y, 0.0] for x in (-2.25, 2.25) for y in (10.97, 11.07)]), (60, 60, 200)
    )
    return image


def draw_film(path, *, stone=True, walker=True, frames=54):
    rng = np.random.default_rng(11)
    ice = draw_ice()
    with film_writer(path, SIZE, FPS) as writer:
        for i in range(frames):
            image = ice.copy()
            if stone:
                draw_stone(image, *truth_at(i / FPS))
            if walker:
                x, y = 1.2, 9.0 + i / FPS
                body = [(x + a, y, z) for a in (-0.25, 0.25) for z in (0.0, 1.7)]
                fill(image, np.array(body), (120, 60, 60))
            frame = cv2.resize(image, SIZE, interpolation=cv2.INTER_AREA).astype(np.float64)
            writer.write(np.clip(frame + rng.normal(0, 1.5, frame.shape), 0, 255).astype(np.uint8))
    return path


def scene():
    known = np.array([[-1.5, 14.0], [1.5, 14.0], [-2.0, 10.9725], [2.0, 10.9725], [0.0, 9.0]])
    return Scene(
        sheet_points=known,
        points_px=CAMERA.project(np.column_stack([known, np.zeros(5)])),
        camera_matrix=CAMERA.lens.matrix,
        distortion=CAMERA.lens.distortion,
        stone_radius=RADIUS,
        stone_height=HEIGHT,
    )


@pytest.fixture(scope="module")
def film(tmp_path_factory):
    return draw_film(tmp_path_factory.mktemp("film") / "throw.mp4")


def test_the_command_measures_the_stone_to_millimetres_and_draws_an_overlay(
    film, tmp_path, curling
):
    save_scene(scene(), tmp_path / "scene.json")
    done = curling(
        *("track", film, "--scene", tmp_path / "scene.json", "-o", tmp_path / "tracks.csv"),
        *("--overlay", tmp_path / "seen.mp4"),
    )
    assert done.status == 0, done.err
    (report,), (path,) = done.json(), read_tracks(tmp_path / "tracks.csv")
    truth = np.array([truth_at(t) for t in path.t])
    error = path.xy - truth[:, :2]
    assert report["tracked"] == len(path) >= 0.9 * report["frames"]
    assert np.sqrt(np.mean(np.sum(error**2, axis=1))) < 0.008
    assert 0 < np.median(path.sigma_xy) < 0.02
    assert path.t[0] < 0.5
    assert path.t * FPS == pytest.approx(np.rint(path.t * FPS), abs=1e-4)
    # The heading follows the handle without jumps.
    assert np.abs(np.diff(path.theta)).max() < 0.3
    assert np.sqrt(np.mean((path.theta - truth[:, 2]) ** 2)) < 0.1
    shown = [frame for _, frame in Film.open(tmp_path / "seen.mp4").frames()]
    plain = [frame for _, frame in Film.open(film).frames()]
    assert len(shown) == len(plain)
    assert np.abs(shown[36].astype(int) - plain[36]).max() > 100


def test_a_film_without_a_stone_ends_the_command_in_one_line(tmp_path, curling):
    path = draw_film(tmp_path / "empty.mp4", stone=False, frames=24)
    save_scene(scene(), tmp_path / "scene.json")
    output = tmp_path / "tracks.csv"
    refused = curling("track", path, "--scene", tmp_path / "scene.json", "-o", output)
    assert refused.status == 2
    (line,) = [text for text in refused.err.splitlines() if "curling:" in text]
    assert "empty.mp4: no thrown stone found" in line
    assert not output.exists()


@pytest.mark.parametrize(
    ("film_name", "scene_text", "complaint"),
    [
        ("missing.mp4", None, "no such film"),
        ("noise.mp4", None, "cannot be decoded; expected a film"),
        ("throw.mp4", "{", "not JSON"),
        ("throw.mp4", '{"points": []}', "four or more points"),
    ],
)
def test_bad_input_is_one_line(film, tmp_path, curling, film_name, scene_text, complaint):
    (tmp_path / "noise.mp4").write_bytes(b"\x00" * 500)
    path = film if film_name == "throw.mp4" else tmp_path / film_name
    save_scene(scene(), tmp_path / "scene.json")
    if scene_text is not None:
        (tmp_path / "scene.json").write_text(scene_text)
    output = tmp_path / "tracks.csv"
    refused = curling("track", path, "--scene", tmp_path / "scene.json", "-o", output)
    assert complaint in refused.complaint
    assert not output.exists()


def test_points_outside_the_image_end_the_command(film, tmp_path, curling):
    save_scene(scene(), tmp_path / "scene.json")
    document = json.loads((tmp_path / "scene.json").read_text())
    document["points"][0]["px"] = [900.0, 20.0]
    (tmp_path / "scene.json").write_text(json.dumps(document))
    assert load_scene(tmp_path / "scene.json").points_px[0, 0] == 900
    refused = curling("track", film, "--scene", tmp_path / "scene.json")
    assert "outside the image" in refused.complaint


CORNERS = {
    "home_left": [60, 250],
    "home_right": [420, 250],
    "away_left": [200, 40],
    "away_right": [290, 40],
}


@pytest.mark.parametrize(
    ("changes", "complaint"),
    [
        ({"home_left": [420, 250], "home_right": [60, 250]}, "corners cross"),
        ({"away_left": [240, 250], "away_right": [290, 40]}, "lie in a line"),
        ({"away_left": [200, -40]}, "outside the image"),
    ],
)
def test_corners_that_span_no_sheet_end_the_command_in_one_line(
    film, tmp_path, curling, changes, complaint
):
    path = tmp_path / "scene.json"
    path.write_text(json.dumps({"corners_px": CORNERS | changes}))
    output = tmp_path / "tracks.csv"
    assert complaint in curling("track", film, "--scene", path, "-o", output).complaint
    assert not output.exists()
