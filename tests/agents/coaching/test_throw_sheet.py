"""Table of throws with a coach's notes."""

from __future__ import annotations

import numpy as np
import pytest

from agents.coaching import ThrowSheet, read_call, sheet_rows, spin_sign
from curling_env.sheet import Direction
from curling_env.trajectory import Trajectory, write_tracks
from curling_env.units import Units, shown_in
from friction_estimation.tracks import Measured, ThrowMeasures, ThrowNote


def sheet(called="", hand="right", athlete="", throw=0, **numbers):
    measured = {name: Measured(*np.atleast_1d(value).tolist()) for name, value in numbers.items()}
    note = ThrowNote(athlete=athlete, called=called)
    return ThrowSheet(
        measures=ThrowMeasures(
            throw=throw, stone=0, clock=0.0, direction=Direction.AWAY, **measured
        ),
        note=note,
        call=read_call(called),
        hand=hand,
    )


DRAW = {
    "spin": -1.1,
    "line": (0.91, 0.02),
    "right": (-0.305, 0.01),
    "past": (0.61, 0.01),
    "from_tee": 0.7,
}


def test_a_left_handers_handle_is_the_other_one():
    assert sheet(**DRAW).handle == "in-turn"
    assert sheet(hand="left", **DRAW).handle == "out-turn"
    assert sheet(spin=0.01).handle is None
    assert sheet().handle is None
    assert [spin_sign("in-turn", hand) for hand in ("right", "left")] == [-1.0, 1.0]


def test_line_and_rest_are_compared_with_the_call():
    one = sheet("draw 0.1,-0.2 in broom 1.0", **DRAW)
    assert one.off_broom == (pytest.approx(-0.09), 0.02)
    right, past = one.miss
    assert right == (pytest.approx(-0.405), 0.01)
    assert past == (pytest.approx(0.81), 0.01)
    reported = sheet_rows([one, sheet(throw=1, **DRAW)])
    row = dict(zip(reported.head, reported.rows[0], strict=True))
    assert row["off the broom"] == "9 cm left"
    assert row["miss"] == "81 cm past, 40 cm left"
    assert dict(zip(reported.head, reported.rows[1], strict=True))["miss"] == "–"
    with shown_in(Units.FEET):
        missed = sheet_rows([one]).rows[0][reported.head.index("miss")]
    assert missed == "2 ft 8 in past, 1 ft 4 in left"


def test_a_hit_and_a_stone_that_was_not_seen_to_rest_miss_nothing():
    assert sheet("hit 0,1.2 normal", **DRAW).miss is None
    assert sheet("draw button").miss is None
    assert sheet("good one", **DRAW).miss is None


@pytest.fixture
def evening(tmp_path):
    """Return two straight throws that rest, with notes and hands in their folder."""
    t = np.arange(0, 26, 0.05)
    tracks = []
    for throw in range(2):
        along = np.where(t < 25, 2.2 * t - 0.044 * t**2, 2.2 * 25 - 0.044 * 25**2) - 12.0
        tracks.append(
            Trajectory(
                t=t, xy=np.column_stack([0.01 * t, along]), theta=-1.0 * t, throw=throw,
                sigma_xy=np.full(len(t), 0.003),
            )
        )  # fmt: skip
    write_tracks(tmp_path / "tracks.csv", tracks)
    (tmp_path / "throws.csv").write_text(
        "throw,athlete,called\n0,Ada,draw button in\n1,Bo,lovely weight\n", encoding="utf-8"
    )
    (tmp_path / "athletes.csv").write_text("athlete,hand\nBo,left\nAda,\n", encoding="utf-8")
    return tmp_path


def test_the_command(evening, curling):
    out = evening / "table.csv"
    done = curling("throws", evening / "tracks.csv", "-o", out)
    each = done.json()
    assert [one["handle"] for one in each] == ["in-turn", "out-turn"]
    assert each[0]["miss_past"] == pytest.approx(each[0]["past"])
    assert each[1]["miss_past"] is None
    assert "miss" in done.err
    header, first, second = out.read_text(encoding="utf-8").splitlines()
    assert {"handle", "miss_past_sigma", "athlete", "called"} <= set(header.split(","))
    assert "in-turn" in first
    assert "lovely weight" in second


def test_an_unknown_hand_is_refused(evening, curling):
    (evening / "athletes.csv").write_text("athlete,hand\nBo,both\n", encoding="utf-8")
    message = curling("throws", evening / "tracks.csv").complaint
    assert "athletes.csv" in message
    assert "row 2" in message
    assert "'both'" in message
