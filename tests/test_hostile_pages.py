"""Pages made of a stranger's files: names are shown, scripts never run."""

from __future__ import annotations

import json
import re

import cv2
import numpy as np

EVIL = "<img src=x onerror=\"document.title='PWNED'\"><script>document.title='PWNED'</script>"
SCHEME = "</script><script>document.title='PWNED'</script>"
NAME = "<img src=x onerror=document.title='PWNED'>"
"""The same without characters that file names cannot have."""
POLICY = re.compile(
    r'^.{0,120}?<meta http-equiv="Content-Security-Policy" content="([^"]*)">', re.S
)


def check(browser, page, address, *, shows):
    """Check that nothing in a page's content runs, with and without its policy, and that names are
    read.
    """
    strict = browser.new_page()
    for shown in (strict, page):
        asked: list[str] = []
        shown.on("request", lambda request, asked=asked: asked.append(request.url))
        shown.goto(address)
        for _ in range(600):  # a served page asks for its names first
            shown.wait_for_timeout(100)
            words = shown.evaluate("document.documentElement.textContent")
            if all(text in words for text in shows):
                break
        assert shown.title() != "PWNED"
        assert shown.locator("img[src=x]").count() == 0
        assert all(text in words for text in shows), words[:2000]
        own = address.rsplit("/", 1)[0]
        assert [url for url in asked if not url.startswith(("data:", own))] == []
    strict.close()


def policy_in(path) -> str:
    """Return the policy of a page, which comes before any content of files."""
    found = POLICY.search(path.read_text())
    assert found is not None, path.read_text()[:300]
    assert "default-src 'none'" in found[1]
    assert "unsafe-inline" not in re.search(r"script-src [^;]*", found[1])[0]
    return found[1]


def test_the_report_of_an_estimate(curling, browser, page, tmp_path):
    (tmp_path / "r.csv").write_text(
        "throw,x,y,vx,vy,theta,omega\n"
        + "".join(f"{k},0,-10.9725,0,{2 + 0.1 * k},0,1.5\n" for k in range(3))
    )
    tracks = tmp_path / f"{NAME}.csv"
    made = curling("simulate", "--ice", "paper", "--releases", tmp_path / "r.csv", "-o", tracks)
    assert made.status == 0
    notes = ["throw,athlete,stone,called,note", *(f"{k},{NAME},{k},{NAME},{NAME}" for k in (0, 1))]
    (tmp_path / "throws.csv").write_text("\n".join(notes))
    done = curling(
        "estimate", tracks, "--uniform", "--effects", "none", "-o", tmp_path / "ice.json",
        "--report", tmp_path / "report",
    )  # fmt: skip
    assert done.status == 0, done.err
    shown = tmp_path / "report" / "report.html"
    assert "script-src 'none'" in policy_in(shown)
    check(browser, page, shown.as_uri(), shows=[NAME, f"{NAME}.csv"])


def test_the_page_of_a_game(curling, browser, page, tmp_path):
    played = curling("play", "--home", "draw", "--away", "draw", "--ends", 1, "-o", tmp_path)
    assert played.status == 0
    lines = [json.loads(line) for line in (tmp_path / "game.jsonl").read_text().splitlines()]
    lines[0] |= {"home": EVIL, "away": SCHEME, "ice": EVIL, "rules": EVIL}
    for line in lines[1:-1]:
        line["shot"] = EVIL
    (tmp_path / "evil.jsonl").write_text("\n".join(map(json.dumps, lines)))
    shown = tmp_path / "evil.html"
    assert curling("replay", tmp_path / "evil.jsonl", "-o", shown).status == 0
    policy_in(shown)
    check(browser, page, shown.as_uri(), shows=[EVIL, SCHEME])
    for name in ("line_score", "hammers", "winner"):
        bad = [*lines[:-1], {**lines[-1], name: [[EVIL, 0]]}]
        (tmp_path / "evil.jsonl").write_text("\n".join(map(json.dumps, bad)))
        refused = curling("replay", tmp_path / "evil.jsonl", "-o", tmp_path / "no.html")
        assert name in refused.complaint


def test_the_page_on_which_a_sheet_is_marked(browser, page, tmp_path):
    from curling_env.sheet import PAPER_SHEET
    from friction_estimation.camera import Annotation, AnnotationServer

    picture = tmp_path / f"{NAME}.png"
    cv2.imwrite(str(tmp_path / "a.png"), np.full((90, 160, 3), 200, np.uint8))
    (tmp_path / "a.png").rename(picture)
    annotation = Annotation.open(picture, PAPER_SHEET)
    with AnnotationServer(annotation, lambda scene: None) as server:
        check(browser, page, server.url, shows=[NAME])


def test_a_report_that_holds_a_strangers_names(page, tmp_path):
    from friction_estimation.reports import write_page
    from friction_estimation.reports.html import table

    shown = tmp_path / "page.html"
    origin = {"version": "1", "inputs": [{"file": EVIL, "sha256": None}], "command": EVIL}
    write_page(shown, EVIL, [table(["a"], [["b"]])], reload=60, provenance=origin)
    assert "script-src 'none'" in policy_in(shown)
    page.goto(shown.as_uri())
    assert page.title() == EVIL
    assert page.locator("img[src=x]").count() == 0
