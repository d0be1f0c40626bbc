"""The address is there first; what the club gets comes after."""

from __future__ import annotations

import pytest

pytest.importorskip("starlette", reason="the extra `app` is not installed")

from agents.app.serve import serve


def test_the_address_is_there_before_anything_else_is_done(club):
    result = []

    def begin() -> None:
        result.append("begin")
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        serve(
            club,
            port=0,
            share=False,
            opened=lambda *addresses: result.append(addresses),
            begin=begin,
        )
    (address, shared), after = result
    assert address.startswith("http://127.0.0.1:")
    assert (shared, after) == (None, "begin")
