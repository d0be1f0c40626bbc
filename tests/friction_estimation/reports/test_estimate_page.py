"""An estimate as a page: what a coach reads first is there, and the page needs nothing else."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
import pytest

from curling_env.ice import Ice, load_ice
from curling_env.infrastructure import read_table
from curling_env.sheet import HOG_LINE_Y, TEE_Y
from friction_estimation import estimate_ice
from friction_estimation.reports import DrawWeight, Still, headline, write_report


@pytest.fixture(scope="module")
def found(sliding):
    rng = np.random.default_rng(5)
    tracks = sliding.measured_throws(
        sliding.uniform(0.0085), sliding.varied_starts(rng, 4), rng, rest=0.5
    )
    return estimate_ice(tracks, effects="none")


@pytest.mark.parametrize(
    ("mu", "word"),
    [
        (0.0020, "keener than any curling ice"),
        (0.0060, "keen"),
        (0.0085, "of usual speed"),
        (0.0110, "heavy"),
    ],
)
def test_the_headline_says_how_fast_the_ice_is(found, mu, word):
    sentence = headline(replace(found, mu=mu, uniform=True))
    assert sentence.startswith(f"This ice is {word}: ")
    assert float(sentence.rsplit("= ")[1].rstrip(".")) == pytest.approx(mu, rel=0.01)


def test_the_page_opens_alone_with_all_its_pictures(found, page, tmp_path):
    folder = tmp_path / "made"
    folder.mkdir()
    jpeg = cv2.imencode(".jpg", np.full((90, 160, 3), 200, np.uint8))[1].tobytes()
    stills = [Still(film="<end>.mp4", t=t, jpeg=jpeg) for t in (2.0, 9.5)]
    names = write_report(found, folder, stills)
    assert {path.name for path in folder.iterdir()} == set(names)
    alone = tmp_path / "report.html"
    (folder / "report.html").rename(alone)
    page.goto(alone.as_uri())
    assert page.inner_text("h1") == headline(found)
    widths = page.evaluate("[...document.images].map(image => image.naturalWidth)")
    assert len(widths) == 4 + len(stills)
    assert min(widths) >= 160
    captions = page.locator("figcaption").all_inner_texts()
    assert "<end>.mp4, 9.5 s" in captions
    assert page.locator("table").last.locator("tr").count() == 1 + len(found.slides)
    assert "the paper's method" in page.locator("table").nth(-2).inner_text()
    assert "further for a draw" in page.inner_text(".facts")
    assert "hog to hog" in page.locator("table").first.inner_text()
    # Nothing lies beside the screen, at a desk or on a telephone.
    for width in (1280, 390):
        page.set_viewport_size({"width": width, "height": 800})
        assert page.evaluate("document.documentElement.scrollWidth") <= width


def test_every_row_says_whether_it_was_used_and_what_was_left_out_is_reported(
    sliding, tmp_path, unchanged
):
    rng = np.random.default_rng(8)
    tracks = sliding.measured_throws(
        sliding.uniform(0.0085), sliding.varied_starts(rng, 3), rng, rest=1.0
    )
    jumped = tracks[0].xy.copy()
    jumped[[100, 250]] += 0.8
    wild = replace(tracks[0], xy=jumped)
    short = type(wild)(t=wild.t[:8], xy=wild.xy[:8], throw=9)
    found = estimate_ice([wild, *tracks[1:], short], uniform=True)
    write_report(found, tmp_path)
    page = (tmp_path / "report.html").read_text()
    assert "Excluded" in page
    assert "throw 9" in page
    assert "Excluded" not in headline(found)
    table = read_table(tmp_path / "rows.csv", required=("throw", "t", "use", "left_m"))
    use = np.array(table.text("use"))
    assert len(table) == sum(len(track) for track in tracks)
    assert set(use) <= {"before", "used", "wild", "unlike", "after"}
    assert (use[[100, 250]] == "wild").all()
    assert 2 <= (use == "wild").sum() <= sum(slide.wild for slide in found.slides)
    assert (use == "after").sum() > 60
    left = table.numbers("left_m", blank=True)
    assert np.isfinite(left[use == "used"]).all()
    assert np.isnan(left[use == "after"]).all()
    unchanged.page(page)


def test_a_draw_is_that_of_the_closed_form():
    """Constant friction takes v²/(2μg) to stop, and times are those of a parabola."""
    even, whole = DrawWeight(Ice.uniform(0.02), 0.009), HOG_LINE_Y + TEE_Y
    speed = np.sqrt(2 * 9.80665 * 0.009 * whole)
    assert even.speed == pytest.approx(speed, rel=1e-3)
    assert even.seconds == pytest.approx(2 * whole / speed, rel=1e-3)
    passed = speed - np.sqrt(speed**2 - 2 * 9.80665 * 0.009 * 2 * HOG_LINE_Y)
    assert even.hog_to_hog == pytest.approx(passed / (9.80665 * 0.009), rel=1e-3)
    assert even.curl is None


def test_the_curl_of_a_draw_is_to_one_side_of_its_line():
    """The preset's draw with three turns; `curling validate` has 1.47 m for 1 rad/s."""
    curl = DrawWeight(load_ice("standard"), 0.0082).curl
    assert curl == pytest.approx(1.47, abs=0.1)


def test_a_per_cent_is_worth_what_the_formulas_say():
    """Constant friction: a draw of d metres runs d/100 further, and splits change as √(d/μ)."""
    ice = Ice.uniform(0.009)
    further, longer = DrawWeight(ice, 0.009).worth_of_a_per_cent
    between, whole = 2 * HOG_LINE_Y, HOG_LINE_Y + TEE_Y
    assert further == pytest.approx(whole / 100, rel=0.03)
    split = np.sqrt(2 / (9.80665 * 0.009)) * (np.sqrt(whole) - np.sqrt(whole - between))
    assert longer == pytest.approx(0.005 * split, rel=0.05)
