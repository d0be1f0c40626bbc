"""Requests to the app: good ones are answered, damaged ones read or refused."""

from __future__ import annotations

import random
from concurrent.futures import ThreadPoolExecutor

import pytest

pytest.importorskip("uvicorn", reason="make setup installs it")

from fuzz import app
from fuzz.inputs import damaged_message

from curling_env.errors import CurlingError


def outcome(club, message) -> str:
    """Return the outcome of a request; in a thread, because other tests keep an event loop in the
    first.
    """
    with ThreadPoolExecutor(1) as aside:
        error = aside.submit(app.answered, club, message).exception()
    if error is None:
        return "read"
    assert isinstance(error, CurlingError), error
    assert "\n" not in str(error)
    return "refused"


def club_of(folder):
    tracks = "throw,t,x,y,theta\n" + "".join(
        f"0,{k / 5},0,{2 * k / 5 - 0.02 * k * k / 5 - 11},0\n" for k in range(40)
    )
    return app.make_club(folder, tracks.encode(), b"throw,athlete,stone,called,note\n0,Bo,1,,\n")


def test_damaged_requests_are_read_or_refused(tmp_path, monkeypatch):
    club, rng = club_of(tmp_path), random.Random(4)
    monkeypatch.chdir(tmp_path / "evening")
    found = []
    for message in app.requests()[::3]:
        (tmp_path / "message").write_bytes(damaged_message(message, rng))
        found.append(outcome(club, tmp_path / "message"))
    assert {"read", "refused"} == set(found)


def test_good_requests_to_the_app_are_answered(tmp_path, monkeypatch):
    club = club_of(tmp_path)
    monkeypatch.chdir(tmp_path / "evening")
    found = {}
    for message in app.requests():
        (tmp_path / "message").write_bytes(message)
        line = message.partition(b" HTTP")[0].decode()
        if "films/2" in line:
            continue  # a name of 254 bytes is for the fuzzer to judge
        found[line] = outcome(club, tmp_path / "message")
    refused = {line for line, end in found.items() if end == "refused"}
    assert refused == {"POST /the-secret/practice/1/take"}
    assert len(found) > 25
