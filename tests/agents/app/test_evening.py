"""One whole evening in a real browser, on a machine whose power goes again and again."""

from __future__ import annotations

import base64
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from threading import Thread
from typing import Any

import av
import numpy as np
import pytest

pytest.importorskip("starlette", reason="the extra `app` is not installed")

from agents.app import Club, add_piece, begin_film, jobs, take_film
from agents.app.club.club import added
from agents.app.views.progress import state_of
from agents.app.views.throws import sheet_seen_live
from agents.app.work.jobs import Reported
from curling_env import Throw, load_ice
from curling_env.errors import InputError
from curling_env.ice import load_ice as read_ice
from curling_env.physics import play_bounds, slide
from curling_env.sheet import PAPER_SHEET, RULE_BOOK_STONE, Direction, to_delivery
from curling_env.trajectory import read_tracks
from friction_estimation import load_scene
from friction_estimation.camera import CORNERS, save_scene
from friction_estimation.film import Film, film_writer
from friction_estimation.synthetic import FilmSpec, render_film, scene_of

PHONE, LAPTOP = {"width": 390, "height": 844}, {"width": 1366, "height": 768}
PATIENCE = 150_000
"""For what the server works out on a busy machine [ms]."""


class App:
    """`curling app` in a separate process, which can be killed and started again."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.port = folder, 0
        self.address = ""

    def start(self, *words: str) -> str:
        port = ["--port", str(self.port)]
        self.process = subprocess.Popen(
            [
                sys.executable,
                "-m",
                "curling",
                "app",
                str(self.folder),
                "--no-browser",
                *port,
                *words,
            ],
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
        )
        assert self.process.stdout is not None
        self.address = self.process.stdout.readline().strip()
        found = re.fullmatch(r"http://127\.0\.0\.1:(\d+)/[\w-]{20,}/", self.address)
        assert found, self.address
        self.port = int(found[1])
        return self.address

    def kill(self) -> None:
        os.kill(self.process.pid, signal.SIGKILL)
        self.process.wait()

    def kill_and_start(self) -> None:
        before = self.address
        self.kill()
        assert self.start() == before  # open pages go on at the same address


@pytest.fixture
def app(tmp_path: Path) -> Iterator[App]:
    made = App(tmp_path / "club")
    made.start()
    yield made
    made.kill()


@pytest.fixture(scope="module")
def filmed(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Any, np.ndarray]:
    """A small film of a short throw, the scene of its camera, and where the stone came to rest."""
    ice = load_ice("standard")
    release = Throw(speed=1.2, angle=0.02, spin=1.2).release(Direction.AWAY)
    path = slide(ice, release, bounds=play_bounds(ice, release.direction), fps=60.0).trajectory
    spec = FilmSpec(
        camera="gantry", size=(640, 360), fps=5.0, people=False, noise=1.0, lead_in=0.5, tail=0.5
    )
    film = tmp_path_factory.mktemp("films") / "draw.mp4"
    render_film(film, path, spec)
    return film, scene_of(spec.resolved(), sheet=PAPER_SHEET, stone=RULE_BOOK_STONE), path.xy[-1]


def open_page(browser: Any, errors: list[str], **about: Any) -> Any:
    """A page under the app's own policy; what it complains of is collected."""
    page = browser.new_context(**about).new_page()
    page.set_default_timeout(PATIENCE)
    page.on("pageerror", lambda error: errors.append(str(error)))

    def note(message: Any) -> None:
        # While the server is down, what is asked cannot be loaded; that is what is tested.
        if message.type == "error" and "Failed to load resource" not in message.text:
            errors.append(message.text)

    page.on("console", note)
    return page


def fits(page: Any) -> bool:
    return page.evaluate("document.documentElement.scrollWidth <= innerWidth")


@pytest.mark.slow
def test_an_evening_from_dropped_films_to_the_ice(browser, app, filmed):
    from playwright.sync_api import expect

    expect.set_options(timeout=PATIENCE)
    film, scene, rest = filmed
    errors: list[str] = []
    coach = open_page(browser, errors, viewport=LAPTOP)
    coach.goto(app.address)
    coach.get_by_label("Name", exact=True).fill("Tuesday draws")
    coach.get_by_label("Sheet", exact=True).fill("Sheet 2")
    coach.locator("select[name=camera]").select_option("new")
    coach.get_by_label("Its name").fill("above the middle")
    coach.locator("select[name=size]").select_option("44.5x4.5")
    coach.get_by_role("button", name="Begin").click()
    expect(coach.get_by_role("heading", level=1)).to_have_text("Tuesday draws")
    here = coach.url

    # A film that is none, in three pieces; the power goes between them.
    broken = film.with_name("broken.mp4")
    broken.write_bytes(np.random.default_rng(0).bytes(9 << 20))
    pieces = 0

    def cut_the_power(route: Any) -> None:
        nonlocal pieces
        pieces += 1
        if pieces == 2:
            app.kill()
            route.abort()
            app.start()
        else:
            route.continue_()

    coach.evaluate("window.isTheSame = true")
    coach.route("**/practice/films/*", cut_the_power)
    coach.locator("#files").set_input_files(broken)
    films = coach.locator("#films li")
    expect(films).to_have_count(1)
    expect(films.first).to_contain_text("waiting")
    coach.unroute("**/practice/films/*")
    (kept,) = (app.folder / "sessions").glob("*/films/*.mp4")
    assert kept.read_bytes() == broken.read_bytes()

    # The film itself is dropped onto the page.
    data = coach.evaluate_handle(
        """async (text) => {
            const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
            const data = new DataTransfer();
            data.items.add(new File([bytes], "draw.mp4", { type: "video/mp4" }));
            return data;
        }""",
        base64.b64encode(film.read_bytes()).decode(),
    )
    coach.dispatch_event("#drop", "drop", {"dataTransfer": data})
    expect(films).to_have_count(2)
    expect(coach.get_by_role("link", name="Mark the sheet")).to_be_visible()
    assert coach.evaluate("window.isTheSame")  # a reload would lose films that wait

    # Another person watches on a phone.
    athlete = open_page(browser, errors, viewport=PHONE, has_touch=True, color_scheme="dark")
    athlete.goto(here)
    expect(athlete.locator("#films li")).to_have_count(2)
    assert fits(athlete)

    with coach.context.expect_page() as opened:
        coach.get_by_role("link", name="Mark the sheet").click()
    marking = opened.value
    clicks = dict(zip(CORNERS, scene.points_px.tolist(), strict=True))
    saved = marking.evaluate(
        """async (clicks) => (await fetch("save", {
            method: "POST", body: JSON.stringify({ clicks }) })).json()""",
        clicks,
    )
    assert saved == {"problem": None}
    marking.close()

    # The power goes while it is being tracked; both pages go on by themselves.
    expect(coach.locator("#jobs")).to_contain_text("Tracking")
    app.kill_and_start()
    expect(films.nth(0)).to_contain_text("not tracked")
    expect(films.nth(1)).to_contain_text("1 throw")
    expect(athlete.locator("#count")).to_have_text("1 throw in all.")
    (tracks,) = (app.folder / "sessions").glob("*/tracks.csv")
    assert np.hypot(*(read_tracks(tracks)[0].xy[-1] - rest)) < 0.05

    # The power goes right after the coach has entered who it was.
    coach.get_by_role("link", name=re.compile("^1: ")).click()
    expect(coach.locator("#curve polyline")).to_be_visible()
    coach.get_by_label("Athlete").fill("Anna <b>")
    coach.get_by_label("Called").fill("draw button out")
    coach.get_by_label("missed").check()
    coach.get_by_role("button", name="Save").click()
    expect(coach.locator("#read")).to_contain_text("Read as: draw, button, out-turn")
    # And while the ice is being estimated.
    athlete.get_by_role("button", name="Estimate the ice").click()
    expect(athlete.locator("#jobs")).to_contain_text("Estimating the ice")
    time.sleep(0.5)
    app.kill_and_start()
    coach.get_by_role("link", name="All throws").click()
    expect(coach.get_by_label("Athlete of throw 1")).to_have_value("Anna <b>")
    coach.goto(here)
    expect(coach.locator("#jobs")).to_contain_text("Estimating the ice: done")
    assert read_ice(tracks.with_name("ice.json")).friction.mu.mean() > 0.001

    # The athlete plans a draw with the phone: the answer is there at once, above the fold.
    athlete.get_by_role("link", name="Plan", exact=True).click()
    expect(athlete.locator("#answer")).to_contain_text("split")
    box = athlete.locator("#answer").bounding_box()
    assert box["y"] + box["height"] <= PHONE["height"]
    assert fits(athlete)

    # The ice technician enters the pebble, reads a place of the map, and prints the page.
    technician = open_page(browser, errors, viewport=LAPTOP)
    technician.goto(here)
    technician.get_by_text("Ice conditions, name, day and sheet").click()
    technician.get_by_label("Pebble").fill("fine, 44 °C")
    technician.locator("form[action$=correct]").get_by_role("button", name="Save").click()
    expect(technician.locator("form[action$=correct]")).to_contain_text("Done.")
    technician.get_by_role("link", name="Ice", exact=True).click()
    expect(technician.get_by_role("heading", level=1)).to_contain_text("Ice: Tuesday draws")
    expect(technician.locator("#season")).to_contain_text("fine, 44 °C")
    technician.locator("#map").click(position={"x": 300, "y": 110})
    expect(technician.locator("#reading")).to_contain_text("home tee")
    assert technician.pdf().startswith(b"%PDF")
    assert errors == []


@pytest.fixture
def stream(filmed, tmp_path) -> Iterator[str]:
    """The address of a made-up camera: the film as a transport stream over HTTP."""
    path = tmp_path / "camera.ts"
    with av.open(str(filmed[0])) as film, av.open(str(path), "w", format="mpegts") as out:
        video = film.streams.video[0]
        copied = out.add_stream_from_template(video)
        for packet in film.demux(video):
            if packet.dts is not None:
                packet.stream = copied
                out.mux(packet)
    handler = partial(SimpleHTTPRequestHandler, directory=tmp_path)
    with ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        Thread(target=server.serve_forever, daemon=True).start()
        yield f"http://127.0.0.1:{server.server_address[1]}/camera.ts"
        server.shutdown()


def test_a_camera_that_films_now_gives_films_that_are_tracked(tmp_path, filmed, stream):
    from agents.app.work import recording

    film, scene, rest = filmed
    club = Club(tmp_path / "club")
    save_scene(scene, club.path("cameras/middle.scene.json"))
    with club.database.writing() as connection:
        size = {"length": 44.5, "width": 4.5}
        number = added(
            connection, "camera", name="middle", scene="cameras/middle.scene.json", **size
        )
    session = club.add_session("Tuesday", "2026-11-17", "2", club.camera(number))
    for source in ("/etc/passwd", "file:///etc/passwd", "concat:/etc/passwd", "-1", str(film)):
        with pytest.raises(InputError, match="camera index"):
            recording.do_record(club, session, Reported(club, 1), source)
    recording.do_record(club, session, Reported(club, 1), stream)
    (kept,) = club.films(session)
    assert kept.is_whole
    assert abs(club.path(kept.file).stat().st_size / film.stat().st_size - 1) < 0.5
    (job,) = jobs(club, session)
    assert (job.kind, job.state) == ("track", "waiting")
    # The first numbers are there before the film is tracked.
    seen = sheet_seen_live(club, session).measures
    found = to_delivery(rest, seen.direction)
    assert club.session(session.id).live_rests
    assert np.hypot(seen.right.value - found[0], seen.past.value - found[1]) < 0.1


def test_a_camera_that_was_moved_is_marked_from_a_film_on(visitor, filmed):
    film, scene, _ = filmed
    club = visitor.club
    save_scene(scene, club.path("cameras/middle.scene.json"))
    with club.database.writing() as connection:
        size = {"length": 44.5, "width": 4.5}
        number = added(
            connection, "camera", name="middle", scene="cameras/middle.scene.json", **size
        )
    session = club.add_session("Tuesday", "2026-11-17", "2", club.camera(number))
    content = film.read_bytes()
    first, second, third = (
        add_piece(club, begin_film(club, session, f"{name}.mp4", len(content)), 0, content)
        for name in "abc"
    )
    with club.database.writing() as connection:
        query = "update film set state = ?, said = ? where id = ?"
        connection.execute(query, ("done", "", first.id))
        connection.execute(query, ("failed", "the camera has moved", second.id))
    result = state_of(club, session)["films"]
    assert [one["mark"] for one in result] == [False, True, False]
    page = f"practice/{session.id}/films/{second.id}/mark/{visitor.token}"
    moved = scene.points_px + np.array([40.0, 25.0])
    clicks = {"clicks": dict(zip(CORNERS, moved.tolist(), strict=True))}
    assert visitor.send(f"{page}/save", clicks).document == {"problem": None}
    session = club.session(session.id)
    new = club.camera(session.camera_id)
    assert new.name == "middle, from b.mp4 on"
    assert (load_scene(club.path(new.scene)).points_px == moved).all()
    assert (load_scene(club.path("cameras/middle.scene.json")).points_px == scene.points_px).all()
    seen = [club.camera_of(session, club.film(one.id)).id for one in (first, second, third)]
    assert seen == [number, new.id, new.id]
    assert [club.film(one.id).state for one in (first, second)] == ["done", "waiting"]
    assert [job.kind for job in jobs(club, session)] == ["track"]
    assert visitor.get(f"practice/{session.id}/films/99/mark/{visitor.token}/").status == 404


def test_a_film_that_a_browser_does_not_play_gets_a_copy(visitor, work_off, tmp_path):
    club = visitor.club
    session = club.add_session("Tuesday", "2026-11-17", "2", None)
    path = club.folder / "films" / "old.avi"
    frames = np.arange(12)
    with film_writer(path, (330, 180), 6.0) as writer:  # Motion JPEG
        for k in frames:
            writer.write(np.full((180, 330, 3), 20 * k, np.uint8))
    film = take_film(club, session, path)
    address = f"throws/films/{film.id}/copy"
    assert visitor.get(address).status == 404
    asked = visitor.send(address, {}).document
    assert visitor.send(address, {}).document == asked  # once is enough
    assert work_off(club) == ["copy"]
    answer = visitor.get(address)
    assert answer.headers["content-type"] == "video/mp4"
    copy = tmp_path / "copy.mp4"
    copy.write_bytes(answer.body)
    times, grey = zip(*((t, frame.mean()) for t, frame in Film.open(copy).frames()), strict=True)
    assert np.allclose(times, frames / 6.0, atol=1e-3)
    assert np.allclose(grey, 20 * frames, atol=4)
