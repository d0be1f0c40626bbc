"""The joint tracker on a rendered film: a stone hits one of three, seen from above."""

from __future__ import annotations

import numpy as np
import pytest

from curling_env.errors import NoThrowError
from curling_env.ice import Ice
from curling_env.physics import Engine, StoneState
from curling_env.throw import Throw
from curling_env.typing import no_progress
from friction_estimation.synthetic import (
    HANDLE_COLOURS,
    FilmRenderer,
    FilmSpec,
    StoneOnIce,
    all_on_film,
    scene_of,
    write_film,
)
from friction_estimation.tracking.joint.tracker import track
from friction_estimation.tracking.tracker import load_tracker, tracks_in

FPS = 15.0
SPEC = FilmSpec(camera="gantry", people=False, size=(800, 450), fps=FPS, tail=0.5, seed=1)
PLACES = ((0.08, -6.0), (-1.0, 2.0), (0.5, -16.6))
"""Resting places at the beginning; the first stone is hit [m]."""
RESTS = (-0.23, -6.12)
"""Resting place of the thrown stone at the end [m]."""


@pytest.fixture(scope="module")
def film(tmp_path_factory):
    """A film, its scene, the truth of the two stones that move, and the time of their contact."""
    lying = [StoneState(x=x, y=y, theta=0.3 + k, stone=k + 1) for k, (x, y) in enumerate(PLACES)]
    played = Engine(Ice.uniform(0.02)).play(Throw(speed=2.0, spin=1.2).release(), lying, fps=240)
    *struck, thrown = played.trajectories
    resting = [
        StoneOnIce(x=s.x, y=s.y, theta=s.theta, colour=HANDLE_COLOURS[s.stone])
        for k, s in enumerate(lying)
        if k not in played.moved
    ]
    renderer = FilmRenderer(SPEC, resting=resting)
    path = tmp_path_factory.mktemp("joint") / "film.mp4"
    write_film(path, renderer.frames(thrown, others=struck, seed=1), FPS)
    moment = played.contacts[0].time + SPEC.lead_in
    return path, scene_of(renderer.camera), all_on_film([thrown, *struck], SPEC), moment


def knows_places(camera, sheet, model):
    """A finder that knows where stones rest in this film, and looks whether they are dark there."""

    def find(picture, boxes=None):
        places = [*PLACES[1:]] if boxes is None else []
        for place in (PLACES[0], RESTS):
            (u, v), *_ = np.rint(camera.project([[*place, model.height]])).astype(int)
            if np.median(picture[v - 1 : v + 2, u - 1 : u + 2]) < 180:
                places.append(place)
        return np.array(places).reshape(-1, 2), np.full(len(places), 4.0)

    return find


@pytest.fixture(scope="module")
def found(film):
    return track(film[0], film[1], finder=knows_places)


def errors(track, truth):
    """Distance from the truth in each row [m]."""
    there = [np.interp(track.t, truth.t, truth.xy[:, axis]) for axis in range(2)]
    return np.hypot(*(track.xy.T - there))


def test_every_stone_has_its_own_track(film, found):
    thrown, *others = found.trajectories
    assert errors(thrown, film[2][0]).max() < 0.03
    assert len(thrown) > 0.95 * len(film[2][0])
    assert [other.stone for other in others] == [1, 2, 3]
    on_rings, struck, beside = others
    for still, place in ((on_rings, PLACES[2]), (beside, PLACES[1])):
        assert len(still) == 2
        assert np.hypot(*(still.xy - place).T).max() < 0.02
    assert errors(struck, film[2][1]).max() < 0.03


def test_the_contact_is_found_to_a_hundredth_of_a_second_or_two(film, found):
    assert len(found.contacts) == 1
    assert found.contacts[0] == pytest.approx(film[3], abs=0.02)
    struck = found.others[1]
    assert struck.contacts == found.contacts
    assert struck.trajectory.t[0] == pytest.approx(film[3], abs=1.5 / FPS)


def test_standard_errors_and_headings_hold(film, found):
    for one, truth in zip((found, found.others[1]), film[2], strict=True):
        path = one.trajectory
        assert np.sqrt(np.mean(errors(path, truth) ** 2)) < 0.012
        assert np.sqrt(np.mean((errors(path, truth) / path.sigma_xy) ** 2 / 2)) < 1.5
        miss = np.angle(np.exp(1j * (path.theta - np.interp(path.t, truth.t, truth.theta))))
        assert np.isfinite(miss).mean() > 0.9
        assert np.nanmax(np.abs(miss)) < 0.6


def test_it_plugs_in(film):
    plugged = load_tracker("friction_estimation.tracking.joint.tracker:track")
    thrown, *_ = tracks_in(plugged(film[0], film[1], progress=no_progress), film[0])
    before = thrown.t < film[3] - 0.1
    assert before.sum() > 20
    assert np.median(errors(thrown, film[2][0])[before]) < 0.012


def test_a_film_without_a_throw_is_refused(tmp_path):
    renderer = FilmRenderer(SPEC)
    still = np.asarray(renderer.still, dtype=np.uint8)
    path = tmp_path / "empty.mp4"
    write_film(path, (still for _ in range(30)), FPS)
    with pytest.raises(NoThrowError, match="no thrown stone found"):
        track(path, scene_of(renderer.camera))
