"""Entries and films of a coach are kept, whatever the page, the network or others do."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("starlette", reason="the extra `app` is not installed")

from agents.app import Club
from agents.app.take_in import take_in
from curling_env.ice import load_ice, save_ice
from curling_env.physics import slide
from curling_env.throw import Throw
from curling_env.trajectory import write_tracks

PHONE = {"width": 390, "height": 844}
PIECES = [("one.mp4", 5), ("notes.txt", 1), ("two.mp4", 6), ("three.mp4", 7), ("four.mp4", 5)]
"""Names of files that are dropped, and their sizes [bytes]."""


@pytest.fixture(scope="module")
def club(tmp_path_factory: pytest.TempPathFactory) -> Club:
    """A club with four throws of Anna and Ben in turn, and their ice."""
    folder: Path = tmp_path_factory.mktemp("evening")
    ice = load_ice("standard")
    tracks = [
        slide(ice, Throw(speed=2.05 + 0.02 * k, angle=0.05, spin=-1.2).release(), fps=10.0, throw=k)
        for k in range(4)
    ]
    write_tracks(folder / "tracks.csv", [one.trajectory for one in tracks if one.trajectory])
    rows = [f"{k},{('Anna', 'Ben')[k % 2]},draw button" for k in range(4)]
    (folder / "throws.csv").write_text("\n".join(["throw,athlete,called", *rows]))
    save_ice(ice, folder / "ice.json")
    club = Club(tmp_path_factory.mktemp("club"))
    take_in(club, folder, name="Tuesday", day="2026-11-17", sheet="Sheet 2")
    return club


@pytest.fixture(scope="module")
def address(club: Club, serve_club: Callable[..., Any]) -> Iterator[str]:
    with serve_club(club) as address:
        yield address


@pytest.fixture
def context(browser: Any) -> Iterator[Any]:
    made = browser.new_context(
        viewport=PHONE, has_touch=True, is_mobile=True, reduced_motion="reduce"
    )
    made.set_default_timeout(25_000)
    yield made
    made.close()


def entry(club: Club, label: int) -> Any:
    (session,) = club.sessions()
    return next(one for one in club.throws(session) if one.label == label)


def eventually(page: Any, is_so: Callable[[], bool]) -> None:
    for _ in range(300):
        if is_so():
            return
        page.wait_for_timeout(100)
    assert is_so()


def test_films_go_on_being_sent_whatever_page_is_open(context, address, club):
    page = context.new_page()
    page.goto(f"{address}practice/1")
    context.route("**/practice/films/*", lambda route: None)  # nothing arrives yet
    films = [
        {"name": name, "mimeType": "video/mp4", "buffer": bytes(size)} for name, size in PIECES
    ]
    page.locator("#files").set_input_files(films)
    page.locator("#films li").first.wait_for()
    page.goto(f"{address}throws/1")  # and away, in the middle of it
    page.get_by_text("Sending 5 films").wait_for()
    context.unroute("**/practice/films/*")
    page.reload()
    (session,) = club.sessions()
    eventually(page, lambda: sum(film.is_whole for film in club.films(session)) == 4)
    sizes = {film.name: film.size for film in club.films(session)}
    assert sizes == {name: size for name, size in PIECES if name.endswith(".mp4")}
    # The refusal is still shown after others have arrived.
    page.goto(f"{address}practice/1")
    page.get_by_text("notes.txt: unsupported file extension").wait_for()


def test_what_is_typed_is_saved_by_going_on(context, address, club):
    page = context.new_page()
    page.goto(f"{address}throws/1/1")
    note = "late release\n" + 3000 * "x"
    page.get_by_label("Note").fill(note)
    page.get_by_role("link", name="Next").click()
    page.get_by_role("heading", name="Throw 2").wait_for()
    eventually(page, lambda: entry(club, 1).note == note)
    page.go_back()
    assert page.get_by_label("Note").input_value() == note


def test_what_is_typed_without_a_network_is_saved_when_it_is_back(context, address, club):
    page = context.new_page()
    page.goto(f"{address}throws/1/2")
    page.locator("#curve polyline").wait_for()
    page.get_by_label("Number of another throw").fill("4")  # and leaves the field
    page.get_by_label("Called").focus()
    page.locator("#above .path.away").wait_for()
    assert page.locator("#above .path").count() == 2
    context.set_offline(True)
    page.get_by_label("Called").fill("draw button in")
    page.get_by_role("button", name="Save").click()
    page.get_by_text("The app does not answer. This is kept in this browser").wait_for()
    page.close()  # as if the browser had been closed, too
    context.set_offline(False)
    page = context.new_page()
    page.goto(f"{address}practice/1")
    eventually(page, lambda: entry(club, 2).called == "draw button in")


def test_two_coaches_do_not_overwrite_each_other(context, address, club):
    mine, theirs = context.new_page(), context.new_page()
    for page in (mine, theirs):
        page.goto(f"{address}throws/1/3")
    theirs.get_by_label("Called").fill("guard out")
    theirs.get_by_label("made", exact=True).check()
    theirs.get_by_text("Saved.", exact=True).wait_for()
    mine.get_by_label("Note").fill("hurried")
    mine.get_by_role("button", name="Save").click()
    mine.get_by_text("Saved.", exact=True).wait_for()
    kept = entry(club, 3)
    assert (kept.called, kept.made, kept.note) == ("guard out", True, "hurried")
    assert mine.get_by_label("Called").input_value() == "guard out"
    # Where both change the same, the later one is asked.
    theirs.get_by_label("Called").fill("draw button in")
    theirs.get_by_label("Called").press("Enter")
    theirs.get_by_text("Read as: draw, button, in-turn.").wait_for()
    mine.get_by_label("Called").fill("draw top four")
    mine.get_by_label("Called").press("Enter")
    mine.get_by_text("Someone else has changed this").wait_for()
    assert entry(club, 3).called == "draw button in"
    mine.get_by_role("button", name="Keep mine").click()
    eventually(mine, lambda: entry(club, 3).called == "draw top four")


def test_a_throw_is_opened_by_its_row_and_entered_in_the_list(context, address, club):
    page = context.new_page()
    page.goto(f"{address}throws/1?athlete=Ben")
    call = page.get_by_label("Call of throw 4")
    call.fill("draw button wobbly")
    for place in (".reading", "#tap"):  # beside the field, and beside the house that stays in sight
        words = page.locator(place).get_by_text(
            "“wobbly” is not a word of a call; kept as a remark."
        )
        words.wait_for()
    call.fill("draw in")
    # A tap on the house fills in the place.
    page.wait_for_timeout(300)  # the house comes into sight
    x, y = page.evaluate(
        """() => { const world = document.querySelector("#house > g");
          const at = new DOMPoint(0.5, 17.0).matrixTransform(world.getScreenCTM());
          return [at.x, at.y]; }"""
    )
    page.touchscreen.tap(x, y)
    eventually(page, lambda: re.fullmatch(r"draw in 0\.\d\d,-0\.\d\d", entry(club, 4).called))
    page.locator("tr[data-throw='4'] td[data-label=Rest]").tap()
    page.get_by_role("heading", name="Throw 4").wait_for()
    assert (
        page.get_by_role("link", name="Previous")
        .get_attribute("href")
        .endswith("/throws/1/2?athlete=Ben")
    )


def test_a_game_goes_on_after_an_answer_that_never_came(context, address):
    page = context.new_page()
    # In a game that the other team begins, a stone may lie on the button already.
    for _ in range(20):
        page.goto(f"{address}throw#mode=play")
        page.get_by_text("A new game").wait_for()
        page.get_by_role("button", name="New game").click()
        page.get_by_text("Click where it should rest").first.wait_for()
        if "hammer" not in page.locator("#standing").inner_text():
            break
        page.evaluate("localStorage.clear()")
        page.goto("about:blank")
    page.get_by_role("button", name="Aim at the button").last.click()
    page.get_by_role("button", name="Throw it").wait_for()
    page.route("**/throw/game", lambda route: route.abort())
    page.get_by_role("button", name="Throw it").click()
    page.get_by_text("The app does not answer").wait_for()
    page.unroute("**/throw/game")
    page.get_by_role("button", name="Aim at the button").last.click()
    page.get_by_role("button", name="Throw it").wait_for()


def test_the_list_is_printed_whole_and_in_colour(browser, address):
    page = browser.new_page(viewport={"width": 1040, "height": 720})
    page.goto(f"{address}throws/1")
    page.emulate_media(media="print")
    box = page.locator("table.throws").bounding_box()
    assert box["x"] + box["width"] <= 1040
    assert page.locator("main").evaluate("(it) => getComputedStyle(it).printColorAdjust") == "exact"
    heights = page.evaluate(
        "[...document.querySelectorAll('.card')].map((it) => getComputedStyle(it).breakInside)"
    )
    assert heights[-1] == "auto"  # a long table begins on the first page
    page.close()


def test_the_button_is_planned_at_once_above_the_fold(context, address):
    page = context.new_page()
    page.goto(f"{address}throw")
    page.locator("#answer:visible").wait_for()
    box = page.locator("#answer").bounding_box()
    assert box["y"] + box["height"] <= PHONE["height"]
    words = page.locator("#answer").inner_text()
    assert re.search(r"\d\d\.\d s\s+split (about )?\d\.\d\d s", words), words
    assert re.search(r"(in|out)-turn", words)
    assert np.isfinite(float(re.search(r"Ice\s+(\d+(\.\d+)?)", words)[1]))
    # An athlete's own hand is planned with the next time, too.
    page.locator("#skill").select_option("elite")
    page.goto(f"{address}practice")
    page.goto(f"{address}throw")
    page.locator("#answer:visible").wait_for()
    assert page.locator("#skill").input_value() == "elite"
