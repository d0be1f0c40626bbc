"""Errors that are expected before anything is filmed are those that tracks report and have."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from curling_env.ice import load_ice
from curling_env.infrastructure.files.table import read_table
from curling_env.physics import slide
from curling_env.sheet import PAPER_SHEET
from curling_env.throw import Throw
from friction_estimation import load_scene, track_film
from friction_estimation.camera.expected import (
    PLACES,
    expected_camera,
    expected_errors,
    expected_of_scene,
)
from friction_estimation.synthetic import FilmSpec, named_camera, render_films, scene_of


def along(camera, **known):
    expected = expected_camera(camera, PAPER_SHEET, **{"lens_known": True, **known})
    return {error.place: error.along for error in expected_errors([expected])}


def test_a_film_has_the_errors_that_were_expected(tmp_path):
    name = "ceiling"  # the phone and the gallery are those that the constants were set on
    spec = FilmSpec(camera=name, size=(640, 360), fps=10.0, people=False, lead_in=0.2)
    thrown = slide(load_ice("standard"), Throw(speed=2.15, angle=-0.02, spin=1.5).release(), fps=60)
    in_view = thrown.trajectory.only(thrown.trajectory.xy[:, 1] > 8.0)
    in_view = replace(in_view, t=in_view.t - in_view.t[0])
    (film,) = render_films(tmp_path, [in_view], spec)
    camera = spec.resolved()
    path = track_film(film, load_scene(tmp_path / f"{name}.scene.json")).trajectory
    table = read_table(film.with_suffix(".truth.csv"), required=("t", "x", "y"))
    t, *xy = (table.numbers(name) for name in ("t", "x", "y"))
    off = path.xy - np.column_stack([np.interp(path.t, t, axis) for axis in xy])
    known = expected_camera(camera, PAPER_SHEET, lens_known=True, paint=0.0)
    sigmas, errors = list[float](), list[float]()
    for error in expected_errors([known]):
        near = np.abs(path.xy[:, 1] - PLACES[error.place]) < 0.8
        if error.along is None or not near.any():
            continue
        common = np.hypot(error.along, error.across) / np.sqrt(2)
        sigmas.append(np.median(path.sigma_xy[near]) / common)
        errors.append(np.sqrt(np.mean(off[near] ** 2)) / common)
    assert len(sigmas) >= 2
    assert 0.5 < np.median(sigmas) < 2.0
    assert np.median(errors) < 3.0


def test_height_pixels_and_what_is_known_each_lower_the_error():
    phone = named_camera("phone", (1920, 1080))
    usual = along(phone)
    raised = replace(phone, translation=phone.translation - phone.rotation @ [0.0, 0.0, 1.3])
    assert along(raised)["away tee"] < 0.7 * usual["away tee"]
    assert along(named_camera("phone", (3840, 2160)))["away tee"] < 0.8 * usual["away tee"]
    assert along(phone, paint=0.0)["away tee"] < 0.9 * usual["away tee"]
    ceiling = named_camera("ceiling", (1280, 960))
    unknown = along(ceiling, lens_known=False)["away hog line"]
    height = along(ceiling, lens_known=False, height_known=True)["away hog line"]
    assert along(ceiling)["away hog line"] < height < unknown


def test_joined_cameras_have_the_error_of_the_better_one_and_gaps_none():
    views = [named_camera(name, (1280, 720)) for name in ("ceiling", "ceiling_home")]
    known = [expected_camera(view, PAPER_SHEET, lens_known=True) for view in views]
    both, one = expected_errors(known), expected_errors(known[:1])
    assert [error.along is None for error in both] == [False, False, True, False, False, False]
    assert [error.along is None for error in one] == [True, True, True, False, False, False]
    assert both[-1] == one[-1]


def test_a_scene_tells_what_is_known_of_its_lens():
    camera = named_camera("ceiling", (1280, 720))
    scene = scene_of(camera)
    unknown = replace(scene, camera_matrix=None, distortion=None)
    measured, guessed = (expected_of_scene(k, camera)[3].along for k in (scene, unknown))
    assert measured is not None
    assert guessed is not None
    assert measured < guessed


def test_the_command_shows_errors_and_draws_the_view(curling, tmp_path):
    picture = tmp_path / "view.png"
    done = curling("place-camera", "gallery", "--size", "1280x720", "--picture", picture)
    expected = {error["place"]: error for error in done.json()["expected"]}
    assert 0.01 < expected["away tee"]["sigma_along_m"] < 0.05
    assert picture.stat().st_size > 10_000
    higher = curling("place-camera", "gallery", "--size", "1280x720", "--position", "1.5,-31,9")
    assert higher.json()["expected"][4]["sigma_along_m"] < expected["away tee"]["sigma_along_m"]


@pytest.mark.parametrize(
    ("words", "problem"),
    [
        (("attic",), "unknown camera 'attic'"),
        (("phone", "gallery", "--focal", "30"), "only one camera"),
        (("phone", "--position", "0,1"), "--position: expected three coordinates"),
        (("phone", "--position", "0,1,99"), "0.3 to 50 m above the ice"),
        (("phone", "--size", "1x1"), "--size: expected 64x48"),
    ],
)
def test_a_camera_that_cannot_be_is_refused_in_one_line(curling, words, problem):
    assert problem in curling("place-camera", *words).complaint
