"""The table of throws reads as a coach says it."""

from __future__ import annotations

import numpy as np
import pytest

from curling_env.infrastructure import read_table
from curling_env.sheet import Direction
from curling_env.trajectory import write_tracks
from curling_env.units import Units
from friction_estimation.reports import (
    as_text,
    curl_in_words,
    handle_of,
    throw_in_words,
    throw_rows,
    write_measures,
)
from friction_estimation.reports.throws_section import ThrowRows, rest_of, throws_section
from friction_estimation.tracks import Measured, ThrowMeasures, ThrowNote


def thrown(throw=0, **numbers):
    measured = {name: Measured(*np.atleast_1d(value).tolist()) for name, value in numbers.items()}
    return ThrowMeasures(throw=throw, stone=0, clock=0.0, direction=Direction.AWAY, **measured)


DRAW = thrown(
    hog_to_hog=(14.234, 0.003), back_to_hog=(3.61, 0.05), speed=(2.13, 0.003), spin=-1.1,
    turns=3.24, line=(0.91, 0.02), curl=(-1.22, 0.03), right=-0.305, past=0.61, from_tee=0.68,
)  # fmt: skip


def test_a_draw_reads_as_it_is_called():
    shown = throw_rows([DRAW])
    assert dict(zip(shown.head, shown.rows[0], strict=True)) == {
        "throw": "0",
        "back to hog": "3.6 s",
        "hog to hog": "14.23 s",
        "speed": "2.13 m/s",
        "handle": "in-turn ↻",
        "turns": "3.2",
        "line": "91 cm right ± 2 cm",
        "curl": "1.22 m right ± 3 cm",
        "rest": "61 cm past, 30 cm left",
    }


def test_the_same_in_feet():
    shown = throw_rows([DRAW], Units.FEET, errors=False)
    row = dict(zip(shown.head, shown.rows[0], strict=True))
    assert row["curl"] == "4 ft 0 in right"
    assert row["rest"] == "2 ft 0 in past, 1 ft 0 in left"
    assert row["speed"] == "7.0 ft/s"


@pytest.mark.parametrize(
    ("right", "past", "shown"),
    [
        (0.0, 0.0, "on the pin"),
        (0.0, -6.5, "hogged: 6.50 m short of the tee, on the centre line"),
        (-1.0, 3.0, "through the house: 3.00 m past the tee, 1.00 m left"),
        (0.5, 0.001, "on the tee line, 50 cm right"),
    ],
)
def test_places_of_rest(right, past, shown):
    assert rest_of(thrown(right=right, past=past, from_tee=float(np.hypot(right, past)))) == shown


def test_a_throw_in_a_sentence():
    assert throw_in_words(DRAW) == (
        "split 3.6 s, 14.23 s hog to hog, in-turn ↻, curl 1.22 m right, "
        "rests 61 cm past the tee, 30 cm left"
    )
    assert throw_in_words(thrown(speed=2.0), Units.FEET) == "6.6 ft/s at the hog line"
    assert throw_in_words(thrown()) == ""


def test_handles_are_a_right_handers():
    assert handle_of(thrown(spin=1.5)) == "out-turn ↺"
    assert handle_of(thrown(spin=0.01)) == "hardly turns"
    assert handle_of(thrown()) == "–"


def test_the_curl_of_draws_is_shown_by_handle():
    throws = [
        thrown(0, curl=-1.1, spin=-1.0, from_tee=0.5),
        thrown(1, curl=-1.3, spin=-1.0, from_tee=1.0),
        thrown(2, curl=1.0, spin=1.0, from_tee=1.0),
        thrown(3, curl=0.3, spin=1.0, from_tee=9.0),
    ]
    assert curl_in_words(throws) == [
        "Curl of draws into or near the house: in-turn 1.20 m in 2 draws (from 1.10 m to 1.30 m); "
        "out-turn 1.00 m in one draw."
    ]
    assert curl_in_words([thrown()]) == []


def test_what_people_wrote_down_joins_the_table(tmp_path):
    notes = {0: ThrowNote(athlete="<Ann>", called="draw to the button", note="swept")}
    shown = throw_rows([DRAW, thrown(1)], notes=notes)
    assert shown.head[1:3] == ["athlete", "called"]
    assert shown.head[-1] == "note"
    assert shown.rows[1][1] == ""
    assert "&lt;Ann&gt;" in throws_section([DRAW], notes=notes)
    write_measures(tmp_path / "t.csv", [DRAW], notes)
    table = read_table(tmp_path / "t.csv", required=("hog_to_hog", "hog_to_hog_sigma", "athlete"))
    assert table.numbers("hog_to_hog")[0] == pytest.approx(14.234)
    assert table.text("athlete") == ["<Ann>"]


def test_columns_that_no_throw_fills_are_left_out():
    assert "hog to tee" not in throw_rows([DRAW]).head
    assert len(set(map(len, as_text(throw_rows([DRAW, thrown(1)])).splitlines()))) <= 3


def test_the_command_shows_the_table(curling, sliding, tmp_path):
    rng = np.random.default_rng(3)
    starts = sliding.varied_starts(rng, 2)
    write_tracks(
        tmp_path / "tracks.csv",
        sliding.measured_throws(sliding.uniform(0.0085), starts, rng, rest=1.0),
    )
    run = curling("throws", tmp_path / "tracks.csv", "-o", tmp_path / "table.csv")
    assert run.status == 0, run.err
    assert [one["direction"] for one in run.json()] == ["away", "home"]
    assert "handle" in run.err.splitlines()[0]
    assert len((tmp_path / "table.csv").read_text().splitlines()) == 3
    assert curling("throws", tmp_path / "tracks.csv", "--json").err == ""
    notes = tmp_path / "throws.csv"
    notes.write_text("athlete\nAnn\n")
    assert curling("throws", tmp_path / "tracks.csv").json()[0]["athlete"] == "Ann"
    refused = curling("throws", tmp_path / "tracks.csv", "-o", notes)
    assert "notes of the throws" in refused.complaint
    assert notes.read_text() == "athlete\nAnn\n"


@pytest.mark.parametrize(
    ("past", "shown"),
    [
        # A stone that touches the far hog line is in play, and one that bites the house counts.
        (-6.401 + 0.14, "hogged: 6.26 m short of the tee"),
        (-6.401 + 0.15, "6.25 m short of the tee"),
        (1.829 + 0.13, "1.96 m past the tee"),
        (1.829 + 0.15, "through the house: 1.98 m past the tee"),
        (-6.401, "hogged: 6.40 m short of the tee"),
    ],
)
def test_a_stone_counts_where_its_rim_does(past, shown):
    assert rest_of(thrown(right=0.3, past=past, from_tee=7.0)) == f"{shown}, 30 cm right"


@pytest.mark.parametrize("name", ["right", "past", "from_tee"])
def test_a_rest_that_is_partly_unknown_is_not_described(name):
    numbers = {"right": 0.3, "past": 0.4, "from_tee": 0.5}
    del numbers[name]
    assert rest_of(thrown(**numbers)) == "–"


def test_the_pin_ends_at_five_centimetres():
    assert rest_of(thrown(right=0.03, past=0.03, from_tee=0.049)) == "on the pin"
    assert rest_of(thrown(right=0.05, past=-0.02, from_tee=0.051)) == (
        "2 cm short of the tee, 5 cm right"
    )
    assert rest_of(thrown(right=0.05, past=0.02, from_tee=0.051), short=True) == (
        "2 cm past, 5 cm right"
    )


@pytest.mark.parametrize(
    ("spin", "shown"),
    [
        (0.0999, "hardly turns"),
        (0.1001, "out-turn ↺"),
        (-0.1001, "in-turn ↻"),
        ((0.29, 0.1), "hardly turns"),
        ((0.31, 0.1), "out-turn ↺"),
    ],
)
def test_a_handle_needs_a_tenth_of_a_radian_and_three_standard_errors(spin, shown):
    assert handle_of(thrown(spin=spin)) == shown


def test_curls_against_the_turn_and_their_limits():
    house = 2 * 1.829
    throws = [
        thrown(0, curl=0.2, spin=-1.0, from_tee=house - 0.01),
        thrown(1, curl=9.0, spin=-1.0, from_tee=house + 0.01),
        thrown(2, curl=9.0, spin=-0.099, from_tee=1.0),
        thrown(3, curl=-0.5, spin=-0.101, from_tee=1.0),
        thrown(4, curl=-0.3, spin=1.0, from_tee=1.0),
        thrown(5, curl=0.1, spin=1.0, from_tee=1.0),
        thrown(6, spin=1.0, from_tee=1.0),
        thrown(7, curl=0.4, from_tee=1.0),
        thrown(8, curl=0.4, spin=1.0),
    ]
    assert curl_in_words(throws) == [
        "Curl of draws into or near the house: in-turn 0.15 m in 2 draws (from 0.20 m to 0.50 m); "
        "out-turn 0.10 m against its turn in 2 draws (from 0.30 m to 0.10 m)."
    ]


def test_errors_of_times_are_their_medians_from_a_millisecond_on():
    throws = [
        thrown(0, hog_to_hog=(14.0, 0.002), back_to_hog=(3.5, 0.0004)),
        thrown(1, hog_to_hog=(14.0, 0.004)),
        thrown(2, hog_to_hog=(14.0, 0.9), back_to_hog=3.5),
        thrown(3),
    ]
    page = throws_section(throws)
    assert (
        "Known are hog to hog to about 0.004 s and back line to hog to about 0.001 s "
        "(one standard error)." in page
    )
    assert "Known are" not in throws_section([thrown(0, hog_to_hog=14.0)])


def test_times_are_shown_to_what_is_known():
    given = (
        thrown(0, hog_to_hog=(14.236, 0.0199), line=(0.001, 0.01)),
        thrown(1, hog_to_hog=(14.236, 0.02), line=-0.5),
        thrown(2, hog_to_hog=14.236, hog_to_tee=(20.55, 0.3)),
    )
    shown = throw_rows(given)
    times = {name: [row[k] for row in shown.rows] for k, name in enumerate(shown.head)}
    assert times["hog to hog"] == ["14.24 s", "14.2 s", "14.24 s"]
    assert times["line"] == ["on the line", "50 cm left", "–"]
    assert times["hog to tee"][:2] == ["–", "–"]
    assert [shown.head[k] for k in sorted(shown.numeric)] == ["throw", "hog to hog", "hog to tee"]


def test_a_terminal_table_is_aligned():
    rows = ThrowRows(head=["throw", "of"], rows=[["1", "Ann"], ["12", "B"]], numeric={0})
    assert as_text(rows) == "throw  of\n    1  Ann\n   12  B"


def test_measures_are_written_with_more_columns(tmp_path):
    write_measures(
        tmp_path / "t.csv",
        [thrown(0, speed=2.1234567), thrown(1)],
        {1: ThrowNote(stone="red 3")},
        {"hit": ["x", None], "number": [None, 1.2345678]},
    )
    table = read_table(tmp_path / "t.csv", required=("speed", "hit", "number", "stone_name"))
    assert table.numbers("speed", blank=True).tolist() == pytest.approx(
        [2.12346, np.nan], nan_ok=True
    )
    assert table.text("hit") == ["x", ""]
    assert table.numbers("number", blank=True).tolist() == pytest.approx(
        [np.nan, 1.23457], nan_ok=True
    )
    assert table.text("stone_name") == ["", "red 3"]
