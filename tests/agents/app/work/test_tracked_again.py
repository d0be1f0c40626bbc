"""Films with other marks are tracked again, and a coach's entries stay with their throws."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from agents.app import Part, jobs, keep_part, removed_in, take_film
from agents.app.club.club import added
from agents.app.club.films import marks_of
from agents.app.views.progress import state_of
from agents.app.work import tracking
from curling_env.sheet import PAPER_SHEET
from curling_env.trajectory import Trajectory, read_tracks
from friction_estimation.camera import CORNERS, load_scene, save_scene
from friction_estimation.camera.scene import Scene
from friction_estimation.film import film_writer
from friction_estimation.tracking.films.steady_film import scene_mismatch_error
from friction_estimation.tracking.films.tracked_film import TrackedFilm

CLICKS = {"home_left": (100, 600), "home_right": (1100, 600), "away_right": (700, 100)}
CLICKS["away_left"] = (500, 100)


def track(clock: float, right: float = 0.0) -> Trajectory:
    t = np.linspace(0.0, 24.0, 80)
    y = -10.97 + 2.1 * t - 0.0437 * t**2
    return Trajectory(t=t, xy=np.column_stack([0 * t + right, y]), clock=clock)


@pytest.fixture
def filmed(club):
    """A marked camera, and a film with two throws that have a coach's notes."""
    points = np.array([CLICKS[name] for name in CORNERS], dtype=np.float64)
    corners = np.array([[-2.25, -22.25], [2.25, -22.25], [2.25, 22.25], [-2.25, 22.25]])
    scene = Scene(
        sheet_points=corners, points_px=points, picture_size=(1280, 720), sheet=PAPER_SHEET
    )
    save_scene(scene, club.path("cameras/end.scene.json"))
    with club.database.writing() as connection:
        about = {"length": 44.5, "width": 4.5, "scene": "cameras/end.scene.json"}
        camera = added(connection, "camera", name="end", **about)
    session = club.add_session("Tuesday", "2026-11-17", "1", club.camera(camera))
    path = club.folder / "films" / "a.mp4"
    path.write_bytes(b"film")
    film = take_film(club, session, path)
    part = Part(throws=[[track(10.0)], [track(80.0)]], handles=[[None], [None]])
    with club.database.writing() as connection:
        marks = marks_of(club, club.camera(camera))
        connection.execute("update film set state = 'done', marks = ?", (marks,))
    keep_part(club, session, film, part)
    with club.database.writing() as connection:
        connection.execute("update throw set called = 'draw ' || part, note = 'n' || part")
    return session, film


def tracker(*tracks: Trajectory):
    """A tracker that finds these throws."""

    def track_each(films, scene, **_):
        for one in tracks:
            summary = {"frames": 1}
            yield TrackedFilm(film=Path(films[0]), tracks=(one,), summary=summary)

    return track_each


def mark(club, visitor, session):
    """Mark one corner elsewhere, on the page."""
    moved = {name: [u + 20.0, v + 10.0] for name, (u, v) in CLICKS.items()}
    scene = load_scene(club.path("cameras/end.scene.json"))
    save = f"practice/{session.id}/mark/{visitor.token}/save"
    return scene, save, {"clicks": moved}


def test_other_marks_track_a_film_again_and_entries_follow_their_throws(
    club, visitor, filmed, work_off, monkeypatch
):
    session, _ = filmed
    before = {one.note: one.label for one in club.throws(session)}
    scene, *_ = mark(club, visitor, session)
    # As the page saves marks: the film was tracked with others, and says so until it is done.
    monkeypatch.setattr(
        "agents.app.screens.marking._annotation",
        lambda *_: pytest.fail("the page itself needs no film"),
    )
    assert visitor.get(f"practice/{session.id}/mark/{visitor.token}/").status == 200
    from agents.app.screens.marking import _save

    _save(club, club.camera(session.camera_id), replace(scene, points_px=scene.points_px + 7.0))
    (result,) = state_of(club, session)["films"]
    assert result["state"] == "again"
    assert "tracked with other marks" in visitor.get(f"throws/{session.id}").text
    # Another throw is found before both, a little later in the film, and half a metre to the right.
    found = [track(-20.0, 0.5), track(11.5, 0.5), track(81.0, 0.5)]
    monkeypatch.setattr(tracking, "track_each", tracker(*found))
    visitor.post(f"practice/{session.id}/work", {"kind": "track"})
    assert work_off(club) == ["track"]
    throws = club.throws(session)
    assert {one.note: one.label for one in throws if one.note} == before  # numbers never change
    assert [one.called for one in throws] == ["draw 0", "draw 1", ""]
    rests = {one.throw: one.xy[-1, 0] for one in read_tracks(club.tracks_of(session))}
    assert rests == {0: 0.5, 1: 0.5, 2: 0.5}
    (result,) = state_of(club, session)["films"]
    assert result["state"] == "done"


def test_a_film_of_another_camera_is_marked_in_the_app(
    club, visitor, filmed, work_off, monkeypatch
):
    session, film = filmed
    club.change("film", film.id, state="waiting")

    def refused(films, scene, **_):
        raise scene_mismatch_error(SimpleNamespace(disagreeing=("rings",)), Path(films[0]))

    monkeypatch.setattr(tracking, "track_each", refused)
    visitor.post(f"practice/{session.id}/work", {"kind": "track"})
    work_off(club)
    (result,) = state_of(club, session)["films"]
    assert (result["state"], result["mark"]) == ("failed", True)
    assert result["remark"].endswith("mark the sheet again in this film")
    assert "`" not in result["remark"]  # no command


def test_marks_that_are_corrected_track_the_film_again_while_the_page_is_open(
    browser, club, filmed, serve_club, work_off, monkeypatch
):
    session, film = filmed
    path = club.path(film.file)
    path.unlink()
    with film_writer(path, (1280, 720), 4.0) as writer:
        for _ in range(3):
            writer.write(np.full((720, 1280, 3), 90, np.uint8))
    monkeypatch.setattr(tracking, "track_each", tracker(track(10.0, 0.5), track(80.0, 0.5)))
    moved = {name: [u + 20.0, v + 10.0] for name, (u, v) in CLICKS.items()}
    with serve_club(club) as address:
        page = browser.new_page(viewport={"width": 1366, "height": 768})
        page.goto(f"{address}practice/{session.id}")
        line = page.locator("#films li")
        line.get_by_text("2 throws").wait_for()
        with page.context.expect_page() as opened:
            page.get_by_role("link", name="Check the marks").click()
        saved = opened.value.evaluate(
            """async (clicks) => (await fetch("save", {
                method: "POST", body: JSON.stringify({ clicks }) })).json()""",
            moved,
        )
        assert saved == {"problem": None}
        line.get_by_text("tracked with other marks; will be tracked again").wait_for()
        page.locator("#jobs").get_by_text("Tracking: waiting").wait_for()
        assert work_off(club) == ["track"]
        line.get_by_text("2 throws").wait_for()
        page.goto(f"{address}throws/{session.id}/1")
        assert page.get_by_label("Note").input_value() == "n0"
        assert "50 cm right" in page.locator("table.what").inner_text()
        page.context.close()


def test_a_throw_with_entries_that_is_no_longer_found_can_be_seen(club, filmed):
    session, film = filmed
    keep_part(club, session, film, Part(throws=[[track(80.0)]], handles=[[None]]))
    assert [(one.label, one.note) for one in club.throws(session)] == [(2, "n1")]
    assert [one.name for one in removed_in(club, session)] == ["throw 1, draw 0, a.mp4"]


def test_ice_that_was_estimated_from_films_is_estimated_again_with_them(
    club, visitor, filmed, work_off, monkeypatch
):
    session, _ = filmed
    with club.database.writing() as connection:
        connection.execute("update session set ice_of = 'earlier'")
        connection.execute("update film set marks = 'earlier'")
    monkeypatch.setattr(tracking, "track_each", tracker(track(10.0), track(80.0)))
    visitor.post(f"practice/{session.id}/work", {"kind": "track"})
    work_off(club)
    assert [job.kind for job in jobs(club, session)] == ["estimate", "track"]


def test_a_throw_that_is_found_twice_counts_once(club, filmed):
    session, film = filmed
    part = Part(throws=[[track(10.0)], [track(80.0)], [track(80.05)]], handles=[[None]] * 3)
    keep_part(club, session, film, part)
    assert [one.label for one in club.throws(session)] == [1, 2]
