"""Metres or feet, chosen once for numbers, pages, prints and what is typed."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("starlette", reason="the extra `app` is not installed")

from agents.app import Club
from agents.app.rendering import in_units
from agents.app.screens.throws import entry_of
from agents.app.take_in import take_in
from curling_env.ice import load_ice, save_ice
from curling_env.physics import slide
from curling_env.throw import Throw
from curling_env.trajectory import write_tracks
from curling_env.units import Units, shown_in

METRIC = re.compile(r"\d (?:cm|m|mm|m/s)\b")


@pytest.fixture
def evening(club: Club, tmp_path: Path) -> Any:
    """Three draws of Anna on a known ice, which the causes of misses are worked out for."""
    folder, ice = tmp_path / "evening", load_ice("standard")
    folder.mkdir()
    throws = [Throw(speed=2.1 + 0.02 * k, angle=0.05, spin=-1.2) for k in range(3)]
    tracks = [slide(ice, one.release(), fps=10.0, throw=k) for k, one in enumerate(throws)]
    write_tracks(folder / "tracks.csv", [one.trajectory for one in tracks if one.trajectory])
    rows = ["throw,athlete,called", *(f"{k},Anna,draw button" for k in range(3))]
    (folder / "throws.csv").write_text("\n".join(rows))
    save_ice(ice, folder / "ice.json")
    return take_in(club, folder, name="Tuesday", day="2026-11-17", sheet="Sheet 2")


def seen(page: str) -> str:
    """The words of a page, without its scripts, choices of sizes and lists of sessions."""
    page = re.sub(r"<(script|select|style)\b.*?</\1>", " ", page, flags=re.DOTALL)
    return re.sub(r"<[^>]*>", " ", page)


def test_every_page_shows_the_chosen_units(visitor, club, evening, work_off):
    paths = ("practice", "throws", f"throws/{evening.id}/1", "rink", "ice", "throw")
    paths = (*paths, "hand-or-ice", "athletes")
    for path in paths:
        visitor.get(path)
    work_off(club)
    assert len([path for path in paths if METRIC.search(seen(visitor.get(path).text))]) >= 6
    assert visitor.post("units", {"units": "feet"}).status == 303
    for path in paths:
        page = visitor.get(path).text
        assert 'data-units="feet"' in page
        assert not METRIC.findall(seen(page)), path
    assert " ft " in seen(visitor.get("throws").text)
    athlete = club.athletes()[0]
    visitor.get(f"athletes/{evening.id}/{athlete.id}/report")
    work_off(club)
    report = visitor.get(f"athletes/{evening.id}/{athlete.id}/report").text
    assert not METRIC.findall(seen(report))
    assert "average" in report
    assert visitor.post("units", {"units": "miles"}).status == 422


def test_lengths_that_are_typed_are_in_the_chosen_units(visitor, club, evening):
    visitor.post("units", {"units": "feet"})
    assert "4 ft 0 in short" in visitor.get("throws/read?text=draw+4+short").text
    throw = club.throws(evening)[0]
    visitor.post(f"throws/{evening.id}/{throw.label}", {"called": "draw 2,-4 broom 3 right"})
    visitor.post(f"rink/{evening.id}", {"lineup": "Anna", "drill": "draw 4 short"})
    # The call means the same in every unit, and to every command.
    assert club.throw(throw.id).called == "draw 2ft,-4ft broom 3ft right"
    assert club.session(evening.id).drill == "draw 4ft short"
    page = visitor.get(f"throws/{evening.id}/{throw.label}").text
    assert "4 ft 0 in short of the tee" in page
    # A call that was typed in metres is shown in metres, and stays what it was.
    other = club.throws(evening)[1]
    club.change("throw", other.id, called="draw button broom 1.44 left")
    address = f"throws/{evening.id}/{other.label}"
    page = visitor.get(address).text
    assert 'value="draw button broom 1.44m left"' in page
    assert "broom 4 ft 9 in left" in page
    with shown_in(Units.FEET):
        shown = entry_of(club.throw(other.id))
    visitor.post(address, {**shown, "note": "late", "was": json.dumps(shown)})
    kept = club.throw(other.id)
    assert (kept.called, kept.note) == ("draw button broom 1.44 left", "late")
    visitor.post("units", {"units": "metres"})
    assert "1.22 m short of the tee" in visitor.get(f"throws/{evening.id}/{throw.label}").text


def test_plans_are_described_in_the_chosen_units(visitor, evening):
    asked = {"ice": str(evening.id), "target": {"x": 0.3, "y": 17.0}, "skill": "club"}
    visitor.post("units", {"units": "feet"})
    found = visitor.send("throw/plan", asked).document
    words = [found["expectation"], found["miss"]["words"], found["call"]["sentence"]]
    words += [cost["words"] for cost in found["costs"]]
    assert not METRIC.search(" ".join(words))
    assert all(re.search(r"\d (ft|in)\b", one) for one in words[:3])


def test_stored_sentences_are_converted():
    text = "Fresh throws now stop 5 cm from the forecast, not 49."
    assert in_units(text) == text
    with shown_in(Units.FEET):
        assert in_units(text) == "Fresh throws now stop 2 in from the forecast, not 1 ft 7 in."
        assert in_units("at 2.10 m/s, 1.22 m short") == "at 2.10 m/s, 4 ft 0 in short"


def test_a_place_that_is_tapped_is_typed_in_feet(
    browser: Any, club: Club, evening: Any, serve_club: Callable[..., Any]
):
    from playwright.sync_api import expect

    with serve_club(club) as address:
        context = browser.new_context(viewport={"width": 1366, "height": 768})
        context.set_default_timeout(25_000)
        page = context.new_page()
        page.goto(f"{address}throws/{evening.id}")
        page.click("text=Change to feet")
        page.wait_for_selector('html[data-units="feet"]')
        call = page.locator("input[name=called]").first
        expect(page.locator("#house .rest")).to_have_count(3)
        call.fill("draw")
        expect(page.locator("#tap")).to_contain_text("Tap the house where throw 1")
        page.locator("#house .ring").last.click(force=True)
        expect(call).to_have_value(re.compile(r"draw -?[\d.]+ft,-?[\d.]+ft"))
        page.goto(f"{address}throws/{evening.id}/1")
        expect(page.locator("#now")).to_contain_text("ft/s")
        expect(page.locator("#curve")).to_contain_text("ft/s")
        context.close()
