"""A session from files that are there, and the made-up evening."""

from __future__ import annotations

import numpy as np
import pytest

from agents.app import Hand, is_in
from agents.app.take_in import take_in
from curling_env.errors import InputError
from curling_env.ice import load_ice, save_ice
from curling_env.sheet import PAPER_SHEET, RULE_BOOK_STONE
from curling_env.trajectory import Trajectory, read_tracks, write_tracks
from friction_estimation.camera import save_scene
from friction_estimation.synthetic import FilmSpec, scene_of


@pytest.fixture
def folder(tmp_path):
    made = tmp_path / "evening"
    made.mkdir()
    t = np.linspace(0.0, 20.0, 60)
    tracks = [
        Trajectory(
            t=t,
            xy=np.column_stack([0 * t, 17 - 27 * (1 - t / 20) ** 2]),
            throw=number,
            stone=number % 3,
            clock=60.0 * number,
        )
        for number in (2, 3, 5)
    ]
    write_tracks(made / "tracks.csv", tracks)
    (made / "throws.csv").write_text("throw,athlete,stone,called\n3,Ben,red 1,draw in\n5,Ben,,\n")
    (made / "athletes.csv").write_text("athlete,hand\nBen,left\n")
    return made


def test_everything_that_is_noted_comes_along(club, folder):
    save_ice(load_ice("standard"), folder / "ice.json")
    session = take_in(club, folder, name="evening", day="2026-11-20", sheet="2")
    throws = club.throws(session)
    assert [one.called for one in throws] == ["", "draw in", ""]
    (ben,) = club.athletes()
    assert (ben.name, ben.hand) == ("Ben", Hand.LEFT)
    assert [one.athlete_id for one in throws] == [None, ben.id, ben.id]
    tracks = read_tracks(club.tracks_of(session))
    assert [(one.throw, one.stone, one.clock) for one in tracks] == [
        (0, 2, 120.0),
        (1, 0, 180.0),
        (2, 2, 300.0),
    ]
    assert load_ice(club.ice_of(session)).friction.mu.shape == (89, 9)


def test_a_folder_without_tracks_adds_nothing(club, tmp_path):
    with pytest.raises(InputError, match=r"tracks\.csv"):
        take_in(club, tmp_path, name="x", day="2026-11-20", sheet="2")
    assert club.sessions() == []


def test_what_was_taken_in_is_known_again_until_it_changes(club, folder):
    assert not is_in(club, folder)
    take_in(club, folder, name="evening", day="2026-11-20", sheet="2")
    assert is_in(club, folder)
    write_tracks(folder / "tracks.csv", read_tracks(folder / "tracks.csv")[:2])
    assert not is_in(club, folder)


def test_films_that_are_named_for_their_throws_come_along(club, folder):
    films = folder / "films"
    films.mkdir()
    for number in (3, 9):
        (films / f"gantry-{number}.mp4").write_bytes(b"film %d" % number)
    spec = FilmSpec(camera="gantry", size=(640, 360))
    save_scene(
        scene_of(spec.resolved(), sheet=PAPER_SHEET, stone=RULE_BOOK_STONE),
        films / "gantry.scene.json",
    )
    session = take_in(club, folder, name="evening", day="2026-11-20", sheet="2")
    (film,) = club.films(session)
    assert club.path(film.file).read_bytes() == b"film 3"
    assert club.camera(session.camera_id).scene is not None
    # Throw 3 of the folder is the one on film; what was noted of it stands with it.
    shown = next(one for one in club.throws(session) if one.film_id == film.id)
    assert shown.called == "draw in"
    assert (shown.clock, film.clock) == (0.0, 180.0)
    tracks = read_tracks(club.tracks_of(session))
    assert [(one.throw, one.clock) for one in tracks] == [(0, 120.0), (1, 180.0), (2, 300.0)]
    assert shown.number == 1
