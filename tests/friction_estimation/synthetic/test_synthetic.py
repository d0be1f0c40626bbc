"""Films of known ice agree with the geometry and the truth."""

from __future__ import annotations

import csv
import json

import cv2
import numpy as np
import pytest

from curling_env.errors import InputError, OutputError
from curling_env.sheet import (
    HOG_LINE_WIDTH,
    HOG_LINE_Y,
    LINE_WIDTH,
    PAPER_SHEET,
    RING_RADII,
    TEE_Y,
    WORLD_CURLING_SHEET,
)
from curling_env.trajectory import Trajectory
from friction_estimation import load_scene
from friction_estimation.camera import Camera, camera_from_scene
from friction_estimation.synthetic import (
    CAMERAS,
    Cast,
    FilmRenderer,
    FilmSpec,
    Palette,
    StoneOnIce,
    StoneShape,
    named_camera,
    on_film,
    render_film,
    render_films,
    scene_of,
)
from friction_estimation.synthetic.stone_drawing import stone_box

from .conftest import EVEN, PLACES_SEEN, above


def braked(
    speed: float = 2.0, deceleration: float = 0.08, stop: float | None = None, **given
) -> Trajectory:
    """A stone from the home hog line under a constant deceleration, slightly to the right."""
    stop = speed / deceleration if stop is None else stop
    t = np.append(np.arange(0.0, stop, 1 / 120), stop)
    way = speed * t - 0.5 * deceleration * t * t
    xy = np.column_stack([0.2 + 0.01 * way, -HOG_LINE_Y + way])
    return Trajectory(t=t, xy=xy, theta=0.3 + 0.9 * t, **given)


def small_camera(size: tuple[int, int] = (192, 108)) -> Camera:
    return named_camera("gantry", size)


# --- paint -------------------------------------------------------------------------------------


def painted(camera: Camera, sheet=PAPER_SHEET) -> np.ndarray:
    spec = FilmSpec(camera=camera, people=False, light=EVEN)
    return FilmRenderer(spec, sheet=sheet).still.astype(np.float64)


def darkness(picture: np.ndarray) -> np.ndarray:
    """Return the share of bare ice's green that the paint removes."""
    return 1.0 - picture[..., 1] / Palette().ice[1]


@pytest.mark.parametrize(("side", "offset"), [(1, 0.0), (-1, 0.0037), (1, -0.0161)])
def test_hog_lines_have_their_painted_place_and_width(side, offset):
    width, colour = HOG_LINE_WIDTH, Palette().hog_line
    y = side * (HOG_LINE_Y + width / 2)
    camera = above(1.0, y + offset)
    row = darkness(painted(camera))[100]
    assert row.sum() == pytest.approx(width * 100.0 * (1 - colour[1] / Palette().ice[1]), rel=0.005)
    centroid = (row * np.arange(len(row))).sum() / row.sum()
    expected = camera.project([[camera.position[0], y, 0.0]])[0, 0]
    assert centroid == pytest.approx(expected, abs=0.01)


def test_lines_thinner_than_a_pixel_keep_their_mean():
    camera = above(2.05, TEE_Y, height=12.0, focal_px=600.0)  # 50 px/m: 0.6 px
    row = darkness(painted(camera))[120, 130:190]  # between the rings and the sheet's edge
    assert row.sum() == pytest.approx(
        LINE_WIDTH * 50.0 * (1 - Palette().line[1] / Palette().ice[1]), rel=0.02
    )


def test_a_ring_has_its_radius_about_the_tee():
    camera = above(0.0, TEE_Y, height=6.0, focal_px=300.0)  # 50 px/m
    picture = painted(camera)
    inner = RING_RADII[2]
    blue, red = picture[..., 0], picture[..., 2]
    share = np.clip((red - blue) / (Palette().inner_ring[2] - Palette().inner_ring[0]), 0, 1)
    share[:, ~(np.abs(np.arange(320) - 160) < 45)] = 0
    # The button and the two lines are not red.
    expected = np.pi * (inner**2 - RING_RADII[3] ** 2) * 2500.0
    lines = 2 * 2 * (inner - RING_RADII[3]) * LINE_WIDTH * 2500.0
    assert share.sum() == pytest.approx(expected - lines, rel=0.01)
    v, u = np.mgrid[:240, :320]
    tee = camera.project([[0.0, TEE_Y, 0.0]])[0]
    assert (share * u).sum() / share.sum() == pytest.approx(tee[0], abs=0.02)
    assert (share * v).sum() / share.sum() == pytest.approx(tee[1], abs=0.02)


@pytest.mark.parametrize(("name", "x"), [("end", 0.7), ("side", -1.2)])
def test_hog_lines_cover_the_pixels_of_a_distorted_image_that_look_at_them(name, x):
    camera = named_camera(name, (960, 540))
    seen = darkness(painted(camera)) / (1 - Palette().hog_line[1] / Palette().ice[1])
    middle = camera.project([[x, -HOG_LINE_Y - HOG_LINE_WIDTH / 2, 0.0]])[0]
    left, top = np.round(middle).astype(int) - 3
    share = (np.arange(40) + 0.5) / 40 - 0.5
    for row in range(top, top + 7):
        for column in range(left, left + 7):
            u, v = np.meshgrid(column + share, row + share)
            y = np.abs(camera.on_plane(np.stack([u.ravel(), v.ravel()], axis=1))[:, 1])
            covered = ((y > HOG_LINE_Y) & (y < HOG_LINE_Y + HOG_LINE_WIDTH)).mean()
            assert seen[row, column] == pytest.approx(covered, abs=0.02)


def test_the_corners_of_either_sheet_are_where_the_ice_ends():
    for sheet in (PAPER_SHEET, WORLD_CURLING_SHEET):
        x, y = sheet.corners["away_right"]
        camera = above(x, y)
        picture = painted(camera, sheet)
        corner = camera.project([[x, y, 0.0]])[0]
        ice = (picture[..., 1] - Palette().bumper[1]) / (Palette().ice[1] - Palette().bumper[1])
        # Ice lies at smaller u (along the sheet) and smaller v (to its middle).
        u, v = (int(value) for value in corner)
        assert np.clip(ice[v - 8, u - 5 : u + 6], 0, 1).sum() == pytest.approx(
            corner[0] + 0.5 - (u - 5), abs=0.01
        )
        assert np.clip(ice[v - 5 : v + 6, u - 8], 0, 1).sum() == pytest.approx(
            corner[1] + 0.5 - (v - 5), abs=0.01
        )


# --- the truth ---------------------------------------------------------------------------------


def test_the_truth_is_the_path_at_the_frames_times():
    spec = FilmSpec(camera=small_camera(), fps=25.0, lead_in=0.5, tail=1.0)
    truth = on_film(braked(), spec)
    since = truth.t - 0.5
    way = np.where(
        since < 0, 2.0 * since, 2.0 * np.minimum(since, 25.0) - 0.04 * np.minimum(since, 25.0) ** 2
    )
    np.testing.assert_allclose(truth.xy[:, 1], -HOG_LINE_Y + way, atol=1e-6)
    np.testing.assert_allclose(truth.xy[:, 0], 0.2 + 0.01 * way, atol=1e-6)
    np.testing.assert_allclose(truth.theta, 0.3 + 0.9 * np.minimum(since, 25.0), atol=1e-6)
    assert truth.t[0] == 0
    assert len(truth) == 663  # the last at 26.48 s of 26.5


def test_a_heading_that_is_not_known_is_bridged():
    path = braked(stop=1.0)
    gaps = np.where((path.t > 0.3) & (path.t < 0.5), np.nan, path.theta)
    spec = FilmSpec(camera=small_camera(), lead_in=0)
    bridged = on_film(Trajectory(t=path.t, xy=path.xy, theta=gaps), spec)
    assert np.isfinite(bridged.theta).all()
    unknown = on_film(Trajectory(t=path.t, xy=path.xy), spec)
    assert (unknown.theta == 0).all()


def test_a_film_has_its_truth_and_its_scene_in_its_folder(tmp_path, must_fit):
    spec = FilmSpec(camera="gantry", size=(192, 108), fps=15, seed=3)
    throws = [braked(speed=1.0, stop=1.5, throw=k) for k in range(2)]
    films = render_films(tmp_path / "new" / "films", throws, spec, notes={"mu": 0.008})
    folder = tmp_path / "new" / "films"
    assert sorted(path.name for path in folder.iterdir()) == [
        "gantry-0.mp4",
        "gantry-0.truth.csv",
        "gantry-1.mp4",
        "gantry-1.truth.csv",
        "gantry.scene.json",
        "gantry.truth.json",
    ]
    truth = on_film(throws[0], spec)
    with (folder / "gantry-0.truth.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert list(rows[0]) == ["t", "x", "y", "theta"]
    np.testing.assert_allclose([float(row["y"]) for row in rows], truth.xy[:, 1], atol=1e-6)
    reader = cv2.VideoCapture(str(films[0]))
    assert int(reader.get(cv2.CAP_PROP_FRAME_COUNT)) == len(rows)
    assert reader.get(cv2.CAP_PROP_FPS) == 15
    must_fit(folder / "gantry.truth.json", "truth-1")
    must_fit(folder / "gantry.scene.json", "scene-1")
    reported = json.loads((folder / "gantry.truth.json").read_text())
    assert reported["mu"] == 0.008
    assert reported["throws"][1]["released_at_s"] == 0.5
    assert reported["throws"][1]["rested_at_s"] == 2.0


@pytest.mark.parametrize("name", list(CAMERAS))
def test_the_scene_file_gives_the_camera_back(name, tmp_path, must_fit):
    from friction_estimation.camera import save_scene

    camera = named_camera(name)
    save_scene(scene_of(camera), tmp_path / "scene.json")
    must_fit(tmp_path / "scene.json", "scene-1")
    scene = load_scene(tmp_path / "scene.json")
    assert scene.has_corners == (name in ("end", "gantry", "side"))
    again = camera_from_scene(scene, camera.size)
    near, far = PLACES_SEEN.get(name, (12.0, 17.0))
    points = [[0.3, near, 0.0], [-1.0, far, 0.11], [0.8, far, 0.15]]
    np.testing.assert_allclose(again.project(points), camera.project(points), atol=0.01)


def test_clicks_may_miss_by_some_pixels():
    camera = named_camera("end")
    exact = scene_of(camera)
    clicked = scene_of(camera, click_px=2.0, rng=np.random.default_rng(1))
    error = clicked.points_px - exact.points_px
    assert 0.3 < np.abs(error).mean() < 5


# --- frames ------------------------------------------------------------------------------------


def test_the_same_seed_gives_the_same_frames():
    throw = braked(stop=0.1)

    def film(seed):
        spec = FilmSpec(camera=small_camera(), lead_in=0.1, tail=0, seed=seed)
        return np.stack(list(FilmRenderer(spec).frames(throw)))

    first = film(5)
    np.testing.assert_array_equal(first, film(5))
    assert (first != film(6)).any()


def test_noise_has_the_requested_strength():
    spec = FilmSpec(camera=small_camera(), people=False, noise=3.0, light=EVEN, tail=0)
    renderer = FilmRenderer(spec)
    first, second = list(renderer.frames(braked(stop=0.1)))[:2]
    floor = np.s_[:30]
    assert np.std(first[floor] - renderer.still[floor].astype(float)) == pytest.approx(3, abs=0.1)
    assert np.std(first[floor] - second[floor].astype(float)) == pytest.approx(3 * 2**0.5, abs=0.2)


def test_only_moving_parts_change_and_leave_no_trace():
    beside = StoneOnIce(x=0.6, y=-10.0)
    spec = FilmSpec(
        camera=named_camera("gantry", (640, 360)),
        people=False,
        noise=0,
        light=EVEN,
        tail=0,
        fps=8.0,
    )
    renderer = FilmRenderer(spec, resting=[beside])
    shape = StoneShape()
    throw = braked(stop=2.0)
    truth = on_film(throw, spec)
    for picture, xy in zip(renderer.frames(throw), truth.xy, strict=True):
        box = stone_box(renderer.camera, shape, StoneOnIce(x=xy[0], y=xy[1]), reach=0.3)
        changed = (picture != renderer.still).any(axis=2)
        assert changed.any()
        changed[box.slices] = False
        assert not changed.any()


def test_a_stone_out_of_sight_is_not_drawn():
    spec = FilmSpec(camera="ceiling", size=(320, 240), people=False, noise=0, light=EVEN, tail=0)
    renderer = FilmRenderer(spec)
    picture = next(renderer.frames(braked(stop=0.1)))
    np.testing.assert_array_equal(picture, renderer.still)


@pytest.mark.parametrize("side", [1, -1])
def test_people_stay_beside_the_sheet_or_ahead_of_the_stone(side):
    path = braked()
    swept = ((path.t > 4) & (path.t < 10)).astype(float)
    path = Trajectory(t=path.t, xy=side * path.xy, theta=path.theta, swept=swept)
    truth = on_film(path, FilmSpec(camera=small_camera()))
    cast = Cast(truth, 0.5, PAPER_SHEET, np.random.default_rng(0))
    for k in range(0, len(truth), 7):
        people = cast.at(k)
        assert sorted(p.role for p in people) == ["sweeper"] * 2 + ["thrower"] + ["walker"] * 2
        for person in people:
            ahead = side * (person.position[1] - truth.xy[k, 1])
            match person.role:
                case "walker":
                    assert abs(person.position[0]) > PAPER_SHEET.width / 2
                case "sweeper":
                    assert ahead > 0.5
                    assert PAPER_SHEET.contains(person.position)
                case "thrower":
                    assert ahead < -0.3


def test_people_are_seen():
    with_people = FilmSpec(camera="side", size=(480, 270), noise=0, light=EVEN, tail=0)
    renderer = FilmRenderer(with_people)
    picture = next(renderer.frames(braked(stop=0.1)))
    changed = (picture != renderer.still).any(axis=2)
    assert changed.sum() > 300


# --- what cannot be filmed ---------------------------------------------------------------------


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"camera": "drone"}, "unknown camera 'drone'; expected one of end, gantry, side, ceiling"),
        ({"fps": 0.0}, "frames per second"),
        ({"noise": -1.0}, "noise"),
        ({"tail": float("nan")}, "tail"),
        ({"exposure": 0.5}, "exposure"),
        ({"size": (10, 10)}, "64 × 48"),
        ({"seed": -1}, "seed"),
    ],
)
def test_a_film_that_cannot_be_taken_is_refused(given, message):
    with pytest.raises(InputError, match=message):
        FilmSpec(**given)


def test_no_throws_make_no_film(tmp_path):
    with pytest.raises(InputError, match="no throws"):
        render_films(tmp_path / "films", [], FilmSpec())
    assert not (tmp_path / "films").exists()


def test_a_film_that_breaks_off_leaves_nothing(tmp_path):
    spec = FilmSpec(camera=small_camera(), people=False)

    def broken(what, done, total=1.0):
        if done:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        render_film(tmp_path / "film.mp4", braked(stop=0.5), spec, progress=broken)
    assert list(tmp_path.iterdir()) == []
    with pytest.raises(OutputError, match="no directory"):
        render_film(tmp_path / "missing" / "film.mp4", braked(stop=0.5), spec)
