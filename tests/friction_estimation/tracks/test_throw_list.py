"""A coach's notes in the folder of the tracks."""

from __future__ import annotations

import numpy as np
import pytest

from curling_env.errors import InputError
from curling_env.trajectory import Trajectory, write_tracks
from friction_estimation.tracks import ThrowNote, load_tracks, throws_beside


@pytest.fixture
def tracks(tmp_path):
    t = np.arange(3.0)
    path = tmp_path / "tracks.csv"
    labels = [(0, 0), (1, 0), (1, 4), (2, 1)]
    made = [Trajectory(t=t, xy=np.column_stack([t, t]), throw=k, stone=n) for k, n in labels]
    write_tracks(path, made)
    return path


def write(tracks, text):
    tracks.with_name("throws.csv").write_text(text, encoding="utf-8")


def numbers(tracks):
    return [(k.throw, k.stone) for k in load_tracks(tracks)]


def test_without_a_table_tracks_are_as_they_are(tracks):
    assert throws_beside(tracks) == {}
    assert numbers(tracks) == [(0, 0), (1, 0), (1, 4), (2, 1)]


def test_a_link_that_points_at_itself_is_refused(tracks):
    tracks.with_name("throws.csv").symlink_to("throws.csv")
    with pytest.raises(InputError, match=r"throws\.csv: cannot be read: too many levels"):
        throws_beside(tracks)


def test_rows_are_throws_in_order_of_play_and_need_not_have_every_column(tracks):
    write(tracks, "athlete,called\nNiklas,draw\nÖsten,\n")
    notes = throws_beside(tracks)
    assert notes == {0: ThrowNote(athlete="Niklas", called="draw"), 1: ThrowNote(athlete="Östen")}
    assert notes[1].row == {"athlete": "Östen"}
    assert numbers(tracks) == [(0, 0), (1, 0), (1, 4), (2, 1)]


def test_noted_stones_replace_those_assigned_by_colour(tracks):
    write(tracks, "throw,stone,note\n2,7,\n1,4,hog line\n")
    # Throw 1 was the stone that was taken for another one beside it: the two change places.
    assert numbers(tracks) == [(0, 0), (1, 4), (1, 0), (2, 7)]


def test_stones_with_names_are_numbered_in_order_of_play(tracks):
    write(tracks, "athlete,stone\na,red 2\nb,yellow 1\nc,red 2\n")
    assert numbers(tracks) == [(0, 0), (1, 1), (1, 4), (2, 0)]


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("throw,athlete\n0,a\n0,b\n", r"throws\.csv, row 3, column throw: throw 0 appears twice"),
        ("throw,weather\n0,a\n", r"throws\.csv, row 1: has none of the columns athlete, stone"),
        ("throw,athlete\nfirst,a\n", r"throws\.csv, row 2, column throw: expected a number"),
        ("athlet\nx\n", r"throws\.csv, row 1: unknown column .athlet.; did you mean athlete"),
    ],
)
def test_a_table_that_cannot_be_meant_is_refused(tracks, text, complaint):
    write(tracks, text)
    with pytest.raises(InputError, match=complaint):
        load_tracks(tracks)
