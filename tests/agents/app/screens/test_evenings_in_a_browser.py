"""Evenings of a coach in a real browser: throws that are counted once, work, ice, a winter."""

from __future__ import annotations

import re
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("starlette", reason="the extra `app` is not installed")

from agents.app import SCREENS, Club, Part, keep_part, submit, take_film
from agents.app.club.club import added, encoded
from agents.app.club.session_files import measures_of
from agents.app.take_in import take_in
from agents.app.work.causes import prepare
from agents.app.work.jobs import Reported
from curling_env.ice import load_ice, save_ice
from curling_env.physics import slide
from curling_env.sheet import PAPER_SHEET
from curling_env.throw import Throw
from curling_env.trajectory import Trajectory, write_tracks
from friction_estimation.camera import CORNERS, save_scene
from friction_estimation.camera.scene import Scene
from friction_estimation.film import film_writer

LAPTOP = {"width": 1366, "height": 768}


def track(k: int, clock: float = 0.0) -> Trajectory:
    throw = Throw(speed=2.05 + 0.02 * k, angle=0.05, spin=-1.2)
    found = slide(load_ice("standard"), throw.release(), fps=10.0, throw=k).trajectory
    assert found is not None
    return replace(found, clock=clock)


@pytest.fixture(scope="module")
def club(tmp_path_factory: pytest.TempPathFactory, work_off: Callable[..., Any]) -> Club:
    """A club with two evenings on one sheet, six throws of Anna and Ben in turn, and their ice."""
    folder: Path = tmp_path_factory.mktemp("evening")
    write_tracks(folder / "tracks.csv", [track(k) for k in range(6)])
    rows = [f"{k},{('Anna', 'Ben')[k % 2]},draw button in broom 1.4 left" for k in range(6)]
    (folder / "throws.csv").write_text("\n".join(["throw,athlete,called", *rows]))
    ice = load_ice("standard")
    friction = replace(ice.friction, sigma=np.full_like(ice.friction.mu, 4e-5))
    save_ice(replace(ice, friction=friction), folder / "ice.json")
    club = Club(tmp_path_factory.mktemp("club"))
    for name, day in (("Last week", "2026-11-10"), ("Tuesday", "2026-11-17")):
        session = take_in(club, folder, name=name, day=day, sheet="Sheet 2")
    prepare(club, session)
    assert work_off(club) == ["causes"]
    return club


@pytest.fixture(scope="module")
def address(club: Club, serve_club: Callable[..., Any]) -> Iterator[str]:
    with serve_club(club) as address:
        yield address


def filmed(club: Club, name: str, throws: list[list[Trajectory]], day: str = "2026-11-01") -> Any:
    """A session with a film in which these throws were found."""
    session = club.add_session(name, day, "Sheet 1", None)
    path = club.folder / "films" / f"{name}.mp4"
    path.write_bytes(b"film")
    film = take_film(club, session, path)
    club.change("film", film.id, state="done")
    keep_part(club, session, film, Part(throws=throws, handles=[[None] * len(k) for k in throws]))
    return session


def test_a_throw_that_was_found_twice_is_one_row_and_one_stone(page, club, address):
    twice = [[track(0, 10.0)], [track(1, 80.0)], [track(1, 80.05)]]
    session = filmed(club, "Twice", twice)
    page.goto(f"{address}throws/{session.id}")
    page.locator("#house .rest").first.wait_for()
    assert page.locator("table.throws tbody tr").count() == 2
    assert page.locator("#house .rest").count() == 2
    page.goto(f"{address}practice/{session.id}")
    page.get_by_text("2 throws in all.").wait_for()


def test_the_curve_of_a_takeout_ends_where_its_stone_has_stopped(page, club, address):
    slid = track(0)
    t = slid.t[-1] + 1.1 + np.arange(40) / 10  # a second later a hand takes it away
    xy = slid.xy[-1] + np.column_stack([0 * t, 4.1 * (t - t[0])])
    still = slid.t[-1] + np.arange(1, 11) / 10
    n = len(still) + len(t)
    longer = replace(
        slid,
        t=np.concatenate([slid.t, still, t]),
        xy=np.concatenate([slid.xy, np.tile(slid.xy[-1], (len(still), 1)), xy]),
        theta=np.concatenate([slid.theta, np.full(n, np.nan)]),
        sigma_xy=np.full(len(slid.t) + n, 0.004),
        swept=np.zeros(len(slid.t) + n),
    )
    session = filmed(club, "Takeout", [[longer]])
    page.goto(f"{address}throws/{session.id}/1")
    points = page.locator("#curve .speed").get_attribute("points")
    heights = [float(point.split(",")[1]) for point in points.split()]
    assert all(b > a - 2 for a, b in zip(heights, heights[5:], strict=False))  # it only slows
    rest = page.locator("table.what tr", has_text="Rest").locator("td").inner_text()
    past = slid.xy[-1, 1] - 17.3735
    words = f"{abs(past):.2f} m" if abs(past) >= 1 else f"{100 * abs(past):.0f} cm"
    assert rest.startswith(f"{words} {'past' if past > 0 else 'short'}")


def test_the_remaining_time_does_not_jump_on_the_page(page, club, address, monkeypatch):
    session = club.add_session("Long work", "2026-11-02", "Sheet 1", None)
    number = submit(club, "track", session).id
    club.change("job", number, state="running")
    now = 100.0
    monkeypatch.setattr("agents.app.work.jobs.monotonic", lambda: now)
    reported = Reported(club, number)
    page.goto(f"{address}practice/{session.id}")
    line = page.locator("#jobs li")
    # Stages of unlike speed: a minute, then half an hour, then seconds.
    for rate, seconds, words in ((0.02, 12, "s left"), (0.0005, 4, ""), (0.01, 4, "")):
        for k in range(seconds):
            now += 1.0
            reported(f"stage {rate}", rate * (k + 1))
        line.get_by_text(re.compile(rf"stage {rate}.*{words}")).first.wait_for()
        assert ("left" in line.inner_text()) == bool(words)


def test_the_ice_that_is_looked_at_says_so_and_cannot_be_asked_again(page, club, address):
    session = club.sessions()[0]
    page.goto(f"{address}ice/{session.id}")
    page.get_by_role("button", name="Look for it now").click()
    page.wait_for_url("**/practice/*")
    page.goto(f"{address}ice/{session.id}")
    page.get_by_text("This is being looked for now.").wait_for()
    page.get_by_text("Looking for effects that the ice map does not explain: waiting").wait_for()
    assert page.get_by_role("button", name="Look for it now").count() == 0


def test_last_weeks_ice_is_compared_alike_on_both_screens(page, club, address):
    session = club.sessions()[0]
    page.goto(f"{address}ice/{session.id}")
    page.get_by_text("Last week, 2026-11-10: of the same weight").wait_for()
    page.goto(f"{address}hand-or-ice/{session.id}")
    page.get_by_text("Today’s ice against that of Last week: of the same weight.").wait_for()
    ice = page.locator("tr", has_text="Misread ice").locator("td").first.inner_text()
    assert abs(float(ice.split(" %")[0].replace("−", "-"))) <= 1


def test_numbers_of_throws_stay_and_next_stays_with_the_athlete(page, club, address):
    session = filmed(club, "Numbers", [[track(k, 60.0 * k)] for k in range(5)])
    for throw in club.throws(session):
        anna = added_athlete(club, ("Anna", "Ben")[throw.number % 2])
        club.change("throw", throw.id, athlete_id=anna)
    page.goto(f"{address}throws/{session.id}")
    page.locator("#athlete").select_option("Anna")
    page.wait_for_url("**athlete=Anna")
    page.locator("a.open").first.click()
    for number in (3, 5):
        page.get_by_role("link", name="Next").click()
        page.get_by_role("heading", name=f"Throw {number}", exact=True).wait_for()
    assert page.get_by_role("link", name="Next").count() == 0
    page.goto(f"{address}throws/{session.id}/2")
    page.get_by_text("Remove this throw").click()
    page.get_by_role("button", name="Remove").click()
    page.wait_for_url("**/practice/*")
    page.goto(f"{address}throws/{session.id}")
    assert page.locator("a.open").all_inner_texts() == ["1", "3", "4", "5"]
    page.goto(f"{address}throws/{session.id}/3")
    page.get_by_role("heading", name="Throw 3", exact=True).wait_for()


def added_athlete(club: Club, name: str) -> int:
    return next(one.id for one in club.athletes() if one.name == name)


def test_two_throws_stand_side_by_side_in_step(page, club, address):
    path = club.folder / "films" / "both.mp4"
    with film_writer(path, (320, 180), 5.0) as writer:
        for k in range(400):
            writer.write(np.full((180, 320, 3), k % 200, np.uint8))
    session = club.add_session("Both", "2026-11-04", "Sheet 1", None)
    film = take_film(club, session, path)
    club.change("film", film.id, state="done")
    part = Part(throws=[[track(0, 5.0)], [track(3, 40.0)]], handles=[[None], [None]])
    keep_part(club, session, film, part)
    page.goto(f"{address}practice/{session.id}")
    small = page.locator("#films img")
    page.wait_for_function("document.querySelector('#films img')?.naturalWidth === 160")
    assert small.count() == 1
    page.goto(f"{address}throws/{session.id}/2")
    page.get_by_label("Number of another throw").fill("1")
    page.get_by_label("Called").focus()
    page.locator(".films-beside video").nth(1).wait_for()
    page.locator("#time").fill("47")  # seven seconds after the release
    page.wait_for_function(
        "(([own, other]) => Math.abs(own.currentTime - 47) < 0.3 && "
        "Math.abs(other.currentTime - 12) < 0.3)([...document.querySelectorAll('video')])"
    )
    first = page.locator("table.what tr", has_text="Rest").locator("td").all_inner_texts()
    page.reload()  # the address has both
    page.locator("table.what .other").first.wait_for()
    assert page.locator("#above .path").count() == 2
    page.goto(f"{address}throws/{session.id}/1")
    own = page.locator("table.what tr", has_text="Rest").locator("td").inner_text()
    assert own.startswith(first[1])
    # A step is a frame of this film.
    page.locator("#curve .speed").wait_for()
    page.locator("#time").fill("8")
    page.get_by_role("button", name="One frame on").click()
    page.wait_for_function("Math.abs(document.getElementById('film').currentTime - 8.1) < 0.05")


def test_a_film_of_another_size_is_marked_on_its_page_with_the_old_marks_in_place(
    page, club, address
):
    px = np.array([[100, 600], [1100, 600], [700, 100], [500, 100]], dtype=np.float64)
    at = np.array([[-2.25, -22.25], [2.25, -22.25], [2.25, 22.25], [-2.25, 22.25]])
    scene = Scene(sheet_points=at, points_px=px, picture_size=(1280, 720), sheet=PAPER_SHEET)
    save_scene(scene, club.path("cameras/tripod.scene.json"))
    with club.database.writing() as connection:
        about = {"length": 44.5, "width": 4.5, "scene": "cameras/tripod.scene.json"}
        camera = added(connection, "camera", name="tripod", **about)
    session = club.add_session("4K after 720p", "2026-11-03", "Sheet 1", club.camera(camera))
    path = club.folder / "films" / "large.mp4"
    with film_writer(path, (2560, 1440), 4.0) as writer:
        writer.write(np.full((1440, 2560, 3), 90, np.uint8))
    film = take_film(club, session, path)
    remark = "its rings are elsewhere; mark the sheet again in this film"
    club.change("film", film.id, state="failed", said=remark)
    page.goto(f"{address}practice/{session.id}")
    page.get_by_text(remark).wait_for()
    with page.context.expect_page() as opened:
        page.get_by_role("link", name="Mark the sheet from this film on").click()
    marking = opened.value
    marking.get_by_text("Mark the sheet in").wait_for()
    found = marking.evaluate("async () => (await fetch('film.json')).json()")
    assert found["size"] == [2560, 1440]
    clicks = [found["clicks"][name] for name in CORNERS]
    assert np.allclose(sorted(clicks), sorted((2 * px).tolist()), atol=1.0)
    marking.close()


def test_every_screen_of_a_winter_is_there_at_once(page, club, address):
    """51 sessions of 40 throws: each page takes less than a second of the processor."""
    first = club.sessions()[-1]
    measures = measures_of(club.throws(club.sessions()[0])[0].measures)
    assert measures is not None
    throws = [(n, n, encoded(replace(measures, throw=n))) for n in range(40)]
    with club.database.writing() as connection:
        for k in range(51):
            about = {"day": f"2026-12-{1 + k % 28:02d}", "sheet": "2", "folder": f"sessions/{k}"}
            number = added(connection, "session", name=f"Winter {k}", stale=0, **about)
            connection.executemany(
                "insert into throw (session_id, number, part, measures) values (?, ?, ?, ?)",
                [(number, *one) for one in throws],
            )
    for screen in SCREENS:
        before = time.process_time()
        page.goto(f"{address}{screen.name}")
        assert time.process_time() - before < 1.0, screen.name
        assert page.locator("#sessions option").count() >= 51, screen.name
        assert page.get_by_text("No throws yet").count() == 0, screen.name
    page.goto(f"{address}throws")
    page.locator("#house .rest").nth(39).wait_for(state="attached")
    # All are reached from any page.
    page.locator("#sessions").select_option(f"{address[address.index('/', 8) :]}throws/{first.id}")
    page.wait_for_url(f"**/throws/{first.id}")
