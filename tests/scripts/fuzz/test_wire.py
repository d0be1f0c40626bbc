"""Damaged messages of Digital Curling: a few to each side, and what counts as unclean."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import pytest

pytest.importorskip("uvicorn", reason="make setup installs it")

from fuzz import wire


def fuzz(count, seed):
    """In a thread of its own: browsers of other tests keep an event loop running in the first."""
    with ThreadPoolExecutor(1) as aside:
        return aside.submit(wire.fuzz, count, seed=seed).result()["sides"]


def test_damaged_messages_are_read_or_refused_on_every_side():
    found = fuzz(25, seed=4)
    assert len(found) == 4
    for side, counts in found.items():
        assert counts["unclean"] == 0, (side, counts["ends"])
        assert counts["read"] + counts["refused"] == 25
        assert min(counts["read"], counts["refused"]) > 0, side


def test_an_error_that_is_no_refusal_is_unclean(monkeypatch):
    def breaks(rng):
        return b"a message", lambda: {}["missing"]

    for side in ("client_of_version_3", "host_of_version_3", "client_of_version_4"):
        monkeypatch.setattr(wire, side, lambda: breaks)
    monkeypatch.setattr(wire, "host_of_version_4", lambda: lambda rng: (b"", lambda: "read"))
    found = fuzz(2, seed=0)
    assert [counts["unclean"] for counts in found.values()] == [2, 2, 2, 0]
    assert "KeyError" in found["host of version 3"]["ends"][0]["error"]
    assert found["host of version 3"]["ends"][0]["message"] == "b'a message'"
