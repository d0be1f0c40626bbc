"""At the rink: numbers of the throw of this moment, whose turn it is, sweeping, and scores."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

pytest.importorskip("starlette", reason="the extra `app` is not installed")

from agents.app import Club, Part, keep_part, take_film
from agents.app.club.club import encoded
from agents.app.views.progress import state_of
from agents.app.views.throws import sheet_seen_live, sheets_of
from agents.coaching.scores import leaderboard, points_of
from curling_env.ice import load_ice
from curling_env.physics import slide
from curling_env.throw import Throw
from curling_env.trajectory import Trajectory, read_tracks
from friction_estimation.tracks.throw_table import measure_throw

TOWER = {"width": 1366, "height": 768}
VOICE = "window.spoken = []; speechSynthesis.speak = (one) => spoken.push(one.text);"


def track(k: int, speed: float = 2.05) -> Trajectory:
    throw = Throw(speed=speed, angle=0.05, spin=-1.2)
    found = slide(load_ice("standard"), throw.release(), fps=10.0, throw=k).trajectory
    assert found is not None
    return found


def throw_it(club: Club, number: int, speed: float = 2.05) -> None:
    """A film of one throw that has been tracked."""
    (session,) = club.sessions()
    path = club.folder / "films" / f"{number}.mp4"
    path.write_bytes(b"film")
    film = take_film(club, session, path)
    club.change("film", film.id, state="done")
    keep_part(club, session, film, Part(throws=[[track(0, speed)]], handles=[[None]]))


@pytest.fixture
def session(club: Club) -> Any:
    return club.add_session("Tuesday", "2026-11-17", "2", None)


def test_new_throws_get_the_drill_and_the_next_athlete(visitor, session):
    club = visitor.club
    form = {"lineup": "Anna,  Ben", "drill": "draw button in"}
    assert visitor.post(f"rink/{session.id}", form).status == 303
    for number in range(3):
        throw_it(club, number)
    assert [sheet.athlete for sheet in sheets_of(club, session)] == ["Anna", "Ben", "Anna"]
    assert {sheet.note.called for sheet in sheets_of(club, session)} == {"draw button in"}
    assert club.session(session.id).lineup == "Ben, Anna"
    page = visitor.get(f"rink/{session.id}").text
    assert "1. Anna" in page
    assert "2. Ben" in page


def test_a_throw_that_is_tracked_late_leaves_the_one_that_runs(visitor, session):
    club = visitor.club
    visitor.post(f"rink/{session.id}", {"lineup": "Anna, Ben, Clara", "drill": "draw button in"})
    path = club.folder / "films" / "first.mp4"
    path.write_bytes(b"film")
    first = take_film(club, session, path)  # Anna's, which is tracked while Ben's stone runs
    live = encoded(measure_throw(track(0)))
    club.change("session", session.id, live=live, live_film=1)
    assert sheet_seen_live(club, session).athlete == "Ben"
    assert state_of(club, session)["next"]["athlete"] == "Clara"
    club.change("film", first.id, state="done")
    keep_part(club, session, first, Part(throws=[[track(0)]], handles=[[None]]))
    assert sheet_seen_live(club, session).athlete == "Ben"
    throw_it(club, 2)
    assert sheet_seen_live(club, session) is None
    assert [sheet.athlete for sheet in sheets_of(club, session)] == ["Anna", "Ben"]


def test_points_follow_the_distance_from_the_target(visitor, session):
    club = visitor.club
    visitor.post(f"rink/{session.id}", {"lineup": "Anna, Ben", "drill": "draw button in"})
    for number, speed in enumerate((2.05, 1.9)):
        throw_it(club, number, speed)
    near, far = sheets_of(club, session)
    off = [np.hypot(*(one.value for one in sheet.miss)) for sheet in (near, far)]
    assert off[0] < 1.83 < off[1]
    assert points_of(far, None) == 1
    first, second = leaderboard([(far, None), (near, None)])
    assert (first.athlete, second.athlete) == ("Anna", "Ben")
    assert first.miss == pytest.approx(off[0])
    visitor.post(f"throws/{session.id}/1", {"called": "hit 0,0 in", "made": "made"})
    hit, _ = sheets_of(club, session)
    assert [points_of(hit, made) for made in (None, True, False)] == [None, 4, 0]


def test_sweeping_that_is_noted_is_in_the_tracks(visitor, session):
    club = visitor.club
    throw_it(club, 0)
    assert visitor.post(f"throws/{session.id}/1", {"swept": "second half"}).status == 303
    (swept,) = read_tracks(club.tracks_of(session))
    assert ((swept.swept > 0.5) == (swept.xy[:, 1] >= 0)).all()
    assert visitor.post(f"throws/{session.id}/1", {"swept": "much"}).status == 422
    visitor.post(f"throws/{session.id}/1", {"swept": "no"})
    (swept,) = read_tracks(club.tracks_of(session))
    assert not swept.swept.any()


def test_a_throw_is_shown_large_and_spoken_while_it_runs(
    browser: Any, club: Club, serve_club: Callable[..., Any]
):
    session = club.add_session("Tuesday", "2026-11-17", "2", None)
    whole = track(0)
    back = np.arange(1, 31)[::-1]  # the slide before the hog line, where the split is measured
    before = whole.xy[0] - 0.1 * back[:, None] * np.array([-0.05, 2.2])
    t = np.concatenate([3.0 - 0.1 * back, 3.0 + whole.t])
    xy = np.concatenate([before, whole.xy])
    running = xy[:, 1] < 12.0
    with serve_club(club) as address:
        page = browser.new_page(viewport=TOWER)
        page.add_init_script(VOICE)
        page.goto(f"{address}rink/{session.id}")
        page.get_by_label("Say it aloud").check()
        page.get_by_label("Athletes in turn").fill("Anna, Ben")
        page.get_by_label("Call of every throw").fill("draw button in")
        page.get_by_role("button", name="Save").click()
        page.get_by_text("Read as: draw, button, in-turn.").wait_for()
        for rows, rests in ((running, 0), (t >= 0, 1)):
            seen = Trajectory(t=t[rows], xy=xy[rows], theta=np.full(rows.sum(), np.nan))
            live = encoded(measure_throw(seen))
            club.change("session", session.id, live=live, live_rests=rests)
            page.locator("#numbers dt", has_text=("Hog to hog", "Rest")[rests]).wait_for()
        assert page.locator("#who").inner_text() == "Now · Anna"
        assert page.locator("#called").inner_text() == "draw button in"
        size = page.locator("#numbers dd").first.evaluate(
            "(it) => it.getBoundingClientRect().height"
        )
        assert size > 90  # px on a laptop: some 2 cm, as letters of a sign that is read from 10 m
        spoken = page.evaluate("spoken")
        assert any("Hog to hog: 1" in words and "seconds" in words for words in spoken), spoken
        assert sum("Hog to hog" in words for words in spoken) == 1
        assert any("Rest: " in words for words in spoken), spoken
        throw_it(club, 0)
        page.get_by_text("Throw 1 · Anna").wait_for()
        page.get_by_role("heading", name="Throw 1").wait_for()
        page.locator("#next", has_text="Next: Ben").wait_for()
        page.close()
