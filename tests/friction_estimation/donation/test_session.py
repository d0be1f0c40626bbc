"""A donated session: read as written, robust against untrusted files."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from curling_env.errors import InputError
from curling_env.sheet import PAPER_SHEET
from curling_env.trajectory import Trajectory
from friction_estimation import Scene
from friction_estimation.donation import Session, ThrownBy, read_session, write_session

CORNERS = np.array(list(PAPER_SHEET.corners.values()))
SCENE = Scene(sheet_points=CORNERS, points_px=np.array([[5.0, 115], [55, 115], [15, 5], [45, 5]]))
CONSENT = "All who threw agree to publication."


def a_track(throw: int, clock: float, **others: Any) -> Trajectory:
    t = np.arange(4) / 30
    xy = np.column_stack([0.01 * t, -10.0 + 2.0 * t])
    return Trajectory(t=np.round(t, 6), xy=np.round(xy, 5), throw=throw, clock=clock, **others)


@pytest.fixture
def session() -> Session:
    headed = a_track(0, 7000.0, theta=np.array([0.0, np.nan, 0.1, 0.2]), stone=3)
    unsure = a_track(4, 7050.5, sigma_xy=np.full(4, 0.004), swept=np.array([0.0, 1, 1, 0]))
    return Session(
        consent=CONSENT,
        scene=SCENE,
        tracks=[headed, replace(unsure, sigma_theta=np.full(4, 0.01))],
        throws=[ThrownBy(throw=0, athlete=0, hand="left", called="draw button"), ThrownBy(throw=4)],
    )


def test_the_read_session_equals_the_written_one(session: Session, tmp_path: Path) -> None:
    path = tmp_path / "s.json"
    write_session(session, path)
    found = read_session(path)
    assert found.consent == CONSENT
    assert found.licence == "CC0-1.0"
    assert list(found.throws) == list(session.throws)
    assert np.array_equal(found.scene.points_px, SCENE.points_px)
    first, second = found.tracks
    assert [first.throw, first.stone, second.throw] == [0, 3, 4]
    assert np.array_equal(first.xy, session.tracks[0].xy)
    assert np.array_equal(first.theta, session.tracks[0].theta, equal_nan=True)
    assert np.array_equal(second.swept, [0, 1, 1, 0])
    assert np.array_equal(second.sigma_xy, session.tracks[1].sigma_xy)
    assert [first.clock, second.clock] == [0.0, 50.5]  # not the time of day


def test_the_same_session_gives_the_same_bytes(session: Session, tmp_path: Path) -> None:
    write_session(session, tmp_path / "a.json")
    write_session(read_session(tmp_path / "a.json"), tmp_path / "b.json")
    assert (tmp_path / "a.json").read_bytes() == (tmp_path / "b.json").read_bytes()


@pytest.mark.parametrize("consent", ["yes", "x" * 1001, "All who threw\nagree to publication."])
def test_an_empty_consent_is_refused(consent: str) -> None:
    with pytest.raises(InputError, match="consent"):
        Session(consent=consent, scene=SCENE, tracks=[a_track(0, 0.0)])


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            lambda d: d.update(format="curling-session/2"),
            "of format 'curling-session/1' or earlier",
        ),
        (lambda d: d.update(athletes=["Ada"]), "unknown key athletes"),
        (lambda d: d["tracks"]["x"].pop(), "tracks.x"),
        (lambda d: d["tracks"]["t"].__setitem__(2, 0.0), "time must increase"),
        (lambda d: d["tracks"]["y"].__setitem__(1, None), "an empty cell"),
        (lambda d: d["tracks"]["y"].__setitem__(1, 1e9), "from -1e+06"),
        (lambda d: d["tracks"].update(note=["x"]), "unknown key note"),
        (lambda d: d["tracks"]["throw"].__setitem__(0, "Ada"), "a number"),
        (lambda d: d["throws"][0].update(athlete="Ada"), "a whole number"),
        (lambda d: d.update(scene={}), "scene"),
        (lambda d: d.pop("consent"), "missing consent"),
        (lambda d: d["tracks"].update({k: [] for k in d["tracks"]}), "no rows"),
    ],
)
def test_an_invalid_session_is_refused_with_the_place(
    session: Session, tmp_path: Path, change, message: str
) -> None:
    path = tmp_path / "s.json"
    write_session(session, path)
    document = json.loads(path.read_text())
    change(document)
    path.write_text(json.dumps(document))
    with pytest.raises(InputError) as error:
        read_session(path)
    assert message in str(error.value)
    assert "s.json" in str(error.value)
