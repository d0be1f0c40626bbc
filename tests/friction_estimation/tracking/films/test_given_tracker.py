"""A tracker is given what it takes, and what was not thrown is refused."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import numpy as np
import pytest

from curling_env.errors import NoThrowError
from curling_env.trajectory import Trajectory
from curling_env.typing import no_progress
from friction_estimation.tracking.cutting.pieces import Piece
from friction_estimation.tracking.detection.thrown_stone import RoughPath, Sighting
from friction_estimation.tracking.films import given_tracker
from friction_estimation.tracking.films.given_tracker import GivenTracker

FILM = Path("film.mp4")
PART = Piece(path=FILM, film=FILM, begin=12.0, end=40.0)
T = np.arange(0.0, 12.0, 0.2)
MOTIONS = {
    "carried": -9 + 1.4 * T,
    "moved": -19 + 4 * (1 - (1 - T / 6).clip(0) ** 2),
    "thrown": -9 + 2.2 * T - 0.045 * T**2,
}


def track_at(y):
    return Trajectory(t=T, xy=np.column_stack([0 * y, y]))


def path_at(y, *, measured):
    places = np.column_stack([0 * y, y])
    return RoughPath(
        sightings=tuple(
            Sighting(frame=k, t=float(t), xy=xy, likeness=1.0)
            for k, (t, xy) in enumerate(zip(T, places, strict=True))
        ),
        measured=measured,
    )


@pytest.mark.parametrize(
    ("motion", "why"), [("carried", "keeps its pace"), ("moved", "stops before the hog line")]
)
def test_a_part_without_a_throw_is_refused_before_it_is_measured(motion, why, monkeypatch):
    measured = []

    def built_in(film, scene, *, progress, judged=lambda path: None):
        judged(path_at(MOTIONS[motion], measured=True))
        measured.append(film)
        return track_at(MOTIONS["thrown"])

    monkeypatch.setattr(given_tracker, "track_film", built_in)
    with pytest.raises(NoThrowError, match=why):
        GivenTracker(built_in).track(PART, None, None, no_progress)
    assert not measured
    # All of a film is what its user says it is.
    GivenTracker(built_in).track(Piece.whole(FILM), None, None, no_progress)
    assert measured == [FILM]


@pytest.mark.parametrize("motion", MOTIONS)
def test_the_track_decides_where_only_blobs_showed_the_way(motion, monkeypatch):
    def built_in(film, scene, *, progress, judged):
        judged(path_at(MOTIONS["carried"], measured=False))
        return track_at(MOTIONS[motion])

    monkeypatch.setattr(given_tracker, "track_film", built_in)
    if motion != "thrown":
        with pytest.raises(NoThrowError):
            GivenTracker(built_in).track(PART, None, None, no_progress)
    else:
        found = GivenTracker(built_in).track(PART, None, None, no_progress)
        assert found.summary["tracked"] == len(T)


def test_other_trackers_are_given_neither_cameras_nor_a_judge():
    def own(film, scene, *, progress, slow=1):
        return track_at(MOTIONS["thrown"])

    for tracker in (GivenTracker(own), GivenTracker(partial(own, slow=2))):
        assert not tracker.is_built_in
        assert not tracker.shares_cameras
        assert tracker.options is None
        assert len(tracker.track(PART, None, None, no_progress).tracks) == 1
    assert GivenTracker(own).identity != GivenTracker(partial(own, slow=2)).identity
