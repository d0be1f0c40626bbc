"""Tracking with people around the stone, on a few seconds of rendered and of drawn film."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from curling_env.errors import InputError
from curling_env.trajectory import Trajectory
from friction_estimation import Scene
from friction_estimation.camera import Camera
from friction_estimation.synthetic import FilmSpec, Light, render_film, write_film
from friction_estimation.tracking import TrackingOptions, built_in, track_film
from friction_estimation.tracking.association import finding
from friction_estimation.tracking.association.finding import thrown_paths
from friction_estimation.tracking.measuring.looks import learn_look

FPS = 8.0
OUT_OF_HAND = 1.0
"""Time after which the thrower no longer hides the stone [s]."""
CAMERA = Camera.looking_at(
    position=(5.5, 10.5, 5.5),
    target=(-0.1, 10.5, 0.0),
    focal_px=300.0,
    size=(336, 190),
    distortion=(-0.06, 0.01, 0, 0, 0),
)


KNOWN = np.array([[-2.0, 9.0], [1.5, 9.0], [1.5, 12.5], [-2.0, 12.5], [0.0, 10.9725]])


def scene():
    return Scene(
        sheet_points=KNOWN,
        points_px=CAMERA.project(np.column_stack([KNOWN, np.zeros(len(KNOWN))])),
        camera_matrix=CAMERA.lens.matrix,
        distortion=CAMERA.lens.distortion,
        stone_radius=0.145,
        stone_height=0.1143,
    )


def throw():
    """A stone that slides for 4 s at draw weight, turns, and comes to rest."""
    t = np.arange(0, 4.0 + 1e-9, 1 / 60)
    y = 8.0 + 1.9 * t - 0.2375 * t**2
    xy = np.column_stack([-0.4 + 0.015 * t**2, y])
    return Trajectory(t=t, xy=xy, theta=0.3 + 1.2 * t - 0.15 * t**2)


@pytest.fixture(scope="module")
def film(tmp_path_factory):
    path = tmp_path_factory.mktemp("people") / "throw.mp4"
    spec = FilmSpec(
        camera=CAMERA, fps=FPS, people=True, lead_in=0.2, tail=0.4, light=Light(gloss=0.9), seed=4
    )
    return path, render_film(path, throw(), spec)


@pytest.fixture(scope="module")
def tracked(film):
    # Paint seen so coarsely moves the camera by a third of a pixel; people must not move the stone.
    path, truth = film
    stones = []

    def learn(stone, *given):
        stones.append(stone)
        return learn_look(stone, *given)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(built_in, "learn_look", learn)
        found = track_film(path, scene(), options=TrackingOptions(refine=False))
    return found, truth, stones


def test_people_shadows_and_reflections_do_not_move_the_stone(tracked):
    result, truth, _ = tracked
    path = result.trajectory
    error = path.xy - truth.xy[result.frame]
    seen = np.isin(np.flatnonzero(truth.t > OUT_OF_HAND), result.frame)
    assert seen.mean() >= 0.9
    # A pixel is 26 mm across and 40 mm along the line of sight here.
    assert np.sqrt(np.mean(np.sum(error**2, axis=1))) < 0.004


def test_speed_comes_from_the_smoother(tracked):
    result, *_ = tracked
    at = np.searchsorted(result.trajectory.t, 2.2)  # two seconds after the release
    assert result.velocity[at] == pytest.approx([0.06, 0.95], abs=0.03)
    assert result.trajectory.t == pytest.approx(result.frame / FPS, abs=1e-6)


def test_the_stone_is_followed_and_not_a_person(tracked):
    result, truth, _ = tracked
    away = np.linalg.norm(result.trajectory.xy - truth.xy[result.frame], axis=1)
    assert away.max() < 0.045


def test_a_person_whose_motion_is_more_likely_is_not_the_stone(film, tracked, monkeypatch):
    """The look of the person is refused; the next one is the stone that was tracked before."""
    (stone,) = tracked[2]
    tried = []

    class StoneTriedError(Exception):
        """The person was refused; from here on everything is as before."""

    def person_first(*given):
        stone, *_, person = thrown_paths(*given)
        return [person, stone]

    def learn(seen, *given):
        tried.append(seen)
        if len(tried) > 1:
            raise StoneTriedError
        return learn_look(seen, *given)

    monkeypatch.setattr(finding, "thrown_paths", person_first)
    monkeypatch.setattr(built_in, "learn_look", learn)
    with pytest.raises(StoneTriedError):
        track_film(film[0], scene(), options=TrackingOptions(refine=False))
    first, second = tried
    assert not np.array_equal(first.path.xy, stone.path.xy)
    assert np.array_equal(second.path.xy, stone.path.xy)
    assert np.array_equal(second.path.t, stone.path.t)


def test_people_without_a_stone_are_no_throw(tmp_path):
    path = tmp_path / "walk.mp4"
    spec = FilmSpec(camera=CAMERA, fps=FPS, people=True, lead_in=0.2, tail=0.0, seed=5)
    still = Trajectory(t=np.array([0.0, 2.0]), xy=np.full((2, 2), [0.0, -18.0]))
    render_film(path, still, spec)  # the stone lies out of the picture
    with pytest.raises(InputError, match=r"walk\.mp4: no thrown stone found"):
        track_film(path, scene())


ABOVE = Camera.looking_at(
    position=(0.3, 0.0, 9.0), target=(0.0, 0.1, 0.0), focal_px=420.0, size=(560, 300),
    up=(-1.0, 0.0, 0.0),
)  # fmt: skip
CORNERS = np.array([[-2.0, -5.0], [2.0, -5.0], [2.0, 5.0], [-2.0, 5.0], [0.0, 0.0]])


def place(t):
    """Place of a drawn stone that slows down and curls a little, (2,) [m]."""
    return np.array([0.1 - 0.004 * t**2, -4.0 + 1.5 * t - 0.05 * t**2])


def disc(picture, x, y, z, radius, colour):
    px = ABOVE.project(np.array([[x, y, z], [x + radius, y, z]]))
    centre = np.round(16 * px[0]).astype(int).tolist()
    size = round(16 * float(np.linalg.norm(px[1] - px[0])))
    cv2.circle(picture, centre, size, colour, -1, cv2.LINE_AA, 4)


def swept(t, clear_of_broom):
    """A frame of a stone without a handle; a broom touches it except within these times [s]."""
    picture = np.full((300, 560, 3), 225, dtype=np.uint8)
    cv2.line(picture, (0, 150), (559, 150), (120, 120, 120), 1)
    x, y = place(t)
    for z, radius, colour in ((0.0, 0.11, 70), (0.05, 0.145, 90), (0.114, 0.12, 125)):
        disc(picture, x, y, z, radius, (colour, colour, colour))
    begin, end = clear_of_broom
    broom = x + 0.09 * np.sin(15 * t), y + (0.6 if begin <= t <= end else 0.2)
    for side in (-0.08, 0.0, 0.08):
        disc(picture, broom[0] + side, broom[1], 0.02, 0.04, (40, 40, 40))
    ends = ABOVE.project(np.array([[*broom, 0.05], [x + 0.7, y + 0.4, 1.0]])).round()
    cv2.line(picture, *(tuple(map(int, end)) for end in ends), (40, 160, 200), 2, cv2.LINE_AA)
    disc(picture, x + 0.8, y + 0.4, 0.9, 0.24, (40, 60, 150))
    disc(picture, x + 0.7, y + 0.6, 1.2, 0.11, (60, 80, 110))
    noise = np.random.default_rng(round(1000 * t)).normal(0, 1.5, picture.shape)
    return np.clip(cv2.GaussianBlur(picture, (0, 0), 0.6) + noise, 0, 255).astype(np.uint8)


@pytest.mark.parametrize(("clear_of_broom", "until"), [((0.0, 1.6), 5.0), ((1.5, 2.1), 2.9)])
def test_a_stone_that_a_broom_touches_is_followed_all_its_way(tmp_path, clear_of_broom, until):
    """The broom leaves it alone for eight frames, or for three in the middle of its way."""
    frames = [swept(t, clear_of_broom) for t in np.arange(0.0, until, 0.2)]
    write_film(tmp_path / "film.mp4", frames, 5.0)
    scene = Scene(
        sheet_points=CORNERS,
        points_px=ABOVE.project(np.column_stack([CORNERS, np.zeros(5)])),
        camera_matrix=ABOVE.lens.matrix,
        distortion=ABOVE.lens.distortion,
        stone_radius=0.145,
        stone_height=0.114,
    )
    found = track_film(tmp_path / "film.mp4", scene, options=TrackingOptions(refine=False))
    track = found.trajectory
    assert len(track) >= len(frames) - 1
    off = np.linalg.norm(track.xy - np.array([place(t) for t in track.t]), axis=1)
    assert off.max() < 0.03  # a pixel is 21 mm
    assert not np.isfinite(track.theta).any()  # it has no handle
    assert found.others == ()
