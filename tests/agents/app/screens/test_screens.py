"""Every screen answers, with a session and without one."""

from __future__ import annotations

import re

import pytest

from agents.app.screens import SCREENS

NAMES = [screen.name for screen in SCREENS]


@pytest.mark.parametrize("name", NAMES)
def test_a_screen_of_an_empty_club_is_a_page(visitor, name):
    answer = visitor.get(name)
    assert answer.status == 200
    assert len(re.findall("<h1", answer.text)) == 1
    assert f'href="/{visitor.secret}/{name}"' in answer.text


@pytest.mark.parametrize("name", NAMES)
def test_an_address_keeps_its_session(visitor, club, name):
    first = club.add_session("Tuesday <b>", "2026-11-17", "sheet 1", None)
    club.add_session("Wednesday", "2026-11-18", "sheet 1", None)
    answer = visitor.get(f"{name}/{first.id}")
    assert answer.status == 200
    assert "Tuesday &lt;b&gt;" in answer.text
    for other in NAMES:
        assert f'href="/{visitor.secret}/{other}/{first.id}"' in answer.text
    assert "Wednesday" in visitor.get(name).text


@pytest.mark.parametrize("name", NAMES)
def test_a_session_that_is_not_there_is_said_so(visitor, name):
    answer = visitor.get(f"{name}/77")
    assert answer.status == 404
    assert "no such session" in answer.text


def test_what_is_not_a_number_is_no_page(visitor):
    assert visitor.get("throws/abc").status == 404
    assert visitor.get("throws/" + "9" * 40).status == 404
