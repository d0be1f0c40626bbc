"""A session from files that are there, and the made-up evening."""

from __future__ import annotations

import numpy as np
import pytest

from agents.app.club.records import Hand
from agents.app.take_in import take_in
from curling_env.errors import InputError
from curling_env.ice import load_ice, save_ice
from curling_env.trajectory import Trajectory, read_tracks, write_tracks


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
