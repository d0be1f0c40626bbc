"""The report of an athlete: one file that holds all that it shows, on one page."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest

pytest.importorskip("starlette", reason="the extra `app` is not installed")

from agents.app import Club, Part, keep_part, take_film
from curling_env.ice import load_ice
from curling_env.physics import slide
from curling_env.throw import Throw
from friction_estimation.film import film_writer


@pytest.fixture
def filmed(club: Club) -> Any:
    """A session with five throws of Anna and one of Ben, each filmed."""
    session = club.add_session("Tuesday", "2026-11-17", "2", None)
    club.change(
        "session", session.id, lineup="Anna, Anna, Anna, Anna, Anna, Ben", drill="draw button in"
    )
    for k in range(6):
        throw = Throw(speed=1.96 + 0.03 * k, angle=0.05, spin=-1.2)
        track = slide(load_ice("standard"), throw.release(), fps=10.0).trajectory
        path = club.folder / "films" / f"{k}.mp4"
        with film_writer(path, (330, 180), 4.0) as writer:
            for n in range(40):
                writer.write(np.full((180, 330, 3), 6 * n, np.uint8))
        film = take_film(club, session, path)
        club.change("film", film.id, state="done")
        keep_part(club, session, film, Part(throws=[[track]], handles=[[None]]))
    return session


def test_an_athletes_evening_is_one_file_with_clips(browser, visitor, filmed, work_off, tmp_path):
    anna = next(one for one in visitor.club.athletes() if one.name == "Anna")
    address = f"athletes/{filmed.id}/{anna.id}/report"
    assert visitor.get(address).status == 202  # it is being made
    assert work_off(visitor.club) == ["report"]
    answer = visitor.get(address)
    assert answer.status == 200
    assert "default-src 'none'" in answer.headers["content-security-policy"]
    assert not re.search(r"(src|href)=\"(?!data:)", answer.text)  # nothing from elsewhere
    assert "Ben" not in answer.text
    assert "5 throws this evening" in answer.text
    path = tmp_path / "report.html"
    path.write_bytes(answer.body)
    page = browser.new_page()
    page.goto(path.as_uri())
    assert page.locator("video").count() == 4
    page.wait_for_function(
        "[...document.querySelectorAll('video')].every((it) => it.readyState > 0)"
    )
    assert page.evaluate("document.querySelector('video').videoWidth") == 330
    assert len(re.findall(rb"/Type\s*/Page\b", page.pdf(format="A4"))) == 1
    page.close()
    # Another entry makes it again.
    visitor.post(f"throws/{filmed.id}/1", {"called": "guard in"})
    assert visitor.get(address).status == 202
    assert visitor.get(f"athletes/{filmed.id}/99/report").status == 404
    # Clips are of filmed throws, also where others were better and worse.
    for throw in visitor.club.throws(filmed)[:2]:
        visitor.club.change("throw", throw.id, film_id=None)
    assert work_off(visitor.club) == ["report"]
    assert visitor.get(address).text.count("<video") == 3
