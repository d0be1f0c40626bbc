"""Every screen answers, with a session and without one."""

from __future__ import annotations

import re

import pytest

from agents.app import SCREENS

NAMES = [screen.name for screen in SCREENS]


def test_a_screen_of_an_empty_club_is_a_page(visitor):
    for name in NAMES:
        answer = visitor.get(name)
        assert answer.status == 200, name
        assert len(re.findall("<h1", answer.text)) == 1, name
        assert f'href="/{visitor.secret}/{name}"' in answer.text


def test_an_address_keeps_its_session(visitor, club):
    first = club.add_session("Tuesday <b>", "2026-11-17", "sheet 1", None)
    club.add_session("Wednesday", "2026-11-18", "sheet 1", None)
    for name in NAMES:
        answer = visitor.get(f"{name}/{first.id}")
        assert answer.status == 200, name
        assert "Tuesday &lt;b&gt;" in answer.text, name
        for other in NAMES:
            assert f'href="/{visitor.secret}/{other}/{first.id}"' in answer.text, name
        assert "Wednesday" in visitor.get(name).text, name


@pytest.mark.parametrize("name", NAMES)
def test_a_session_that_is_not_there_is_reported(lasting_visitor, name):
    answer = lasting_visitor.get(f"{name}/77")
    assert answer.status == 404
    assert "Session 77 does not exist or was removed" in answer.text


def test_what_is_not_a_number_is_no_page(lasting_visitor):
    assert lasting_visitor.get("throws/abc").status == 404
    assert lasting_visitor.get("throws/" + "9" * 40).status == 404


def fillings(path: str):
    """The path of a route with numbers and texts in its places."""
    for number, text in (("0", "x"), ("1", "../../club.sqlite"), ("9" * 15, "%00<b>")):
        yield re.sub(r"{\w+:int}", number, re.sub(r"{\w+(:path)?}", text, path)).lstrip("/")


@pytest.mark.parametrize(
    ("method", "path"),
    [
        (method, path)
        for screen in SCREENS
        for route in screen.routes
        for method in sorted(route.methods - {"HEAD"})
        for path in fillings(route.path)
        if not path.endswith("events")
    ],
)
def test_no_input_causes_an_internal_error(lasting_visitor, method, path):
    visitor = lasting_visitor
    if not visitor.club.sessions():
        visitor.club.add_session("Tuesday", "2026-11-17", "1", None)
    sent = {
        "application/x-www-form-urlencoded": f"csrf={visitor.token}&name=%00&kind=&made=%FF&x=1",
        "application/json": '{"x": [1e999, null, "\ud800"], "stones": 7, "ice": -1}',
        "application/octet-stream": "\x00\xff" * 20,
    }
    for kind, body in sent.items():
        headers = {"content-type": kind, "x-csrf-token": visitor.token}
        for query in ("", "?begin=0", "?begin=x&hand=%00&athlete=<b>&against=zz&believed=-1"):
            answer = visitor.ask(method, path + query, body.encode("utf-8", "replace"), headers)
            assert answer.status < 500, answer.text[:500]
