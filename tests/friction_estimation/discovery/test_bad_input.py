"""Sessions that are poor, mixed up or broken: a useful answer, or one clear line."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from curling_env.errors import InputError
from curling_env.ice import Ice
from curling_env.trajectory import write_tracks
from friction_estimation import discover
from friction_estimation.discovery import document, open_session, remarks

from .conftest import effect

CURL = effect("curl", strength=0.006)
ONE_WAY = "All throws went one way"
ONE_SPIN = "All stones turned the same way"
OTHER_ICE = "check that it is of this ice and this sheet"


def text_of(found):
    """All that the report remarks, in one text."""
    return " ".join(remarks(found))


def names(found):
    return [e["name"] for e in document(found)["effects"]]


def test_one_direction_only_is_reported(make_session):
    tracks = [track for track in make_session([CURL], throws=20, fps=8) if track.throw % 2 == 0]
    found = discover(tracks)
    assert names(found) == ["curl"]
    assert ONE_WAY in text_of(found)


def test_no_variety_of_spin_is_reported(make_session):
    tracks = [t for t in make_session([CURL], throws=24, fps=8) if t.theta[-1] > t.theta[0]]
    assert len(tracks) >= 8
    found = discover(tracks)
    assert ONE_SPIN in text_of(found)
    assert set(names(found)) <= {"curl", "slope", "unknown"}
    named = [e for e in document(found)["effects"] if e["name"] in ("curl", "slope")]
    # Both directions were played: a slope keeps its side of the sheet, curl does not.
    assert [e["name"] for e in named] == ["curl"]


def test_throws_that_turned_unseen_leave_where_enough_are_left(make_session):
    tracks = make_session([CURL], throws=12)
    for k in (1, 5, 8):
        tracks[k] = replace(tracks[k], theta=np.full(len(tracks[k]), np.nan))
    session = open_session(tracks)
    assert session.throws.tolist() == [k for k in range(12) if k not in (1, 5, 8)]
    assert [reason.partition(":")[0] for reason in session.left_out] == [
        "throw 1",
        "throw 5",
        "throw 8",
    ]
    assert len(open_session(tracks[:9])) == 9  # six with a heading would be too few


def test_a_good_session_says_neither(make_session):
    words = text_of(discover(make_session(throws=8, fps=8)))
    assert ONE_WAY not in words
    assert ONE_SPIN not in words


def test_one_throw_of_rubbish_leaves_and_the_rest_is_searched(make_session, rng):
    tracks = make_session([CURL], fps=8)
    rubbish = rng.uniform(-1.5, 1.5, (len(tracks[5]), 2)) + np.array([0.0, 3.0])
    tracks[5] = replace(tracks[5], xy=rubbish)
    found = discover(tracks)
    assert names(found) == ["curl"]
    assert 5 not in found.session.throws
    assert any("throw 5" in reason for reason in found.session.left_out)


def test_tracks_of_the_next_sheet_leave(make_session):
    tracks = make_session([CURL], throws=16, fps=8)
    for k in (1, 6, 9):
        tracks[k] = replace(tracks[k], xy=tracks[k].xy + np.array([5.0, 0.0]))
    found = discover(tracks)
    assert names(found) == ["curl"]
    assert sum("check its scene and sheet" in reason for reason in found.session.left_out) == 3


def test_two_sheets_in_one_frame_are_not_an_effect(make_session):
    one = make_session(throws=16, seed=3, fps=8)
    other = make_session(throws=16, seed=3, mu=0.0102, fps=8)
    rng = np.random.default_rng(5)
    tracks = [other[k] if rng.random() < 0.5 else one[k] for k in range(16)]
    found = discover(tracks)
    assert set(names(found)) <= {"unknown"}
    assert found.final.model.spread > 0.03


def test_nothing_on_the_sheet_is_one_line(curling, make_session, tmp_path):
    tracks = [replace(t, xy=t.xy + np.array([0.0, 60.0])) for t in make_session(throws=2)]
    write_tracks(tmp_path / "tracks.csv", tracks)
    result = curling("discover", tmp_path / "tracks.csv", "-o", tmp_path / "found")
    assert "no throw lies on the sheet" in result.complaint
    assert not (tmp_path / "found" / "report.json").exists()
    with pytest.raises(InputError, match="check its scene"):
        open_session(tracks)


def test_a_base_ice_of_other_ice_is_reported(make_session, rng):
    plain = Ice.uniform(0.02)
    mu = plain.friction.mu * np.exp(rng.normal(0, 0.3, plain.friction.mu.shape))
    wrong = replace(plain, friction=replace(plain.friction, mu=mu))
    tracks = make_session(throws=6)  # too few to name anything, but enough to report this
    found = discover(tracks, wrong)
    assert OTHER_ICE in text_of(found)
    assert OTHER_ICE not in text_of(discover(tracks, plain))
