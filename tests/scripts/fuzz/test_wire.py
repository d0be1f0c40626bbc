"""Damaged messages of Digital Curling and of the app: a few to each side, read or refused."""

from __future__ import annotations

import random
from concurrent.futures import ThreadPoolExecutor

import pytest

pytest.importorskip("uvicorn", reason="make setup installs it")

from fuzz import app, wire
from fuzz.inputs import damaged_message

from curling_env.errors import CurlingError


def ends(give, message: bytes) -> str:
    """Return the outcome of a message; in a thread, because other tests keep an event loop in the
    first.
    """
    with ThreadPoolExecutor(1) as aside:
        error = aside.submit(give, message).exception()
    if error is None:
        return "read"
    assert isinstance(error, CurlingError), error
    assert "\n" not in str(error)
    return "refused"


@pytest.mark.parametrize("side", range(4))
def test_damaged_messages_are_read_or_refused_on_every_side(side):
    rng = random.Random(4)
    found = []
    for _ in range(3):
        for sent in list(wire.sides().values())[side][:8]:
            found.append(ends(sent.give, damaged_message(sent.message, rng)))
    assert {"read", "refused"} == set(found)


def test_good_requests_to_the_app_are_answered(tmp_path, monkeypatch):
    tracks = "throw,t,x,y,theta\n" + "".join(
        f"0,{k / 5},0,{2 * k / 5 - 0.02 * k * k / 5 - 11},0\n" for k in range(40)
    )
    club = app.make_club(tmp_path, tracks.encode(), b"throw,athlete,stone,called,note\n0,Bo,1,,\n")
    monkeypatch.chdir(tmp_path / "evening")
    found = {}
    for message in app.requests():
        (tmp_path / "message").write_bytes(message)
        line = message.partition(b" HTTP")[0].decode()
        if "films/2" in line:
            continue  # a name of 254 bytes is for the fuzzer to judge
        found[line] = ends(lambda _: app.answered(club, tmp_path / "message"), b"")
    refused = {line for line, end in found.items() if end == "refused"}
    assert refused == {"POST /the-secret/practice/1/take"}
    assert len(found) > 25
