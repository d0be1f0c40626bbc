from __future__ import annotations

import json
import re

import pytest

from curling_env.ice import load_ice
from curling_env.sheet import HOG_LINE_Y, TEE_Y
from curling_env.trajectory import write_tracks
from friction_estimation.discovery import can_write_posterior

from .conftest import effect


@pytest.fixture
def twice(curling, make_session, tmp_path):
    """Two folders of results from the same tracks with the same seed, and the printed output."""
    tracks = make_session([effect("curl", strength=0.006)], throws=9, fps=5)
    write_tracks(tmp_path / "tracks.csv", tracks)
    for folder in ("one", "two"):
        result = curling("discover", tmp_path / "tracks.csv", "-o", tmp_path / folder, "--seed", 5)
        assert result.status == 0, result.err
    return tmp_path / "one", tmp_path / "two", result.json(), result.err


def test_report_ice_and_page(twice, must_fit, unchanged, request):
    found, again, printed, messages = twice
    report = json.loads((found / "report.json").read_text())
    unchanged.document(report)
    unchanged.page((found / "report.html").read_text())
    must_fit(found / "report.json", "report-1")
    must_fit(found / "ice.json", "ice-1")
    (curl,) = report["effects"]
    assert curl["name"] == "curl"
    assert curl["kind"] == "physics"
    assert set(curl["parameters"]["strength"]) == {"value", "stderr", "unit"}
    assert {"depends_on", "where", "evidence", "alternatives"} <= set(curl)
    for when in ("before", "after", "noise_floor"):
        assert set(report["gap"][when]) == {"path_rms_m", "rest_error_m"}
    assert report["gap"]["held_out_throws"]
    assert printed["verdict"] == report["verdict"]
    sentence = r"The model lacks curl: fresh throws now stop [\d.]+ cm from the forecast, not \d+\."
    assert re.fullmatch(sentence, report["verdict"])
    assert report["verdict"] in messages.splitlines()
    assert len(report["next_throws"]) == 3
    assert f"Most informative next throw: {report['next_throws'][0]['words']}." in messages
    assert {"curl", "friction"} == set(report["next_throws"][0]["teaches"])
    assert printed["next_throws"] == report["next_throws"]
    assert load_ice(found / "ice.json").effect("curl") is not None
    assert not load_ice(found / "baseline.json").effects
    text = (found / "report.html").read_text()
    assert report["verdict"] in text
    assert "curl of a draw" in text
    assert "hog to hog" in text
    assert "http://" not in text
    assert "https://" not in text
    posterior = ["posterior.nc"] if can_write_posterior() else []
    for name in ("report.json", "ice.json", "baseline.json", "report.html", *posterior):
        content = (found / name).read_bytes()
        assert content == (again / name).read_bytes(), name
        assert str(found.parent).encode() not in content
    origin = report["provenance"]
    assert origin["command"] == "curling discover tracks.csv --seed 5"
    assert origin["seed"] == 5
    assert [entry["file"] for entry in origin["inputs"]] == ["tracks.csv"]
    assert load_ice(found / "ice.json").provenance == origin
    assert origin["inputs"][0]["sha256"] in text
    page = request.getfixturevalue("page")  # without a browser, the rest has been tested
    page.goto((found / "report.html").as_uri())
    assert page.inner_text("h1") == printed["verdict"]
    widths = page.evaluate("[...document.images].map(image => image.naturalWidth)")
    assert len(widths) == 4  # paths before and after, the draw, where curl shows
    assert min(widths) > 300
    assert all(page.evaluate("[...document.images].map(image => image.alt)"))
    first, *others = page.locator("section").all()
    assert first.locator("h1").count() == 1
    assert first.locator("img").count() == 2
    assert "What is missing" in others[0].inner_text()
    assert page.locator("table:visible").count() == 2  # the rest opens on a click
    page.click("summary")
    assert page.locator("table:visible").count() > 4
    assert "to the left" in page.locator("figcaption").nth(2).inner_text()
    for width in (1280, 390):
        page.set_viewport_size({"width": width, "height": 800})
        assert page.evaluate("document.documentElement.scrollWidth") <= width


def test_sweeping_is_reported_in_metres(curling, make_session, tmp_path, unchanged):
    tracks = make_session([effect("sweeping", friction_factor=0.85)], fps=5)
    write_tracks(tmp_path / "tracks.csv", tracks)
    result = curling("discover", tmp_path / "tracks.csv", "-o", tmp_path / "found")
    report = json.loads((tmp_path / "found" / "report.json").read_text())
    (swept,) = report["effects"]
    assert swept["name"] == "sweeping"
    gained, factor = swept["evidence"]["metres_gained"], swept["parameters"]["friction_factor"]
    # On even ice a stone that still has z metres to go runs z / factor.
    third = (HOG_LINE_Y + TEE_Y) / 3
    assert gained["value"] == pytest.approx(third * (1 / factor["value"] - 1), rel=0.03)
    assert gained["stderr"] == pytest.approx(
        third * factor["stderr"] / factor["value"] ** 2, rel=0.05
    )
    gain = f"runs {gained['value']:.2f} ± {gained['stderr']:.2f} m further"
    assert f"A draw swept over the last third of its path {gain}." in report["remarks"]
    assert (
        f"a draw swept over the last third of its path {gain}"
        in (tmp_path / "found" / "report.html").read_text()
    )
    assert result.json()["verdict"] == report["verdict"]
    unchanged.document(report)


def test_what_cannot_be_read_is_one_line(curling, tmp_path):
    (tmp_path / "tracks.csv").write_text("throw,t,x,y\n0,0,0,0\n")
    result = curling("discover", tmp_path / "tracks.csv", "-o", tmp_path / "found")
    assert "theta" in result.complaint


def test_stones_that_never_slide_are_one_line(curling, tmp_path):
    rows = "".join(f"0,{k / 30:.3f},0,0,0\n" for k in range(60))
    (tmp_path / "tracks.csv").write_text("throw,t,x,y,theta\n" + rows)
    result = curling("discover", tmp_path / "tracks.csv", "-o", tmp_path / "found")
    assert "does not move" in result.complaint


def test_unknown_base(curling, make_session, tmp_path):
    write_tracks(tmp_path / "tracks.csv", make_session(throws=2))
    result = curling("discover", tmp_path / "tracks.csv", "--ice", "x.json", "-o", tmp_path)
    assert "no such ice" in result.complaint
