"""Strangers are kept out: by name, by secret, by origin, by token, by size."""

from __future__ import annotations

import pytest

from agents.app import WorkQueue
from agents.app.application import application
from agents.app.gate import FORM, MAX_BODY, MAX_PIECE


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
    said = visitor.ask(method, "practice", b"", token | {"content-length": str(most + 1)})
    assert said.status == 413
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

    app = application(
        club,
        WorkQueue(club),
        secret="at-home",
        hosts=["127.0.0.1"],
        network=("192.168.1.7", "in-the-hall"),
    )
    home = Visitor(app, secret="at-home")
    hall = Visitor(app, secret="in-the-hall", host="192.168.1.7:8711")
    assert home.get("practice").status == hall.get("practice").status == 200
    assert "http://192.168.1.7:8711/in-the-hall/" in home.get("share").text
    home.secret, hall.secret = hall.secret, home.secret
    assert home.get("practice").status == hall.get("practice").status == 404


def test_an_app_for_this_machine_alone_shows_no_code(visitor):
    assert visitor.get("share").status == 404
