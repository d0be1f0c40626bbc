"""The screens that coach, on an evening whose truth is known (`scripts/simulated_club.py`)."""

from __future__ import annotations

import json
import os
import re
from html import unescape

import numpy as np
import pytest
import simulated_club as made

from agents.app import Club, jobs
from agents.app.club.club import decoded, encoded
from agents.app.club.records import Answer
from agents.app.work import causes
from agents.app.work.causes import Kept, prepare
from curling_env.ice import save_ice
from curling_env.infrastructure import write_table
from curling_env.trajectory import write_tracks

HEAVY = 0.05
"""Excess speed of Bo's throws [m/s]: a third of a second and more."""


@pytest.fixture(scope="module")
def evening(tmp_path_factory, work_off):
    """A club with an evening on Sheet B, the ice that it believed in, and what is true."""
    rng = np.random.default_rng(11)
    athletes = (made.Athlete(name="Ada <i>"), made.Athlete(name="Bo", bias=(HEAVY, 0.0, 0.0)))
    result = made.evening(rng, athletes=athletes, throws=6, stones={1: (0.97, 1.0), 2: (1.03, 1.0)})
    club = Club(tmp_path_factory.mktemp("club"))
    before = club.add_session("Before", "2026-11-01", "Sheet B", None)
    save_ice(result.believed.as_ice(), club.ice_of(before))
    session = club.add_session("Evening", "2026-11-08", "Sheet B", None)
    save_ice(result.ice.as_ice(rng, sigma=0.002, curl_sigma=0.01), club.ice_of(session))
    write_tracks(club.tracks_of(session), result.tracks)
    notes = result.notes
    columns = {
        "throw": [*notes],
        "athlete": [note.athlete for note in notes.values()],
        "stone": [note.stone for note in notes.values()],
        "called": [note.called for note in notes.values()],
        "note": ["" for _ in notes],
    }
    write_table(club.folder_of(session) / "throws.csv", columns)
    with club.database.writing() as connection:
        for name in ("Ada <i>", "Bo"):
            connection.execute("insert into athlete (name) values (?)", (name,))
    prepare(club, session)
    assert work_off(club) == ["causes"]
    return club, session, before


@pytest.fixture
def club(evening):
    return evening[0]


def plain(text: str) -> str:
    """The words of a page."""
    return unescape(re.sub(r"\s+", " ", re.sub(r"<[^>]*>", " ", text)))


def test_causes_are_listed_throw_by_throw(visitor, evening):
    _, session, before = evening
    answer = visitor.get(f"hand-or-ice/{session.id}")
    assert answer.status == 200
    words = plain(answer.text)
    assert "The pattern of 12 throws" in words
    assert "Ada <i>'s" in words
    assert f'<option value="{before.id}" selected>' in answer.text
    assert "was not given" not in words
    # An athlete who throws a third of a second too heavy is long by weight every time.
    bo = plain(visitor.get(f"hand-or-ice/{session.id}?athlete=Bo").text)
    long = re.search(r"Weight −?\d+ % ± \d+ ([\d.]+) (m|cm) past", bo)
    assert long is not None, bo[:1500]
    metres = float(long[1]) * (1.0 if long[2] == "m" else 0.01)
    assert 0.4 < metres < 3.0


def test_both_pages_compare_two_ices_in_the_same_words(visitor, evening):
    session = evening[1]
    coached = plain(visitor.get(f"hand-or-ice/{session.id}").text)
    words = re.search(r"Today’s ice against that of Before: (.*?)\. Weight, line", coached)[1]
    assert " end " in words  # the ice has changed by another amount towards either end
    assert f"Before, 2026-11-01 : {words}" in plain(visitor.get(f"ice/{session.id}").text)


def test_it_is_worked_out_beside_the_server_and_kept_until_something_changes(
    visitor, evening, work_off
):
    club, session, _ = evening
    page = f"hand-or-ice/{session.id}?believed=0"
    coming = visitor.get(page)
    assert coming.status == 202
    assert "Analysing why throws missed, and how the stones differ: waiting" in plain(coming.text)
    assert visitor.get(page).status == 202  # and asks for it once
    assert work_off(club) == ["causes"]
    assert "was not given" in plain(visitor.get(page).text)
    notes = club.folder_of(session) / "throws.csv"
    before = notes.read_text()
    notes.write_text(before)
    assert visitor.get(page).status == 200
    notes.write_text(before.replace("Ada <i>", "Eve", 1))
    os.utime(notes, ns=(1, 1))
    stale = visitor.get(page)  # the earlier answer is shown meanwhile, and says so
    assert stale.status == 200
    assert "it is being updated" in plain(stale.text)
    assert "The pattern of" in plain(stale.text)
    kept = club.database.rows(Answer, "select * from answer where name like 'causes %'")
    club.database.write("delete from answer where name like 'causes %'")
    asked = {"target": {"x": 0, "y": 17.3735}, "ice": "standard", "skill": "athlete:1"}
    answer = visitor.send("throw/plan", asked)  # a script asks again
    assert (answer.status, answer.document["coming"]) == (503, True)
    notes.write_text(before)
    for one in kept:
        club.keep_answer(one.name, one.of, decoded(one.content, Kept))
    work_off(club)  # what has changed again meanwhile is not worked out for nothing
    answer = visitor.get(page)
    assert answer.status == 200
    assert "being updated" not in plain(answer.text)


def test_nothing_is_worked_out_when_someone_looks(visitor, evening, monkeypatch):
    def looked(*_, **__):
        raise AssertionError("worked out when someone looked")

    for module, name in (
        (causes, "hand_or_ice"),
        (causes, "match_stones"),
        (causes, "athlete_errors"),
    ):
        monkeypatch.setattr(module, name, looked)
    for screen in ("hand-or-ice", "athletes", "stones"):
        assert visitor.get(screen).status == 200, screen


def test_work_that_failed_is_reported_and_begun_again_only_when_asked_for(
    visitor, evening, work_off
):
    club, session, before = evening
    page = f"hand-or-ice/{session.id}?believed={before.id}&athlete=Bo"
    name = f"causes {session.id} {before.id}"
    content = club.answer(name, Kept)
    club.database.write("update answer set content = x'c1' where name = ?", name)
    assert visitor.get(page).status == 202  # an answer that was damaged is worked out again
    (job,) = [job for job in jobs(club) if job.state == "waiting"]
    with club.database.writing() as connection:
        query = "update job set state = 'failed', problem = 'no memory' where id = ?"
        connection.execute(query, (job.id,))
    assert "no memory" in visitor.get(page).text
    assert work_off(club) == []
    assert visitor.send(f"practice/work/{job.id}/again", {}).status == 204
    assert work_off(club) == ["causes"]
    assert encoded(club.answer(name, Kept)) == encoded(content)
    assert visitor.get(page).status == 200


def test_one_throw_has_an_address_and_its_parts_lead_to_its_rest(visitor, evening):
    session = evening[1]
    text = visitor.get(f"hand-or-ice/{session.id}?throw=3").text
    assert "Throw 3, Ada &lt;i&gt;" in text
    picture = json.loads(re.search(r'id="steps">(.*?)</script>', text, re.DOTALL)[1])
    x, y = picture["target"]["x"], picture["target"]["y"]
    for step in picture["steps"]:
        assert (step["x"][0], step["y"][0]) == pytest.approx((x, y), abs=2e-3)
        x, y = step["x"][1], step["y"][1]
    assert (x, y) == pytest.approx((picture["rest"]["x"], picture["rest"]["y"]), abs=2e-3)


@pytest.mark.parametrize(
    ("query", "status"),
    [("throw=99", 404), ("throw=x", 422), ("athlete=Zoe", 404), ("believed=77", 404)],
)
def test_what_is_not_there_is_reported(visitor, evening, query, status):
    assert visitor.get(f"hand-or-ice/{evening[1].id}?{query}").status == status


def test_athletes_have_their_bias_and_their_hand_can_be_planned_with(visitor, evening):
    words = plain(visitor.get("athletes").text)
    bo = words[words.index(" Bo ") :]
    heavy = re.search(r" 6 all (?:draw )?([\d.]+) s heavy \(([\d.]+) to ([\d.]+)\)", bo)
    assert heavy is not None, bo[:600]
    # A draw is 10 to 15 s slower for each metre a second, and 6 throws leave the bias open by half.
    assert float(heavy[2]) < 15 * HEAVY
    assert float(heavy[3]) > 10 * HEAVY
    target = {"target": {"x": 0, "y": 17.3735}, "ice": "standard"}
    ids = {one.name: one.id for one in evening[0].athletes()}
    answer = visitor.send("throw/plan", {**target, "skill": f"athlete:{ids['Bo']}"})
    assert answer.status == 200
    assert answer.document["skill"]["name"] == "Bo"
    habit = answer.document["habit"]
    late, aim = re.match(r"Bo is usually ([\d.]+) s heavy: aim for ([\d.]+) s", habit).groups()
    weight = answer.document["call"]["hog_to_hog_s"]
    assert float(aim) - float(late) == pytest.approx(weight, abs=0.11)
    assert 0.01 < answer.document["skill"]["sigma_speed"] < 0.08
    assert "athlete:99" in visitor.send("throw/plan", {**target, "skill": "athlete:99"}).text


def test_stones_are_ordered_and_distinguished(visitor, evening):
    session = evening[1]
    words = plain(visitor.get(f"stones/{session.id}").text)
    first, second = (re.search(rf" {stone} [^%]{{5,60}} 6 ", words).start() for stone in (1, 2))
    assert first < second  # the keenest first
    assert re.search(r" 1 .{5,60} 6 \d\.\d % keener", words)
    assert re.search(r" 2 .{5,60} 6 \d\.\d % heavier", words)
    assert "shorter" in words[second:]


def test_without_throws_each_screen_says_what_it_needs(visitor, evening):
    before = evening[2]
    for screen in ("hand-or-ice", "stones"):
        answer = visitor.get(f"{screen}/{before.id}")
        assert answer.status == 200
        assert "once" in plain(answer.text)
