"""Strangers are kept out: by name, by secret, by origin, by token, by size."""

from __future__ import annotations

import pytest

from agents.app import WorkQueue, gate
from agents.app.application import application
from agents.app.gate import FORM, MAX_BODY, MAX_PIECE, Door


def test_whoever_knows_the_secret_sees_the_pages(visitor):
    answer = visitor.get("practice")
    assert answer.status == 200
    assert "<nav" in answer.text


@pytest.mark.parametrize("secret", ["", "the-secre", "the-secret2", "THE-SECRET", "%00", "é"])
def test_without_the_secret_there_is_nothing(visitor, secret):
    visitor.secret = secret
    for path in ("practice", "static/app.css", ""):
        answer = visitor.get(path)
        assert answer.status == 404
        assert "<nav" not in answer.text


@pytest.mark.parametrize(
    "host", ["evil.example:8711", "127.0.0.1", "127.0.0.1:80", "127.0.0.1:8711.evil.example", ""]
)
def test_a_server_answers_to_its_own_name_only(visitor, host):
    visitor.host = host
    assert visitor.get("practice").status == 403


@pytest.mark.parametrize("origin", ["http://evil.example", "null", "https://127.0.0.1:8711"])
def test_other_pages_may_not_ask(visitor, origin):
    assert visitor.get("practice", origin=origin).status == 403


def test_its_own_pages_may_ask(visitor):
    assert visitor.get("practice", origin="http://127.0.0.1:8711").status == 200


def test_a_form_without_its_token_changes_nothing(visitor, club):
    fields = {"name": "Anna", "hand": "left"}
    body = b"name=Anna&hand=left&csrf=" + b"0" * 32
    for kind in (FORM, "text/plain", "multipart/form-data; boundary=x", "application/json"):
        answer = visitor.ask("POST", "practice", body, {"content-type": kind})
        assert answer.status == 403
    assert club.athletes() == []
    # With its token it comes through the gate, whatever the screen says to it.
    assert visitor.post("practice", fields).status != 403


@pytest.mark.parametrize(("method", "most"), [("POST", MAX_BODY), ("PUT", MAX_PIECE)])
def test_long_requests_are_refused_by_what_they_say_and_by_what_comes(visitor, method, most):
    token = {"x-csrf-token": visitor.token}
    answer = visitor.ask(method, "practice", b"", token | {"content-length": str(most + 1)})
    assert answer.status == 413
    came = visitor.ask(
        method, "practice", b"x" * (most + 1), {"content-type": FORM, "content-length": "5"}
    )
    assert came.status in (403, 413)


def test_every_answer_forbids_what_is_not_the_apps_own(visitor):
    for path in ("practice", "static/app.css", "no-such-page"):
        policy = visitor.get(path).headers["content-security-policy"]
        assert "default-src 'none'" in policy
        assert "script-src 'self';" in policy
        assert "unsafe" not in policy
        assert "frame-ancestors 'none'" in policy


def test_shared_each_door_has_its_own_secret(club):
    from tests.agents.app.conftest import Visitor

    app = application(club, WorkQueue(club), secret="at-home", hosts=["127.0.0.1"])
    app.sharing.doors += [
        Door("in-the-hall", frozenset({"192.168.1.7"})),
        Door("on-the-wall", frozenset({"192.168.1.7"}), may_write=False),
    ]
    home = Visitor(app, secret="at-home")
    hall = Visitor(app, secret="in-the-hall", host="192.168.1.7:8711")
    wall = Visitor(app, secret="on-the-wall", host="192.168.1.7:8711")
    assert [one.get("practice").status for one in (home, hall, wall)] == [200, 200, 200]
    about = {"name": "Tuesday", "day": "2026-11-17", "sheet": "2"}
    assert [one.post("practice", about).status for one in (home, hall, wall)] == [303, 303, 403]
    assert wall.put("practice/films/1?begin=0", b"x").status == 403
    assert wall.send("throw/targets", {}).status == 403
    throw = {"ice": "standard", "throw": {"speed": 2.1}}
    assert wall.send("throw/run", throw).status == 200  # a question, which changes nothing
    assert hall.post("share", {"share": "on"}).status == 403
    home.secret, hall.secret = hall.secret, home.secret
    assert home.get("practice").status == hall.get("practice").status == 404


def test_sharing_is_a_switch_with_links_that_only_show(browser, club, serve_club, monkeypatch):
    monkeypatch.setattr(gate, "network_address", lambda: "127.0.0.2")
    club.add_session("Tuesday", "2026-11-17", "2", None)
    with serve_club(club) as address:
        page, others = browser.new_page(), browser.new_page()
        page.goto(address)
        page.get_by_role("link", name="Share with phones and tablets").click()
        page.get_by_role("button", name="Share with this network").click()
        page.get_by_text("may be put on the wall").wait_for()
        reading, writing = page.locator("code").all_inner_texts()
        for link, shown in ((reading, False), (writing, True)):
            others.goto(link)
            others.get_by_role("heading", name="Films").wait_for()
            assert others.locator("#drop").is_visible() == shown
            others.goto(f"{link}share")
            assert (writing in others.locator("code").all_inner_texts()) == shown
        page.get_by_role("button", name="End sharing").click()
        page.get_by_role("button", name="Share with this network").wait_for()
        with pytest.raises(Exception, match="ERR_CONNECTION_REFUSED"):
            others.goto(writing)
        page.close()
        others.close()
