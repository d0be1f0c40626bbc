"""Films with other stones on the sheet: each keeps its number, and is followed if it is hit.

The tracker knows the film and the scene file only; the truth comes from the engine that simulated
the throw.
"""

from __future__ import annotations

import numpy as np
import pytest

from curling_env.ice import Ice
from curling_env.physics import Engine, StoneState
from curling_env.throw import Throw
from curling_env.trajectory import read_tracks
from friction_estimation import estimate_ice, tracking
from friction_estimation.camera import save_scene
from friction_estimation.synthetic import (
    HANDLE_COLOURS,
    FilmRenderer,
    FilmSpec,
    StoneOnIce,
    all_on_film,
    scene_of,
    write_film,
)
from friction_estimation.tracking import track_film
from friction_estimation.tracking.detection.detector import DetectedPlace, StoneFinder
from friction_estimation.tracks import free_slides

MU = 0.02
"""Slow ice, so that films are short."""


def filmed(folder, camera, size, throw, stones, *, people=False, fps=15.0):
    """A film of a throw among stones (x, y, theta, number), its scene, and the truth.

    Returns
    -------
    film, scene, {number: truth} of the stones that moved, times of the contacts [s]
    """
    lying = [StoneState(x=x, y=y, theta=theta, stone=k) for x, y, theta, k in stones]
    outcome = Engine(Ice.uniform(MU)).play(throw.release(), lying, fps=240)
    *struck, thrown = outcome.trajectories
    spec = FilmSpec(camera=camera, size=size, people=people, fps=fps, tail=0.5)
    resting = [
        StoneOnIce(x=s.x, y=s.y, theta=s.theta, colour=HANDLE_COLOURS[s.stone])
        for k, s in enumerate(lying)
        if k not in outcome.moved
    ]
    renderer = FilmRenderer(spec, resting=resting)
    film = folder / "film.mp4"
    write_film(film, renderer.frames(thrown, others=struck, seed=1), fps)
    truth = all_on_film([thrown, *struck], spec)
    moments = [contact.time + spec.lead_in for contact in outcome.contacts]
    return film, scene_of(renderer.camera), {path.stone: path for path in truth}, moments


def errors(track, truth):
    """Distance from the truth in each row [m]."""
    there = [np.interp(track.t, truth.t, truth.xy[:, axis]) for axis in range(2)]
    return np.hypot(*(track.xy.T - there))


@pytest.fixture(scope="module")
def hit(tmp_path_factory):
    """A stone that is hit so that both go on, one beside them and one on the rings; from above."""
    stones = [(0.08, -6.0, 0.3, 1), (-1.0, 2.0, 2.0, 2), (0.5, -16.6, 1.0, 3)]
    folder = tmp_path_factory.mktemp("hit")
    film, scene, truth, moments = filmed(
        folder, "gantry", (800, 450), Throw(speed=2.0, spin=1.2), stones
    )
    save_scene(scene, folder / "scene.json")
    return film, scene, truth, moments, track_film(film, scene)


def test_every_stone_keeps_its_number(hit):
    _, _, truth, _, found = hit
    assert [track.stone for track in found.trajectories] == [0, 1, 2, 3]
    thrown, on_rings, struck, beside = found.trajectories
    for still, place in ((on_rings, [0.5, -16.6]), (beside, [-1.0, 2.0])):
        assert len(still) == 2
        assert still.t[0] == 0.0
        assert still.t[-1] == pytest.approx(truth[0].t[-1])
        assert np.hypot(*(still.xy - place).T).max() < 0.012
    assert found.unexplained == ()
    # Not once nearer to another stone's place than a quarter of a stone.
    assert errors(thrown, truth[0]).max() < 0.03
    assert errors(struck, truth[1]).max() < 0.03
    assert len(thrown) > 0.95 * len(truth[0])


def test_places_are_right_before_and_after_the_contact(hit):
    _, _, truth, moments, found = hit
    (moment,) = found.contacts
    assert moment == pytest.approx(moments[0], abs=0.02)
    thrown, _, struck, _ = found.trajectories
    assert struck.t[0] == pytest.approx(moments[0], abs=1.5 / 15)
    assert np.sqrt(np.mean(errors(struck, truth[1]) ** 2)) < 0.012
    assert np.sqrt(np.mean(errors(thrown, truth[0]) ** 2)) < 0.012
    # A smoother that ran across the contact would round it off: 1.1 m/s are lost within a frame.
    about = np.abs(thrown.t - moments[0]) < 0.25
    assert about.sum() > 6
    assert errors(thrown, truth[0])[about].max() < 0.02


def test_headings_hold_until_the_stones_rest(hit):
    """Fits that lose the handle after the contact do not lead the heading away."""
    *_, truth, _, found = hit
    for track, path in ((found.trajectories[0], truth[0]), (found.trajectories[2], truth[1])):
        miss = np.angle(np.exp(1j * (track.theta - np.interp(track.t, path.t, path.theta))))
        assert np.isfinite(miss).mean() > 0.95
        assert np.nanmax(np.abs(miss)) < 0.45
        assert np.sqrt(np.nanmean((miss / track.sigma_theta) ** 2)) < 1.3
        assert np.nanmax(np.abs(miss) / track.sigma_theta) < 3.5


def test_friction_is_estimated_on_either_side_of_the_contact(hit):
    """From the slide before it and that of the hit stone; a fit across it would be far off."""
    thrown = hit[-1].trajectory
    found = estimate_ice(list(hit[-1].trajectories), uniform=True)
    assert found.ice.friction.mu.mean() == pytest.approx(MU, rel=0.02)
    assert not found.skipped
    slides, _ = free_slides(list(hit[-1].trajectories))
    assert {slide.track.stone for slide in slides} == {0, 2}
    for slide in slides[:-1]:
        side = thrown.t[slide.rows] < hit[-1].contacts[0]
        assert side.all() or not side.any()


def test_the_tracks_file_tells_the_stones_apart(hit, tmp_path, curling, monkeypatch):
    film = hit[0]
    monkeypatch.setattr(tracking, "track_film", lambda *_, **__: hit[-1])
    output = tmp_path / "tracks.csv"
    result = curling("track", film, "--scene", film.with_name("scene.json"), "-o", output)
    assert result.status == 0, result.err
    (about,) = result.json()
    assert [other["struck"] for other in about["others"]] == [False, True, False]
    colours = [about["handle"], *(other["handle"] for other in about["others"])]
    assert len(set(colours)) == 4
    tracks = read_tracks(output)
    assert [(track.throw, track.stone) for track in tracks] == [(0, 0), (0, 1), (0, 2), (0, 3)]
    assert [len(track) for track in tracks] == [len(t) for t in hit[-1].trajectories]


@pytest.mark.slow
def test_no_other_stones_are_found_where_there_are_none(tmp_path):
    """People stand and walk on the ice; those who stand still are part of the background."""
    film, scene, truth, _ = filmed(
        tmp_path, "gantry", (960, 540), Throw(speed=1.3, spin=1.2), [], people=True, fps=8.0
    )
    found = track_film(film, scene)
    assert found.others == ()
    assert found.unexplained == ()
    assert errors(found.trajectory, truth[0]).max() < 0.06


def test_paint_that_the_stone_slides_through_is_no_stone(hit, monkeypatch):
    """A detection on the way of the thrown stone, in every frame, is contradicted by its track."""
    film, scene, truth, *_ = hit
    row = np.abs(truth[0].xy[:, 1] + 9.0).argmin()
    paint = truth[0].xy[row]
    detect = StoneFinder.detect

    def place(finder):
        return DetectedPlace(
            xy=paint,
            covariance=1e-4 * np.eye(2),
            px=finder.camera.project(np.array([[*paint, 0.0]]))[0],
            score=0.9,
            person=0.0,
            in_play=True,
        )

    def with_paint(finder, picture, boxes=None):
        return [place(finder), *detect(finder, picture, boxes)]

    monkeypatch.setattr(StoneFinder, "detect", with_paint)
    others = track_film(film, scene).others
    assert len(others) == 3
    assert all(np.linalg.norm(other.trajectory.xy[0] - paint) > 0.3 for other in others)
